"""kincheck run: solve cases with engines and judge the results."""

from __future__ import annotations

import argparse
import math
import sys
from contextlib import nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import KincheckError
from ..console import complain, lacking, progress
from .house import House, Status

if TYPE_CHECKING:
    from ..engine import Engine
    from ..record import Record

# Largest accepted constraint residual [m or -]: a thousand times the round-off of metre-sized coordinates, and a thousandth of
# the 1e-9 m that outputs are held to, so that a residual amplified a hundredfold by the mechanism still cannot be seen.
TOL = 1e-12

MODES = ("projection", "simulate")


def add(commands: Any) -> None:
    """Add the command to the parser."""
    run: argparse.ArgumentParser
    run = commands.add_parser("run", help="solve cases with engines and judge the results", description=_run.__doc__)
    run.set_defaults(do=_run)
    run.add_argument("case", nargs="*", metavar="CASE", help="built-in name, or path to a case file; default: all built-in cases")
    run.add_argument("--joints", action="store_true", help="run a small closed loop around every joint type, and the cases named")
    run.add_argument("--engine", nargs="+", action="extend", default=[], metavar="NAME", help="default: all engines")
    run.add_argument("--mode", choices=MODES, help="only engines of this mode")
    run.add_argument(
        "--tol", type=positive, default=TOL, metavar="X", help=f"largest constraint residual [m or -]; default {TOL:g}"
    )
    run.add_argument("--out", type=Path, metavar="DIR", help="write results.json and report.html there")
    run.add_argument("--json", metavar="FILE", help="write the results as JSON; - for standard output")
    run.add_argument("--junit", type=Path, metavar="FILE", help="write the results as JUnit XML")
    run.add_argument("--markdown", type=Path, metavar="FILE", help="write the table of cases and engines as Markdown")
    run.add_argument("--explain", action="store_true", help="print what the native engine computes for each case, and leaves out")
    run.add_argument(
        "--require",
        nargs="+",
        action="extend",
        default=[],
        metavar="NAME",
        help="engines that must be there and able (else status 2)",
    )


def positive(text: str) -> float:
    """A positive number, as an option gives it."""
    try:
        tol = float(text)
    except ValueError:
        tol = math.nan
    if not (math.isfinite(tol) and tol > 0):
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number; give a residual such as {TOL:g}")
    return tol


def _run(options: argparse.Namespace, house: House) -> int:
    """Solve every case with every engine, judge each, print a table and write what was asked for."""
    from .. import run as running
    from ..probe import probes
    from ..reporting import deliver as delivery

    problems: list[str] = []
    _return_cases(options, house)
    named: list[str] = options.case or ([] if options.joints else [*house.cases()])
    cases = house.find_cases(named, problems, found=list(probes()) if options.joints else [])
    engines, baseline = _engines(options, house, problems)
    files: dict[str, Any] = {"out": options.out, "json": options.json, "junit": options.junit, "markdown": options.markdown}
    delivery.check_destinations(problems, **files)
    if problems:  # all of them, and before anything is computed
        raise KincheckError("\n".join(problems))

    records: list[Record] = []
    started = datetime.now(UTC)
    with delivery.json_only() if options.json == "-" else nullcontext():
        try:
            results = running.run(
                cases,
                engines,
                tol=options.tol,
                progress=progress(records),
                baseline=baseline,
                command=options.command,
            )
        except KeyboardInterrupt:
            problems.append(f"interrupted: {len(records)} of {len(cases) * len(engines)} records were made and are kept")
            results = running.results(cases, records, started=started, tol=options.tol, command=options.command)
    delivery.deliver(results, problems, matrix=options.joints, **files)
    if options.explain:
        from ..explain import explain

        print(*(line for case in cases for line in explain(case)), sep="\n", file=sys.stderr if options.json == "-" else sys.stdout)
    problems += lacking(results, options.require)
    complain(problems)
    if problems:
        return Status.FAILED
    return Status.DEVIATES if any(record.outcome.bad for record in results.records) else Status.WITHIN


def _return_cases(options: argparse.Namespace, house: House) -> None:
    """Give back the cases that an option taking several names has swallowed: `run --engine native my_case.toml`."""
    for names in (options.engine, options.require):
        swallowed = [name for name in names if name not in house.engines and (name in house.cases() or Path(name).suffix)]
        options.case += swallowed
        names[:] = [name for name in names if name not in swallowed]


def _engines(options: argparse.Namespace, house: House, problems: list[str]) -> tuple[list[Engine], Engine | None]:
    """The engines asked for, and the native one to compare with where it is not among them."""
    from ..run import NATIVE

    named = [*options.engine, *options.require]
    engines = house.find_engines(named if options.engine else [*house.engines, *options.require], problems)
    if options.mode:
        others = {each.name: each.mode for each in engines if each.mode != options.mode}
        engines = [each for each in engines if each.name not in others]
        problems += [
            f"engine {name!r} has the mode {mode!r}, not {options.mode!r}: leave out --mode or the engine"
            for name, mode in others.items()
            if name in named
        ]
        if not engines and not problems:
            problems.append(f"no engine has the mode {options.mode!r}; leave out --mode")
    return engines, None if NATIVE in (each.name for each in engines) else house.engine(NATIVE)
