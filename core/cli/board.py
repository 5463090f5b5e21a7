"""kincheck board: time steppers on the free motion of closed loops, against truth."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import KincheckError
from ..extras import ENVIRONMENTS
from ..harness.resource_limits import TIMEOUT
from .option_types import add_several, positive, whole
from .registry import Registry, Status

if TYPE_CHECKING:
    from ..studies.board.truth import Truth

STEPS = 1000


def add(commands: Any) -> None:
    """Add the command to the parser."""
    board: argparse.ArgumentParser = commands.add_parser(
        "board",
        help="measure how well engines step the free motion of closed loops",
        description=_board.__doc__,
    )
    board.set_defaults(do=_board)
    add_several(board, "--engine", "engines to step with; default: all")
    add_several(board, "--case", "built-in cases or files with [free]; default: all built-in ones")
    board.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder for the site: index.html, board.json, and a folder for each row",
    )
    board.add_argument(
        "--against",
        type=Path,
        metavar="FILE",
        help="board.json to continue; exit status 1 if a row is worse; default: that in DIR",
    )
    board.add_argument(
        "--steps",
        type=whole(1),
        default=STEPS,
        metavar="N",
        help=f"least number of the longest steps, which are then halved; default {STEPS}",
    )
    board.add_argument(
        "--timeout",
        type=positive,
        default=TIMEOUT,
        metavar="SECONDS",
        help=f"limit for an engine on a case with one column of settings; default {TIMEOUT:g}",
    )


def _board(options: argparse.Namespace, registry: Registry) -> int:
    """Step the free motion of closed loops with the time steppers of all engines, and compare with
    the truth of kincheck free: error, gap, energy, cost, and order by halved steps.

    Each row of the site is a folder with what repeats it without kincheck: the model, a script and
    the truth. An engine that is missing, lacks a joint, diverges or crashes is a row too.

    Exit status: 0 the site is written; 1 a row is worse than in --against; 2 the tool could not do
    all of its work.
    """
    from msgspec.structs import replace

    from ..case.io.atomic_files import write_all
    from ..harness.record import to_json
    from ..report.sections import page, print_report
    from ..studies.board import run
    from ..studies.board.page import report
    from ..studies.board.results import Board, earlier_rows
    from ..studies.board.truth import truth_of
    from .destinations import Destinations

    assert registry.stepper_files is not None
    if (folder := os.environ.get(ENVIRONMENTS)) and not Path(folder).is_dir():
        raise KincheckError(f"{ENVIRONMENTS}: there is no folder {folder}; make it, or unset it")
    wanted, to = run.steppers(options.engine), Destinations.of(options)
    if unwritable := to.problems(["board.json", "index.html"]):
        raise KincheckError("\n".join(unwritable))
    unread = dict[str, str]()
    cases = registry.find_cases(options.case, unread, driven=False)
    if not options.case:
        every = map(registry.case, registry.cases())
        cases = [case for case in every if case.free is not None]
    problems = [*unread.values()]
    make, file = registry.stepper_files, options.out / "board.json"

    def files(engine: str, truth: Truth) -> Mapping[str, str]:
        return make(engine, truth.case.mechanism, truth.twists)

    if options.against and not options.against.exists():
        raise KincheckError(f"--against: there is no file {options.against}; give a board.json")
    earlier = earlier_rows(options.against or file)
    found, worse = Board.begun(datetime.now().astimezone()), False
    given = {name: getattr(options, name) for name in ("out", "steps", "timeout")}
    for case in cases:
        try:
            truth = truth_of(case)
            found = replace(found, truths=[*found.truths, truth.facts])
            for row in run.rows_of(truth, wanted, files, earlier, registry.apart, **given):
                found = replace(found, rows=[*found.rows, row])
                before = earlier.get(row.key)
                grown = options.against and before and row.worse_than(before)
                worse = worse or bool(grown)
                print(
                    f"{row.case}: {row.name}: {row.state}{', worse' if grown else ''}",
                    file=sys.stderr,
                )
        except KincheckError as error:
            problems.append(str(error))
        # after each case, so that an interrupt loses only the last one
        if found.rows:
            text = page(report(found)).encode()
            problems += write_all([(file, to_json(found)), (options.out / "index.html", text)])
    if found.rows:
        print_report(report(found), sys.stdout)
    if problems:
        raise KincheckError("\n".join(dict.fromkeys(problems)))
    return Status.DEVIATES if worse else Status.WITHIN
