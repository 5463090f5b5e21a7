"""The report of a tuned table: bands, moves, and old against new."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...errors import number_of
from ...report.axis import number
from ...report.figures import Style
from ...report.sections import Diagram, Report, Section
from ...unit_text import with_unit
from . import pages
from .goals import unit_in_table
from .tune import Band, Tuned

WIDER = 0.1
"""A band wider by this share tells what it is worth."""
_NEW, _OLD = Style.number(0, "new"), Style.number(1, "old")


def report(found: Tuned, checked: str | None = None, others: Sequence[Section] = ()) -> Report:
    """Return the bands and the moves.

    Args:
        checked: the engine that confirms the table; None without one.
        others: old against new.
    """
    ends = f"{found.same_ends} of {number_of(len(found.ends), 'start')}"
    facts = [
        f"{number_of(found.rounds, 'round')}, {number_of(found.designs, 'design')}",
        f"{ends} end here, the search is local",
    ]
    if found.reached:
        facts += [f"solved again by {checked}" if checked else "no other engine can check it"]
    sections = [_bands(found), _moves(found), *others]
    return Report("tune", f"{found.case.name}: {headline(found)}", facts, sections)


def headline(found: Tuned) -> str:
    """Return whether the target is reached, and else what forbids it."""
    if found.reached:
        return f"reached, norm {found.move.norm:.6g}"
    proof = "proved" if found.proved else "not proved"
    return f"not reached ({proof}), forbidden by {' and '.join(map(repr, found.forbidding))}"


def _bands(found: Tuned) -> Section:
    rows = [
        [
            each.goal.text,
            *(
                " to ".join(dict.fromkeys(number(x / each.goal.unit.size) for x in ends))
                for ends in each.ranges
            ),
            each.goal.unit.name,
            *_edge(found, each),
        ]
        for each in found.bands
    ]
    verdict = list[str]()
    if found.proved:
        verdict.append("Two bands of one output have no value in common.")
    heads = ["band", "before", "after", "unit", "state", f"norm saved by {WIDER:.0%} wider"]
    diagrams = [_curve(found, k, each) for k, each in enumerate(found.bands)]
    return Section("Bands", verdict, found.notes, heads, 5, rows, diagrams)


def _edge(found: Tuned, band: Band) -> Iterator[str]:
    """Yield the state of a band, and what a wider one saves."""
    worst = found.text_at(float(band.at[band.beyond.argmax()]))
    off = band.excess * band.goal.tolerance / band.goal.unit.size
    if not found.reached and off > 0.0:
        yield f"{number(off)} {band.goal.unit.name} beyond at {worst}"
    else:
        tight = ", ".join(map(found.text_at, band.tight))
        yield f"tight at {tight}" if tight else "held"
    saved = band.multiplier * band.goal.tolerance * WIDER if found.reached else 0.0
    yield f"{saved:.3g}" if saved > 0.0 else ""


def _curve(found: Tuned, k: int, band: Band) -> Diagram:
    goal = band.goal
    curves = [(_OLD, band.before, "lines"), (_NEW, band.after, "lines")]
    low, high = (
        pages.whole(goal, goal.middle + side * goal.tolerance, found.case) for side in (-1.0, 1.0)
    )
    around = low, high, goal.text
    return pages.over_travel(k, goal.output, goal.unit, found.case, curves, around)


def _moves(found: Tuned) -> Section:
    unit, rows = unit_in_table("m", found.case), list[list[str]]()
    for name, move in found.moves.items():
        box = found.boxes[name]
        at_end = min(box.high - move, move - box.low) <= 1e-6 * box.size
        ends = f"{number(box.low / unit.size)} to {number(box.high / unit.size)}"
        share = f"{move / box.size:+.1%}"
        rows.append([name, f"{move / unit.size:+.4f}", ends, share, "end of its box" * at_end])
    heads = ["coordinate", with_unit("moved", unit.name), "box", "of the box", ""]
    return Section("Moves", [], [], heads, 1, rows)
