"""kincheck fit: the table behind the curves of a rig, with intervals."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from ...case.io.reader_options import CurveOptions
from ...cli.registry import Registry, Status
from ...cli.shared_options import OfCase
from ...errors import refuse
from ...options import destination, group, json_file, option, options, with_values

DRAWING, RATE = "+- 2 mm", "+- 30 %"

if TYPE_CHECKING:
    from ...trajectory import Array
    from .fit import Fitted, Shift


@options
class Fit(OfCase):
    """Fit a table of hardpoints to curves of a rig, and tell how much the rig determines.

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
    drawing: str | None = option(
        f"standard deviation of a coordinate from the drawing; default: {DRAWING}, of the rate of a"
        f" bushing {RATE}%",
        metavar="SIZE",
    )
    bushings: Path | None = option(
        "bushings of the table, as of kincheck kc: fit their rates to curves of kc, and leave the"
        ' points as they are; a move is "lca_front: y +- 30 %%"',
        Path,
        "FILE",
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
        """Fit a table of hardpoints to curves of a rig.

        Raises:
            KincheckError: a file or an option makes no sense, or the table does not reach the
                travel of the rig.
        """
        from .fit import fit
        from .new_table import table_of

        supplied = replace(self.supplied, bushings=self.bushings)
        case = table_of(with_values(self, supplied=supplied), registry)
        usual = self.drawing or (RATE if self.bushings else DRAWING)
        return fit(case, Path(self.measured), self.curve, usual, self.move, self.free)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...case.io.atomic_files import write
        from .fit import Verdict
        from .fit_views import page, report
        from .new_table import NewTable, require_new
        from .pages import tell
        from .rubber import new_bushings

        require_new(self.out, ".toml" if self.bushings else ".csv")
        refuse(self.unwritable())
        found = self.answer(registry)
        fits, checked = found.verdict is not Verdict.OFF, None
        out, written = self.out if fits else None, ""
        if out is not None:
            written = f"{out}: written"
            if self.bushings is not None:
                text = new_bushings(self.bushings, found.rig.case, found.moves)
                write("--out", out, text.encode())
            else:
                new = NewTable.of(self, found.rig.case, found.moves)
                checked = new.check(registry)
                new.write(out)
                written += f", solved again by {checked}" if checked else ""
        tell(self, facts(found, out, checked), report(found), lambda: page(found), written)
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
        return about | (interval(each.size, each.deviation) if isfinite(each.deviation) else {})

    rig, deviations = found.rig, found.deviations
    return {
        "schema": "kincheck-fit/1",
        "case": rig.case.name,
        "verdict": str(found.verdict),
        "probability": found.first.probability,
        "misfit": found.first.misfit,
        "numbers": rig.count,
        "noise": {
            goal.output: {"deviation": median(noise.tolist()), "source": what}
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
    """Return numbers, None for unknown ones."""
    return [x if isfinite(x) else None for x in values.tolist()]
