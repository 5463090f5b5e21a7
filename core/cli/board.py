"""kincheck board: time steppers on the free motion of closed loops, against truth."""

from __future__ import annotations

import argparse
import sys
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import KincheckError
from ..harness.resource_limits import TIMEOUT
from .option_types import positive, whole
from .registry import Registry, Status

if TYPE_CHECKING:
    from ..case.case import Case
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
    board.add_argument(
        "--engine",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME",
        help="engines to step with; default: all",
    )
    board.add_argument(
        "--case",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME",
        help="built-in cases or files with [free]; default: all built-in ones",
    )
    board.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder for the site: index.html, board.json, and a folder for each row",
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
    the truth. An engine that is missing, lacks a joint, diverges or crashes is a row too. Exit
    status: 0 the site is written; 2 the tool could not do all of its work.
    """
    from ..case.io.atomic_files import write_all
    from ..harness.record import to_json
    from ..report.sections import page, print_report
    from ..studies.board import run
    from ..studies.board.page import report
    from ..studies.board.results import Board, Row, TruthFacts
    from ..studies.board.truth import truth_of

    assert registry.stepper_files is not None
    wanted = run.steppers(options.engine)
    cases, problems = _cases(options, registry)
    _require_folder(options.out)
    make = registry.stepper_files

    def files(engine: str, truth: Truth) -> Any:
        return make(engine, truth.case.mechanism, truth.twists)

    started, truths, rows = datetime.now().astimezone(), list[TruthFacts](), list[Row]()
    for case in cases:
        try:
            truth = truth_of(case)
        except KincheckError as error:
            problems.append(str(error))
            continue
        truths.append(truth.facts)
        for row in run.rows_of(
            truth, wanted, files, out=options.out, steps=options.steps, timeout=options.timeout
        ):
            rows.append(row)
            print(f"{row.case}: {row.name}: {row.state}", file=sys.stderr)
    if not rows:
        raise KincheckError("\n".join(problems))
    found = Board.of(truths, rows, started)
    shown = report(found)
    contents = [
        *((options.out / row.folder / "row.json", to_json(row)) for row in rows if row.folder),
        (options.out / "board.json", to_json(found)),
        (options.out / "index.html", page(shown).encode()),
    ]
    problems += write_all(contents)
    print_report(shown, sys.stdout)
    if problems:
        raise KincheckError("\n".join(problems))
    return Status.WITHIN


def _cases(options: argparse.Namespace, registry: Registry) -> tuple[list[Case], list[str]]:
    """Return the cases, and messages on unreadable ones."""
    if not options.case:
        every = [registry.case(name) for name in registry.cases()]
        return [case for case in every if case.free is not None], []
    found: dict[str, Case] = {}
    problems: list[str] = []
    for name in options.case:
        try:
            for each in registry.matching(name):
                case = registry.find_case(each, driven=False)
                if found.setdefault(case.name, case) is not case:
                    problems.append(f"{each}: there are two cases named {case.name!r}; rename one")
        except KincheckError as error:
            problems.append(str(error))
    return [*found.values()], problems


def _require_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise KincheckError(
            f"--out {out}: cannot be made a folder ({error.strerror}); give another one"
        ) from None
