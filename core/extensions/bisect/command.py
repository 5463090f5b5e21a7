"""kincheck bisect."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from ...cli.parser import Command
from ...cli.registry import Registry, Status
from ...errors import KincheckError, refuse
from ...options import CASES, argument, destination, json_file, option, options, positive, switch

if TYPE_CHECKING:
    from ...case.case import Case
    from ...harness.record import Record

TOL = 1e-12
TIMEOUT = 60.0
DISK = 10.0


@options
class Bisect(Command):
    """Find the releases of a simulator with a changed result or interface. Releases between two
    ends are installed in environments apart. Their curves and reactions are compared, and the
    numbers of their own reader of files. The truth of the cases says who is right.

    Exit status: 0 no change between the ends; 1 changes; 2 the tool could not do all of its work.
    """

    about = "find the release of a simulator that changed a result"
    engine: str = argument("engine, by name or MODULE:CLASS", "ENGINE")
    cases: tuple[str, ...] = argument(CASES, "CASE", "*", default=())
    package: str | None = option(
        "package with the releases; default: that of the engine, or one of its name",
        metavar="NAME",
        default=None,
    )
    first: str = option("earlier end of the range", metavar="V", flag="--from", required=True)
    last: str = option("later end of the range", metavar="V", flag="--to", required=True)
    every: bool = switch("run every release: finds changes that were undone between the ends too")
    releases: tuple[str, ...] = option(
        "only these releases, beside the ends; default: all that the installer finds",
        metavar="V",
        several="together",
    )
    timeout: float = option(
        "limit for a case, and for the import of a release; default %(default)g",
        positive,
        "SECONDS",
        default=TIMEOUT,
    )
    disk: float = option(
        "limit for all environments; the longest unused go first; default %(default)g",
        positive,
        "GB",
        default=DISK,
    )
    json: str | None = json_file("the changes")
    out: Path | None = destination(
        "folder for bisect.json, bisect.html, and what repeats each change without kincheck",
        Path,
        "DIR",
    )

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...harness.engine import STANDARD
        from ...version import VERSION
        from ..reports.reports import deliver
        from . import releases
        from .inside import Task
        from .page import report
        from .reproducer import with_fields
        from .results import Bisection, Change
        from .search import changes
        from .signature import differences, right_of
        from .states import States, require_runs, tell

        unread: dict[str, str] = {}
        cases = registry.find_cases(self.cases or registry.cases(), unread)
        refuse([*unread.values(), *self.unwritable("bisect.json", "bisect.html")])
        if self.engine == STANDARD:
            raise KincheckError(f"{STANDARD} is kincheck's own engine. Name that of a simulator.")
        package = self.package or releases.package_of(self.engine)
        ends = self.first, self.last
        known = [*self.releases, *ends] if self.releases else releases.releases_of(package)
        row = releases.between(known, *ends)
        pairs = [(case, _with_reactions(case)) for case in cases]
        native = [_native(registry, each) for each in zip(*pairs, strict=True)]
        task = Task(self.engine, package, pairs, (native[0], native[1]), TOL, self.timeout)
        states = States(row, task, releases.Environments(package, 1e9 * self.disk))
        found: list[Change] = []
        again = ["kincheck", "bisect", self.engine, *self.cases, "--package", package]
        try:
            for i, j in changes(
                len(row), states, lambda a, b: bool(differences(a, b, ends)), every=self.every
            ):
                a, b = states(i), states(j)
                assert a is not None
                assert b is not None
                differing = differences(a, b, (row[i], row[j]))
                kinds = {each.kind for each in differing.values()}
                change = Change(
                    earlier=row[i],
                    later=row[j],
                    kind="result" if "result" in kinds else "interface",
                    cases=differing,
                    right=right_of(differing.values()),
                    repeat=shlex.join([*again, "--from", row[i], "--to", row[j]]),
                )
                found.append(with_fields(change, states, self.out))
        except KeyboardInterrupt:
            tell("What is finished is kept: the same command goes on from here.")
            raise
        tried = [name for name in row if states.found.get(name) is not None]
        lost = [name for name in row if name in states.reasons]
        bisection = Bisection(
            kincheck=VERSION,
            engine=self.engine,
            package=package,
            ends=ends,
            releases=len(row),
            every=self.every,
            command=self.command,
            changes=found,
            not_installable=lost,
            reasons=states.reasons,
            tried=tried,
        )
        problems = [
            f"{option} {end}: cannot be installed ({states.reasons[end]}). The range begins or"
            " ends at the next release that can."
            for option, end in (("--from", row[0]), ("--to", row[-1]))
            if end in lost
        ]
        idle = [require_runs(each, name) for name, each in states.found.items() if each]
        if len(tried) < 2:
            problems.append(f"found {len(tried)} releases that can be installed, expected two")
        elif all(idle):
            problems.append(
                f"the engine {self.engine!r} runs no case in any release that was tried: {idle[0]}"
            )
        deliver(
            report(bisection, states.found),
            bisection,
            out=self.out,
            json=self.json,
            problems=problems,
        )
        return Status.DEVIATES if found else Status.WITHIN


def _native(registry: Registry, cases: Sequence[Case]) -> Sequence[Record]:
    from ...harness.engine import STANDARD
    from ...harness.run import run

    return run(cases, [registry.engine(STANDARD)], tol=TOL).records


def _with_reactions(case: Case) -> Case:
    """Return the case with its reactions as outputs, or the case if it has none."""
    from ...studies.reactions import with_reactions

    with suppress(KincheckError):
        return with_reactions(case, TOL)
    return case
