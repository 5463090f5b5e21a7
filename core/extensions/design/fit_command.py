"""kincheck fit: the table that a rig measured, and what the rig determines of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...case.io.reader_options import CurveOptions
from ...cli.registry import Registry, Status
from ...cli.shared_options import OfCase
from ...errors import refuse, shortened
from ...options import destination, group, json_file, option, options
from .new_table import require_new, table_of, write_new

if TYPE_CHECKING:
    from ...case.case import Case
    from ...trajectory import Array
    from .fit import Fitted, Shift

DRAWING = "+- 2 mm"
MOST_SLIPS, MOST_COMBINATIONS = 8, 12


@options
class Fit(OfCase):
    """Fit a table of hardpoints to curves that a rig measured, and say what the rig determines.

    The fit is the most likely table, by the noise of the rig and the deviation of the drawing. All
    intervals are of 95 %. Exit status: 0 the table fits, even if slips of the file fit as well;
    1 it does not fit, and nothing is written; 2 the tool could not do its work.
    """

    about = "hardpoint table: fit it to measured curves, with what they determine"
    measured: Path = option(
        "measured curves: CSV, text or .xlsx, with a column of the travel and outputs by the names"
        " of kincheck run or of rigs",
        Path,
        "RIG",
        required=True,
    )
    move: tuple[str, ...] = option(
        'points that may be off, with or without a deviation of their own: "tierod_inner: y z",'
        ' "lca_outer: +- 0.5 mm"; may be repeated; default: all points',
        metavar="MOVE",
        several="repeated",
    )
    drawing: str = option(
        "standard deviation of a coordinate from the drawing; default: %(default)s",
        metavar="LENGTH",
        default=DRAWING,
    )
    free: tuple[str, ...] = option(
        'zero or scale that the rig does not know: "toe zero", "camber scale", "travel zero"; may'
        " be repeated",
        metavar="NAME",
        several="repeated",
    )
    out: Path | None = destination("write the fitted table, as CSV", Path)
    page: Path | None = destination("write a page with residuals, moves and combinations", Path)
    json: str | None = json_file("the answer")
    curve: CurveOptions = group(default_factory=CurveOptions)

    def answer(self, registry: Registry) -> Fitted:
        """Fit a table of hardpoints to curves that a rig measured.

        Raises:
            KincheckError: a file or an option makes no sense, or the table does not reach the
                travel of the rig.
        """
        return self._fitted(table_of(self, registry)[0])

    def _fitted(self, case: Case) -> Fitted:
        from .fit import fit

        return fit(case, Path(self.measured), self.curve, self.drawing, self.move, self.free)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...case.io.atomic_files import write
        from ...report.terminal import with_json
        from .fit import Verdict

        require_new(self.out)
        refuse(self.unwritable())
        case, file = table_of(self, registry)
        found = self._fitted(case)
        fits, checked = found.verdict is not Verdict.OFF, None
        if fits and self.out is not None:
            checked = write_new(self.out, case, file, self.supplied, found.moves, registry)
        if self.page is not None:
            from .fit_page import page

            write("--page", self.page, page(found).encode())
        with with_json(facts(found, self.out if fits else None, checked), self.json) as console:
            print(*_lines(found), sep="\n", file=console.file)
            if fits and self.out is not None:
                by = f"solved again by {checked}" if checked else "no other engine is installed"
                print(f"\n{self.out}: written, {by}", file=console.file)
        return Status.WITHIN if fits else Status.DEVIATES


def facts(found: Fitted, out: Path | None = None, checked: str | None = None) -> dict[str, Any]:
    """Return the answer as plain data [SI], with standard deviations."""
    from .fit import NORMAL
    from .identify import source

    def interval(value: float, deviation: float) -> dict[str, Any]:
        half = NORMAL * deviation
        return {"value": value, "deviation": deviation, "interval": [value - half, value + half]}

    def shifted(each: Shift) -> dict[str, Any]:
        about = {"name": each.name, "unit": each.si, "p": each.chance}
        return about | (interval(each.size, each.deviation) if np.isfinite(each.deviation) else {})

    rig, deviations = found.rig, found.deviations
    return {
        "schema": "kincheck-fit/1",
        "case": rig.case.name,
        "verdict": str(found.verdict),
        "probability": found.first.probability,
        "misfit": found.first.misfit,
        "numbers": rig.count,
        "noise": {
            goal.output: {"deviation": float(np.median(noise)), "source": what}
            for goal, noise, what in zip(rig.goals, rig.noise, rig.sources, strict=True)
        },
        "directions": [
            {
                "terms": each.terms,
                **interval(each.value, each.deviation),
                "drawing": each.drawing,
                "from": each.source,
            }
            for each in found.combinations
        ],
        "null": len(found.null),
        "null_directions": found.null,
        "predictions": {
            name: {
                "travel": rig.case.sweep.values.tolist(),
                "value": _plain(each.values),
                "deviation": _plain(each.spread),
                "low": _plain(each.values - NORMAL * each.spread),
                "high": _plain(each.values + NORMAL * each.spread),
                "drawing": _plain(each.drawing),
                "from": each.source,
            }
            for name, each in found.predictions.items()
        },
        "coordinates": {
            place: {
                **interval(move, deviations[place]),
                "drawing": found.boxes[place],
                "from": source(deviations[place], found.boxes[place]),
            }
            for place, move in found.moves.items()
        },
        "moves_m": found.moves,
        "without_effect": found.idle,
        "offsets": [*map(shifted, found.shifts)],
        "slips": [
            *map(shifted, found.found),
            *(
                {"name": each.name, "p": each.chance, "largest_move": each.largest}
                for each in found.slips
            ),
            *map(shifted, found.loose),
        ],
        "off_at": found.worst,
        "checked_by": checked,
        "file": str(out) if out is not None else None,
    }


def _plain(values: Array) -> list[float | None]:
    """Return numbers, None for those that are unknown."""
    return [x if np.isfinite(x) else None for x in values.tolist()]


def _lines(found: Fitted) -> Iterator[str]:
    from .fit import ALPHA, Verdict

    rig, first, estimate = found.rig, found.first, found.estimate
    slips = [f"{each.name} (p {each.chance:.2g})" for each in found.slips]
    yield f"{rig.case.name}: {headline(found)}"
    outputs = ", ".join(goal.output for goal in rig.goals)
    yield (
        f"  {rig.count} numbers of {outputs}: misfit {first.misfit:.1f}, p {first.probability:.2g},"
        f" {first.rounds} rounds"
    )
    for goal, noise, source in zip(rig.goals, rig.noise, rig.sources, strict=True):
        unit = rig.unit(goal)
        yield f"  noise of {goal.output}: {np.median(noise) / unit.size:.2g} {unit.name}, {source}"
    yield from (f"  note: {each}" for each in rig.notes)
    off = found.verdict is Verdict.OFF
    if off and not found.found and slips:
        yield f"  fits with: {shortened(slips, MOST_SLIPS)}"
    if estimate.probability < ALPHA:
        yield "  no estimate is given, since nothing fits; correct the file, or the table"
        return
    if found.found:
        yield (
            f"  fits without: {'; '.join(each.words for each in found.found)}; p"
            f" {estimate.probability:.2g}. Correct the file, or say"
            f' --free "{found.found[0].name}" for a zero or scale. Below, they are taken out.'
        )
    yield from (f"  also fits: {each}" for each in slips[:MOST_SLIPS])
    for each in found.loose:
        yield f"  also fits: {each.words}, which the rig cannot tell from moved points"
    yield "All ± below are intervals of 95 %."
    yield from _determined(found)


def headline(found: Fitted) -> str:
    """Return the verdict in words."""
    from .fit import Verdict

    others = [*(each.name for each in found.slips), *(each.name for each in found.loose)]
    if found.verdict is Verdict.OTHERS:
        return f"fits, but so does {shortened(others, 3)}"
    if found.verdict is Verdict.OFF:
        where = [each.words for each in found.found] or [found.worst]
        return f"does not fit, off at {'; '.join(where)}"
    return str(found.verdict)


def _determined(found: Fitted) -> Iterator[str]:
    """Yield what the rig determines: combinations, predictions, offsets, coordinates."""
    from .fit import NORMAL
    from .identify import BETTER, source

    unit = found.length
    size = NORMAL / unit.size
    known = [each for each in found.combinations if each.deviation < BETTER * each.drawing]
    yield (
        f"\n{len(known)} of {len(found.boxes)} combinations are known better by the rig than by the"
        f" drawing, {len(found.null)} have no effect on what it measured [{unit.name}]:"
    )
    for each in known[:MOST_COMBINATIONS]:
        value, half = each.value / unit.size, size * each.deviation
        yield f"  {each.words}: {value:+.3f} ± {half:.3f}, drawing ± {size * each.drawing:.3f}"
    yield from (f"  no effect: {each}" for each in found.null)
    if found.idle:
        yield f"  left out, nothing measured follows: {shortened([*found.idle], 6)}"
    yield "\nPredictions, not measured:"
    for name, each in found.predictions.items():
        shown, k = found.unit_of(name), found.told_at(each)
        where = f"{found.rig.case.sweep.values[k] / found.along.size:.4g} {found.along.name}"
        value, half, drawn = (
            float(x[k]) / shown.size for x in (each.values, each.spread, each.drawing)
        )
        yield (
            f"  {name} at {where}: {value:.5g} ± {NORMAL * half:.2g} {shown.name}, by the"
            f" drawing alone ± {NORMAL * drawn:.2g}; {each.source}"
        )
    yield "\nOffsets of the rig, beside moved points:"
    yield from (f"  {each.words}" for each in found.shifts if np.isfinite(each.deviation))
    yield f"\nCoordinates, moved from the drawing [{unit.name}]:"
    for place, move in found.moves.items():
        half, box = size * found.deviations[place], size * found.boxes[place]
        yield f"  {place}: {move / unit.size:+.3f} ± {half:.3f}; {source(half, box)}"
