"""kincheck tune: the least change of a table of hardpoints to reach a target."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

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
        ' "uca_outer: z +5 -10 mm"; the length of a rod: "tie_rod: length +- 5 mm"; shims:'
        ' "uca_front, uca_rear: shim y +- 4 mm"; may be repeated',
        metavar="MOVE",
        several="repeated",
        required=True,
    )
    keep_clear: tuple[str, ...] = option(
        "box of another part that no point may be in, over the whole travel, along the axes of the"
        ' table: "damper: -30:30 380:470 90:300 mm"; may be repeated',
        metavar="BOX",
        several="repeated",
    )
    starts: int = option(
        "number of starts of the search: the table, and random designs of the box; default"
        " %(default)s",
        whole(1),
        "N",
        default=STARTS,
    )
    out: Path | None = destination("write the new table, as CSV", Path)
    page: Path | None = destination("write a page with curves, bands and moves", Path)
    json: str | None = json_file("the answer")

    def answer(self, registry: Registry) -> Tuned:
        """Find the least change of a table of hardpoints to bring outputs into bands.

        Raises:
            KincheckError: a goal or move makes no sense, or the table does not reach its travel.
        """
        from .goals import parts_of, read_goals, read_moves
        from .new_table import table_of
        from .search import read_clear
        from .tune import tune

        case = table_of(self, registry)
        case, goals, notes = read_goals(self.goal, case, self.supplied)
        clear = read_clear(self.keep_clear, case)
        return tune(case, goals, read_moves(self.move, parts_of(case)), self.starts, clear, notes)

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from . import pages
        from .new_table import NewTable, require_new
        from .tune_views import report

        require_new(self.out)
        refuse(self.unwritable())
        found = self.answer(registry)
        out, checked, others, moves = None, None, (), found.moves
        if found.reached:
            new = NewTable.of(self, found.case, found.moves)
            checked, others, out = new.check(registry), new.compare(registry), self.out
            moves = new.moves
            if out is not None:
                new.write(out)
        told = report(found, checked, others)
        facts, written = _facts(found, checked, out), f"{out}: written" if out else ""
        pages.tell(self, facts, told, lambda: pages.page(told, found.case, moves), written)
        return Status.WITHIN if found.reached else Status.DEVIATES


def _facts(found: Tuned, checked: str | None, out: Path | None) -> dict[str, Any]:
    """Return the answer as plain data [SI]."""
    return {
        "schema": "kincheck-tune/1",
        "case": found.case.name,
        "reached": found.reached,
        "search": found.search,
        "norm": found.move.norm,
        "moves_m": found.moves,
        "boxes_m": {name: [each.low, each.high] for name, each in found.boxes.items()},
        "bands": [
            {
                "goal": each.goal.text,
                "output": each.goal.output,
                "before": each.ranges[0],
                "after": each.ranges[1],
                "excess": each.excess,
                "held": each.held,
                "tight_at": each.tight,
                "multiplier": each.multiplier,
            }
            for each in found.bands
        ],
        "forbidden_by": found.forbidding,
        "rounds": found.rounds,
        "designs": found.designs,
        "starts": found.ends,
        "checked_by": checked,
        "file": str(out) if out is not None else None,
    }
