"""kincheck tune: the least change of a table of hardpoints to reach a target."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, cast

from ...cli.registry import Registry, Status
from ...cli.shared_options import OfCase
from ...errors import refuse
from ...options import destination, json_file, option, options, whole

if TYPE_CHECKING:
    from .tune import Tuned

STARTS = 6


@options
class Tune(OfCase):
    """Find the least change of a table of hardpoints to bring outputs into bands.

    The change is least in its norm: the root of the sum of squares of all moves over their boxes.
    The search is local, from several starts. Another engine solves the answer again before it is
    written. Exit status: 0 all bands are held; 1 the target cannot be reached as far as the search
    sees, and nothing is written; 2 the tool could not do its work.
    """

    about = "hardpoint table: the least change that brings curves into bands"
    goal: tuple[str, ...] = option(
        'a band over the whole travel, at one travel, or about a curve: "toe = 0 +- 0.05 deg",'
        ' "camber at 30mm = -1.2 +- 0.1 deg", "toe = rig.csv +- 0.02 deg"; may be repeated',
        metavar="GOAL",
        several="repeated",
        required=True,
    )
    move: tuple[str, ...] = option(
        'points that may move, their axes in the table and their box: "tierod_inner: y z +- 15 mm",'
        ' "uca_outer: z +5 -10 mm"; may be repeated',
        metavar="MOVE",
        several="repeated",
        required=True,
    )
    starts: int = option(
        "number of starts of the search: the table, and random designs of the box; default"
        " %(default)s",
        whole(1),
        "N",
        default=STARTS,
    )
    out: Path | None = destination("write the new table, as CSV", Path)
    json: str | None = json_file("the answer")

    def answer(self, registry: Registry) -> Tuned:
        """Find the least change of a table of hardpoints to bring outputs into bands.

        Raises:
            KincheckError: a goal or move makes no sense, the table does not reach its travel, or
                another engine contradicts the answer.
        """
        from .new_table import table_of
        from .tune import tune

        case, file = table_of(self, registry)
        return tune(case, file, self.supplied, (self.goal, self.move), self.starts, registry)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...report.sections import print_report
        from ...report.terminal import with_json
        from ..hardpoints.saving import write_table
        from .new_table import require_new

        require_new(self.out)
        refuse(self.unwritable())
        found = self.answer(registry)
        if found.reached and self.out is not None:
            write_table(found.table, self.supplied, found.points, self.out, f"--out {self.out}")
        with with_json(_facts(found, self.out), self.json) as console:
            print(*_lines(found), sep="\n", file=console.file)
            if found.comparison is not None:
                print_report(found.comparison, cast(TextIO, console.file))
            if found.reached and self.out is not None:
                print(f"\n{self.out}: written", file=console.file)
        return Status.WITHIN if found.reached else Status.DEVIATES


def _facts(found: Tuned, out: Path | None) -> dict[str, Any]:
    """Return the answer as plain data [SI]."""
    return {
        "schema": "kincheck-tune/1",
        "case": found.case.name,
        "reached": found.reached,
        "search": "local",
        "norm": found.move.norm,
        "moves_m": found.moves,
        "boxes_m": {name: [each.low, each.high] for name, each in found.boxes.items()},
        "bands": [
            {
                "goal": each.goal.text,
                "output": each.goal.output,
                "before": list(each.before),
                "after": list(each.after),
                "excess": each.excess,
                "held": each.held,
                "tight_at": each.tight,
                "multiplier": each.multiplier,
            }
            for each in found.bands
        ],
        "rounds": found.rounds,
        "designs": found.designs,
        "starts": found.ends,
        "checked_by": found.checked,
        "file": str(out) if out is not None and found.reached else None,
    }


def _lines(found: Tuned) -> list[str]:
    from ...report.axis import number

    norm = f"norm {found.move.norm:.6g}"
    counts = f"{found.rounds} rounds, {found.designs} designs"
    agree = f"{found.same_ends} of {len(found.ends)} starts end here; the search is local"
    head = f"{found.case.name}: reached, {norm}" if found.reached else ""
    if not found.reached:
        worst = max(found.bands, key=lambda each: each.excess)
        head = (
            f"{found.case.name}: not reached, no table is written. Forbidden by"
            f" {worst.goal.text!r}: at best {number(worst.excess * worst.size)} {worst.unit}"
            f" beyond its band at {found.at(worst.worst)}"
        )
    lines = [head, f"  {counts}; {agree}", *(f"  note: {each}" for each in found.notes)]
    for each in found.bands:
        low, high = (number(x / each.size_of_unit) for x in each.after)
        was = " to ".join(number(x / each.size_of_unit) for x in each.before)
        line = f"  {each.goal.text}: {low} to {high} {each.unit}, before {was}"
        if each.tight and found.reached:
            places = ", ".join(map(found.at, each.tight))
            line += f"; tight at {places}"
            if each.multiplier > 0.0:
                gain = each.multiplier * each.goal.tolerance * 0.1
                line += f"; a band wider by 10 % lowers the norm by {gain:.3g}"
        elif not each.held:
            line += f"; {number(each.excess * each.size)} {each.unit} beyond"
        lines.append(line)
    for name, move in found.moves.items():
        box = found.boxes[name]
        gap = min(box.high - move, move - box.low)
        at_end = ", the end of its box" if gap <= 1e-6 * box.size else ""
        unit = found.length
        lines.append(
            f"  {name}: {move / unit.size:+.4f} {unit.name},"
            f" box {number(box.low / unit.size)} to {number(box.high / unit.size)}{at_end}"
        )
    return lines
