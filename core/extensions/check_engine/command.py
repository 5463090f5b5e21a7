"""The command kincheck check-engine."""

from __future__ import annotations

import sys
from itertools import chain
from typing import TYPE_CHECKING, Any

from ...cli.engine_source import CHECK_ENGINE, names_of, options_for, sources
from ...cli.registry import Registry, Status
from ...cli.shared_options import TOL
from ...errors import KincheckError, refuse
from ...options import argument, asked, options, verbosity

if TYPE_CHECKING:
    from ...harness.engine import Engine
    from ...studies.checks.findings import Report

TOPOLOGIES = {
    "one loop": "rssr",
    "open and closed": "spatial_slider_crank",
    "several loops": "andrews_squeezer",
    "parallel robot": "stewart_platform",
    "redundant rows": "bennett",
    "two drivers": "mcpherson_steered",
    "outputs of orientation": "mcpherson_suspension",
}
"""Built-in cases by a word on their structure."""
NAME_ONE = "Name one engine to check: MODULE:CLASS or --engine-command."
_Added: Any = options_for(CHECK_ENGINE)


@options
class CheckEngine(_Added):  # pyright: ignore[reportUntypedBaseClass]
    """Check an engine: every joint type, several topologies, its rates against differences, its
    refusals, and repeated answers. Each pair is solved in a worker process.
    """

    about = "check your own engine"
    engine: str | Engine | None = argument(
        "the class, in a module of this folder or an installed one; or an engine's name",
        "MODULE:CLASS",
        "?",
        default=None,
    )
    quiet: bool = verbosity("print only the failed checks and the count")

    def answer(self, registry: Registry) -> Report:
        """Check an engine, given by itself, by name, or as MODULE:CLASS.

        Raises:
            KincheckError: there is no such engine, or a member of the engine protocol is missing.
        """
        from ...harness.engine import STANDARD
        from ...report.progress import progress
        from .check import check_engine

        added = sources(CHECK_ENGINE)
        options = ["engine", *chain.from_iterable(map(names_of, added))]
        if sum(getattr(self, name) is not None for name in options) != 1:
            raise KincheckError(NAME_ONE)
        problems = list[str]()
        named: list[Any] = [] if self.engine is None else [self.engine]
        for source in asked(added, self):
            named += source.engines(self, [], problems)[1]
        found = registry.find_engines(named, problems)
        refuse(problems)
        cases = {word: registry.case(name) for word, name in TOPOLOGIES.items()}
        native = registry.engine(STANDARD)
        return check_engine(found[0], native, cases, tol=TOL, progress=progress([]))

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        report = self.answer(registry)
        report.print(sys.stdout, quiet=self.quiet)
        return Status.WITHIN if report.passed else Status.DEVIATES
