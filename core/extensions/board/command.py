"""kincheck board: time steppers on the free motion of closed loops, against truth."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from ...cli.parser import Command
from ...cli.registry import Registry, Status
from ...doors import offers
from ...errors import KincheckError, refuse
from ...harness.resource_limits import TIMEOUT
from ...options import destination, option, options, positive, whole
from ..environments.environments import ENVIRONMENTS

if TYPE_CHECKING:
    from .truth import Truth


@options
class CompareSteppers(Command):
    """Step the free motion of closed loops with the time steppers of all engines, and compare with
    the truth of kincheck free: error, gap, energy, cost, and order by halved steps.

    Each row of the site is a folder with what repeats it without kincheck: the model, a script and
    the truth. An engine that is missing, lacks a joint, diverges or crashes is a row too.

    Exit status: 0 the site is written; 1 a row is worse than in --against; 2 the tool could not do
    all of its work.
    """

    about = "measure how well engines step the free motion of closed loops"
    engine: tuple[str, ...] = option(
        "engines to step with; default: all", metavar="NAME", several="together"
    )
    case: tuple[str, ...] = option(
        "built-in cases or files with [free]; default: all built-in ones",
        metavar="NAME",
        several="together",
    )
    out: Path = destination(
        "folder for the site: index.html, board.json, and a folder for each row",
        Path,
        "DIR",
        required=True,
    )
    against: Path | None = destination(
        "board.json to continue; exit status 1 if a row is worse; default: that in DIR", Path
    )
    steps: int = option(
        "least number of the longest steps, which are then halved; default %(default)s",
        whole(1),
        "N",
        default=1000,
    )
    timeout: float = option(
        f"limit for an engine on a case with one column of settings; default {TIMEOUT:g}",
        positive,
        "SECONDS",
        default=TIMEOUT,
    )

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from msgspec.structs import replace

        from ...case.io.atomic_files import write_all
        from ...harness.record import to_json
        from ...report.sections import page
        from ..free.section import free_in
        from ..reports.reports import print_report
        from . import run
        from .page import report
        from .results import Board, earlier_rows
        from .truth import truth_of

        if (folder := os.environ.get(ENVIRONMENTS)) and not Path(folder).is_dir():
            raise KincheckError(
                f"{ENVIRONMENTS}: there is no folder {folder}; make it, or unset it"
            )
        wanted = run.steppers(self.engine)
        refuse(self.unwritable("board.json", "index.html"))
        unread = dict[str, str]()
        cases = registry.find_cases(self.case, unread, driven=False)
        if not self.case:
            every = map(registry.case, registry.cases())
            cases = [case for case in every if free_in(case)]
        refuse(unread.values())
        problems = list[str]()
        scripts, file = offers("steppers"), self.out / "board.json"

        def files(engine: str, truth: Truth) -> Mapping[str, str]:
            return scripts[engine].load().files(truth.case.mechanism, truth.twists)

        if self.against and not self.against.exists():
            raise KincheckError(f"--against: there is no file {self.against}; give a board.json")
        earlier = earlier_rows(self.against or file)
        found, worse = Board.begun(datetime.now().astimezone()), False
        given = {name: getattr(self, name) for name in ("out", "steps", "timeout")}
        for case in cases:
            try:
                truth = truth_of(case)
                found = replace(found, truths=[*found.truths, truth.facts])
                for row in run.rows_of(truth, wanted, files, earlier, **given):
                    found = replace(found, rows=[*found.rows, row])
                    before = earlier.get(row.key)
                    grown = self.against and before and row.worse_than(before)
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
                problems += write_all([(file, to_json(found)), (self.out / "index.html", text)])
        if found.rows:
            print_report(report(found), sys.stdout)
        refuse(dict.fromkeys(problems))
        return Status.DEVIATES if worse else Status.WITHIN
