"""kincheck free: the motion of a case without its drivers, as a truth for time steppers."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..errors import KincheckError
from . import import_options
from .option_types import add_json, positive, whole
from .registry import Registry, Status


def add(commands: Any) -> None:
    """Add the command to the parser."""
    freeing: argparse.ArgumentParser
    freeing = commands.add_parser(
        "free",
        help="move a case without drivers, by its masses and loads, to round-off",
        description=_free.__doc__,
    )
    freeing.set_defaults(do=_free)
    freeing.add_argument(
        "case",
        metavar="CASE",
        help="name of a built-in case, or path to a case file or to another tool's file",
    )
    freeing.add_argument(
        "--duration", type=positive, metavar="T", help="of the motion [s]; default: of [free]"
    )
    freeing.add_argument(
        "--samples",
        type=whole(2),
        metavar="N",
        help="number of samples, both ends included; default: of [free]",
    )
    freeing.add_argument(
        "--csv",
        type=Path,
        metavar="FILE",
        help="write time and outputs as columns, SI units",
    )
    add_json(freeing, "outputs and errors")
    import_options.add_options(freeing)


def _free(options: argparse.Namespace, registry: Registry) -> int:
    """Integrate the motion of a case without its drivers: its masses, loads and the rates of
    [free] alone move it from the design position.

    The error is the change when all steps are halved. Exit status: 0 the whole motion is
    integrated; 1 it ends before, at a change point; 2 the tool could not do its work.
    """
    from ..case.case import Free
    from ..case.io.atomic_files import require_writable, write
    from ..report.progress import complain
    from ..report.terminal import with_json
    from ..studies.free import free_of

    case = registry.find_case(options.case, import_options.supplied(options), driven=False)
    import_options.tell_left_out([case])
    given = case.free
    duration = options.duration or (given and given.duration)
    samples = options.samples or (given and given.samples)
    if not duration or not samples:
        raise KincheckError(
            f"{options.case}: says no duration and samples of its free motion; add [free] with"
            " duration and samples, or give --duration and --samples"
        )
    case = replace(case, free=Free(duration, samples, given.rates if given else {}))
    require_writable([("--csv", options.csv), ("--json", options.json)])
    found = free_of(case)
    if options.csv:
        write("--csv", options.csv, found.write_csv)
    complain([*found.notes, *filter(None, [found.message])])
    with with_json(found.facts, options.json):
        print(
            f"{case.name}: {len(found.times)} samples to {found.times[-1]:.9g} s,"
            f" {found.freedoms} degrees of freedom, {found.redundant} redundant rows,"
            f" {found.method}",
            f"  change when all steps are halved: {found.error:.1e} m,"
            f" {found.turning_error:.1e} rad",
            f"  change of energy less work: {found.energy_error:.1e} J; largest gap:"
            f" {found.gap:.1e} of the mechanism's size",
            sep="\n",
            file=sys.stderr if options.json == "-" else sys.stdout,
        )
    return Status.DEVIATES if found.message else Status.WITHIN
