"""A diagnosis as text and tables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ...report.terminal import columns
from .bump_steer import REACH
from .diagnose import Determinacy, Diagnosis, Sample
from .rank import NamedRow, describe_screws

# Rows of tables, which only show where to look; the JSON has all.
SAMPLES, PLACES, TERMS = 9, 5, 6
# Components of unit vectors below it are zero.
ROUND_OFF = 1e-12


def print_diagnosis(
    found: Diagnosis, console: Console, *, quiet: bool = False, verbose: bool = False
) -> None:
    """Print the diagnosis: verdict, findings, and the numbers behind them.

    Args:
        quiet: print verdict and findings alone.
        verbose: print all samples, terms and sensitivities, not only the worst.
    """
    for each in _verdict(found):
        console.print(each, soft_wrap=True)
    for each in () if quiet else _parts(found, verbose):
        console.print(each, soft_wrap=isinstance(each, Text))


def _verdict(found: Diagnosis) -> Iterator[Text]:
    style = "bold red" if found.findings else "bold green"
    yield Text.assemble((f"{found.case}: ", "bold"), (found.verdict, style))
    for finding in found.findings:
        yield Text(f"finding: {finding}", "red")
    for note in found.notes:
        yield Text(f"note: {note}", "yellow")


def _parts(found: Diagnosis, verbose: bool) -> Iterator[Text | Table]:
    yield from _freedom(found, len(found.redundant) if verbose else TERMS)
    if found.samples:
        yield from _conditioning(found, len(found.samples) if verbose else SAMPLES)
    if found.budgets:
        yield from _budgets(found)
    if found.sensitivities:
        yield from _sensitivities(found, len(found.sensitivities) if verbose else PLACES)
    if found.shims:
        yield from _shims(found)
    if found.determinacy is not None:
        yield from _forces(found.determinacy)
    if found.not_derived and found.samples:
        yield Text(
            "not functions of the pose alone, so without tolerance here:"
            f" {_names(found.not_derived)}"
        )
    if found.programs:
        yield _head("what the native engine computes")
        yield from map(Text, found.programs)


def _head(line: str) -> Text:
    return Text(f"\n{line}", "bold")


def _freedom(found: Diagnosis, terms: int) -> Iterator[Text | Table]:
    freedom = found.freedom
    yield _head(
        f"freedom: {freedom.coordinates} coordinates - rank {freedom.rank} of {freedom.rows} joint"
        f" rows = {freedom.dof}; drivers: {_names(freedom.drivers)}"
    )
    yield Text(f"by the paper's count {freedom.paper}")
    table = columns("component", ">unknowns", ">rows", ">rank", ">freedom", "drivers")
    for each in found.components:
        numbers = (f"{n}" for n in (each.unknowns, each.rows, each.rank, each.dof))
        table.add_row(_names(each.bodies), *numbers, _names(each.drivers))
    yield table
    if not found.redundant:
        yield Text("redundant rows: none")
    for each in found.redundant:
        digits = f" to {each.off:.1e}" if each.off else ""
        yield Text(f"redundant{digits}: {each.row} = {_sum(each.repeats, terms)}")
    if found.redundant_residual is not None and not all(each.off for each in found.redundant):
        yield Text(f"  along the sweep they hold to {found.redundant_residual:.1e} m")
    for each in found.nearly_redundant:
        yield Text(
            f"nearly redundant ({each.size:.1e}): {', '.join(map(str, each.rows))}", "yellow"
        )


def _sum(terms: Sequence[tuple[float, NamedRow]], most: int) -> str:
    if len(terms) > most:
        return (
            f"a sum of {len(terms)} rows of"
            f" {_names(list(dict.fromkeys(row.owner for _, row in terms)))}"
        )
    parts = [f"{'-' if w < 0.0 else '+'} {abs(w):.3g} [{row}]" for w, row in terms]
    return " ".join(parts).removeprefix("+ ") or "0"


def _conditioning(found: Diagnosis, most: int) -> Iterator[Text | Table]:
    worst, count = found.worst, len(found.samples)
    yield _head(f"conditioning along the sweep, {count} samples looked at, {found.reached} reached")
    table = columns(f">{found.swept}", ">smallest sv", ">condition", "det", "least determined")
    shown = {round(k * (count - 1) / max(1, most - 1)) for k in range(most)}
    for k, each in enumerate(found.samples):
        if k in shown or each is worst:
            condition = "singular" if each.condition is None else f"{each.condition:.3g}"
            sign = "+" if each.orientation > 0 else "-" if each.orientation < 0 else "0"
            moving = describe_screws(each.direction, 1)
            table.add_row(
                f"{each.value:.6g}",
                f"{each.smallest:.4g}",
                condition,
                sign,
                moving,
                style="bold" if each is worst else None,
            )
    yield table
    if worst is not None:
        yield Text(
            f"worst at {found.swept} = {worst.value:.9g}: {describe_screws(worst.direction)}"
        )
    yield from _changes(found.samples, found.swept)


def _changes(samples: Sequence[Sample], swept: str) -> Iterator[Text]:
    for before, after in pairwise(samples):
        if before.orientation * after.orientation < 0.0:
            where = f"between {swept} = {before.value:.6g} and {after.value:.6g}"
            yield Text(
                f"the determinant changes its sign {where}: there is a singular pose", "yellow"
            )


def _forces(found: Determinacy) -> Iterator[Text | Table]:
    yield _head(f"forces, if asked for: {found}")
    if found.partly:
        table = columns(
            *("joint", ">force", ">moment", ">wrench", "force determined along"),
            "moment determined along",
        )
        for each in found.partly:
            table.add_row(
                each.joint,
                *(
                    f"{n} of {of}"
                    for n, of in ((each.force, 3), (each.moment, 3), (each.wrench, 6))
                ),
                _directions(each.force_along),
                _directions(each.moment_along),
            )
        yield table
        yield Text("directions are global axes at the first sample; other components are null")
    if found.efforts:
        yield Text(f"undetermined efforts: {_names(found.efforts)}", "yellow")


def _directions(found: Sequence[Sequence[float]]) -> str:
    """Return directions in words; two of them by the one that is left out."""
    if len(found) == 3:
        return "all"
    if len(found) == 2:
        (x, y, z), (u, v, w) = found
        return f"all across {_direction((y * w - z * v, z * u - x * w, x * v - y * u))}"
    return _direction(found[0]) if found else "none"


def _direction(axis: Sequence[float]) -> str:
    first = next((x for x in axis if abs(x) > ROUND_OFF), 1.0)
    turned = [x if first > 0.0 else -x for x in axis]
    return f"[{', '.join(f'{0.0 if abs(x) < ROUND_OFF else x:.4g}' for x in turned)}]"


def _budgets(found: Diagnosis) -> Iterator[Text | Table]:
    yield _head(
        "round-off budget: what residuals that engines leave shift outputs by, and the tolerance"
        " that follows"
    )
    yield from _signs(found)
    table = columns(
        "output",
        ">shift",
        ">at",
        ">double precision",
        ">suggested",
        ">case has",
        "unit",
        "largest share",
    )
    for each in found.budgets:
        numbers = (
            f"{each.shift:.3g}",
            f"{each.at:.4g}",
            f"{each.round_off:.1e}",
            f"{each.suggested:.2g}",
            f"{each.atol:.3g}",
        )
        table.add_row(each.output, *numbers, each.unit, f"{each.row} ({each.share:.0%})")
    yield table
    yield Text(f'why = "{max(found.budgets, key=lambda each: each.shift).why}"')


def _signs(found: Diagnosis) -> Iterator[Text]:
    if found.signs:
        yield Text(f"signs: {found.signs}")


def _shims(found: Diagnosis) -> Iterator[Text | Table]:
    yield _head("shims of 1 mm at design: links keep their lengths, the wheel keeps its height")
    angles = ("toe", "camber", "caster")[: len(next(iter(found.shims.values())))]
    heads = [f">{output} {axis}" for output in angles for axis in "xyz"]
    table = columns("joint moved along", *heads, "")
    for name, rows in found.shims.items():
        numbers = [1e-3 * math.degrees(each) for row in rows for each in row]
        table.add_row(name, *(f"{0.0 + round(each, 4):+.4f}" for each in numbers), "deg")
    yield table
    if found.no_bump_steer:
        now = "–" if found.bump_steer is None else f"{math.degrees(found.bump_steer):+.3g} deg/m"
        yield _head(
            f"no bump steer at design ({now} now), if one of these moves alone in the table, and"
            " what is left with it, solved again"
        )
        table = columns("along", ">x", ">y", ">z", "")
        for name, moves in found.no_bump_steer.items():
            left = found.bump_steer_left.get(name, [None] * len(moves))
            table.add_row(name, *map(_move, moves, left), "mm, deg/m")
        yield table


def _move(move: float | None, left: float | None) -> str:
    """Return a move and the bump steer left with it; or no move in reach."""
    if move is None:
        return "–"
    shown = f"{1e3 * move:+.1f}"
    if abs(move) > REACH:
        return f"none in reach ({shown})"
    return f"{shown} ({'not solved' if left is None else f'{math.degrees(left):.1g} left'})"


def _sensitivities(found: Diagnosis, most: int) -> Iterator[Text | Table]:
    yield _head(
        "sensitivity of the outputs to the geometry, drivers held"
        + (f": the {most} largest of each" if most == PLACES else "")
    )
    yield from _signs(found)
    table = columns("output", "number", ">largest", "unit", f">at {found.swept}")
    shown: dict[str, int] = {}
    for each in found.sensitivities:
        shown[each.output] = shown.get(each.output, 0) + 1
        if shown[each.output] > most:
            continue
        at = found.samples[each.by_sample.index(each.largest)].value
        name = each.output if shown[each.output] == 1 else ""
        table.add_row(name, each.number, f"{each.largest:+.4g}", each.unit, f"{at:.4g}")
    yield table
    together = [places for name, places in found.moves.items() if name in places[:-1]]
    if together:
        yield Text(f"moved together: {_names([' = '.join(each) for each in together])}")
    if found.binding:
        places = dict.fromkeys(number.removesuffix(" " + number[-1]) for number in found.binding)
        yield Text(
            "changed alone, numbers of these bind (redundant rows contradict the others):"
            f" {_names(list(places))}",
            "yellow",
        )


def _names(found: Sequence[str]) -> str:
    return ", ".join(found) or "none"
