"""kincheck explain: find why a case cannot be solved, or how well conditioned it is."""

from __future__ import annotations

import argparse
from typing import Any

from . import import_options
from .option_types import add_json, positive, whole
from .registry import Registry, Status
from .run_options import TOL
from .verbosity import add_verbosity


def add(commands: Any) -> None:
    """Add the command to the parser."""
    explaining: argparse.ArgumentParser
    explaining = commands.add_parser(
        "explain",
        help="diagnose a case: freedom, conditioning, tolerances",
        description=_explain.__doc__,
    )
    explaining.set_defaults(do=_explain)
    explaining.add_argument(
        "case",
        metavar="CASE",
        help="name of a built-in case, or path to a case file or to another tool's file",
    )
    explaining.add_argument(
        "--samples",
        type=whole(1),
        default=41,
        metavar="N",
        help="number of samples of the sweep to examine; default %(default)s",
    )
    explaining.add_argument(
        "--tol",
        type=positive,
        default=TOL,
        metavar="X",
        help=f"largest residual that engines may leave [m or -]; default {TOL:g}",
    )
    add_json(explaining, "the diagnosis")
    add_verbosity(
        explaining,
        quiet="print only the verdict, the findings and the notes",
        verbose="print all samples and sensitivities, instead of a few of each",
    )
    import_options.add_options(explaining)


def _explain(options: argparse.Namespace, registry: Registry) -> int:
    """Diagnose a case: degrees of freedom, redundant and contradictory rows by name, conditioning
    along the sweep, resulting tolerances, sensitivity of the outputs to hardpoints, and the
    programs of the native engine.

    Exit status: 0 it can be solved, 1 it contradicts itself or is not determined, 2 the tool could
    not do its work.
    """
    from ..case.io.atomic_files import require_writable
    from ..report.terminal import page, with_json
    from ..studies.diagnosis import diagnose
    from ..studies.diagnosis.text import print_diagnosis

    require_writable([("--json", options.json)])
    case = registry.find_case(options.case, import_options.supplied(options), driven=False)
    import_options.tell_left_out([case])
    found = diagnose(case, samples=options.samples, tol=options.tol)
    how = {"quiet": options.quiet, "verbose": options.verbose}
    with with_json(found, options.json):
        print_diagnosis(found, page(options.json), **how)
    return Status.DEVIATES if found.findings else Status.WITHIN
