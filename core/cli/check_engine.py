"""kincheck check-engine: check a user's engine."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, Any

from ..errors import KincheckError
from .engine_loading import made
from .registry import Registry, Status
from .run_options import TOL
from .verbosity import add_verbosity

if TYPE_CHECKING:
    from ..harness.engine import Engine
    from ..studies.checks.findings import Report

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


def add(commands: Any) -> None:
    """Add the command to the parser."""
    checking: argparse.ArgumentParser
    checking = commands.add_parser(
        "check-engine", help="check your own engine", description=_check_engine.__doc__
    )
    checking.set_defaults(do=_check_engine)
    checking.add_argument(
        "engine",
        nargs="?",
        metavar="MODULE:CLASS",
        help="the class, in a module of this folder or an installed one; or an engine's name",
    )
    checking.add_argument(
        "--engine-command",
        metavar="COMMAND",
        help='a program as an engine, "prog {case} {samples} {out}"; see run',
    )
    add_verbosity(checking, quiet="print only the failed checks and the count")


def _check_engine(options: argparse.Namespace, registry: Registry) -> int:
    """Check an engine: every joint type, several topologies, its rates against differences, its
    refusals, and repeated answers. Each pair is solved in a worker process.
    """
    if (options.engine is None) == (options.engine_command is None):
        raise KincheckError("found no engine, or two, expected MODULE:CLASS or --engine-command")
    engine: str | Engine = options.engine
    if options.engine is None:
        from ..recorded.program import ProgramEngine

        engine = ProgramEngine(options.engine_command)
    report = examined(engine, registry)
    report.print(sys.stdout, quiet=options.quiet)
    return Status.WITHIN if report.passed else Status.DEVIATES


def examined(engine: str | Engine, registry: Registry) -> Report:
    """Return the report on an engine, given by itself, by name or as MODULE:CLASS.

    Raises:
        KincheckError: there is no such engine, or a member of the engine protocol is missing.
    """
    from ..harness.standard import STANDARD
    from ..report.progress import progress
    from ..studies.checks.check_engine import check_engine

    problems = list[str]()
    found = (
        registry.find_engines([engine], problems)
        if isinstance(engine, str)
        else [made(repr(engine), engine)]
    )
    if problems:
        raise KincheckError("\n".join(problems))
    cases = {word: registry.case(name) for word, name in TOPOLOGIES.items()}
    native = registry.engine(STANDARD)
    return check_engine(found[0], native, cases, tol=TOL, progress=progress([]))
