"""kincheck bench: measure the engines, the formulation and its programs."""

from __future__ import annotations

import argparse
import os
import shlex
import subprocess
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import KincheckError
from ..extras import how_to_install
from ..report.progress import complain
from .option_types import add_json, whole
from .registry import Registry, Status, add_joint_types
from .run_options import TOL
from .verbosity import add_verbosity

if TYPE_CHECKING:
    from ..studies.bench.engines import Bench

SEED = 943745
STRUT = "mcpherson_strut"
CASES = (STRUT, "stewart_platform")
"""Cases of the full benchmark: a suspension, and a mechanism of thirteen bodies with
six coupled loops.
"""
# Rounds that settle a median to a tenth of the distance between the quartiles.
ROUNDS = 20

_MAIN = "import sys; from kincheck.core.cli.main import main; sys.exit(main(sys.argv[1:]))"


def add(commands: Any) -> None:
    """Add the command to the parser."""
    bench: argparse.ArgumentParser
    bench = commands.add_parser(
        "bench",
        help="measure the engines, the formulation and its programs",
        description=_all.__doc__,
    )
    bench.set_defaults(do=_all)
    bench.add_argument(
        "--out", type=Path, metavar="DIR", help="write bench.json and bench.html there"
    )
    add_json(bench)
    add_verbosity(bench, quiet="print no progress")
    benchmarks = bench.add_subparsers(title="benchmarks", metavar="BENCHMARK")
    engines = benchmarks.add_parser(
        "engines",
        help="run time against error, batch and mechanism size, first use, memory",
        description=_engines.__doc__,
    )
    engines.set_defaults(do=_engines)
    engines.add_argument(
        "--cases",
        nargs="+",
        default=[STRUT],
        metavar="CASE",
        help=f"built-in names, patterns, or case files; all: every built-in case; default: {STRUT}",
    )
    add_joint_types(engines)
    engines.add_argument(
        "--engine",
        nargs="+",
        default=[],
        metavar="NAME",
        help="default: all engines, in both modes",
    )
    engines.add_argument(
        "--rounds",
        type=whole(1),
        default=ROUNDS,
        metavar="N",
        help="rounds of all contestants in turn; default %(default)s",
    )
    engines.add_argument(
        "--parts",
        nargs="+",
        choices=("work", "loop", "batch", "study", "size", "processes"),
        default=["work", "loop", "batch", "study", "size", "processes"],
        help=(
            "work against precision; whole loops as multiples of Pinocchio's; cost against batch"
            " size, of a study by threads, and against mechanism size; first use and memory;"
            " default: all"
        ),
    )
    formulation = benchmarks.add_parser(
        "formulation",
        help="operation counts and round-off of the paper's rows",
        description=_formulation.__doc__,
    )
    formulation.set_defaults(do=_formulation)
    formulation.add_argument(
        "--seed",
        type=whole(0),
        default=SEED,
        metavar="N",
        help="seed of the random states; default %(default)s",
    )
    statics = benchmarks.add_parser(
        "compliance",
        help="equilibria and compliance matrices of a suspension, many samples together",
        description=_compliance.__doc__,
    )
    statics.set_defaults(do=_compliance)
    statics.add_argument("case", metavar="CASE", help="case file of kincheck kc")
    statics.add_argument(
        "--rounds", type=whole(1), default=ROUNDS, metavar="N", help="rounds; default %(default)s"
    )
    statics.add_argument(
        "--json",
        metavar="FILE",
        help="write the results as JSON; - for standard output",
        default=argparse.SUPPRESS,
    )
    for each, names in ((engines, "bench"), (formulation, "bench_formulation")):
        # No defaults: they would overwrite the options before the benchmark's name.
        given: dict[str, Any] = {"default": argparse.SUPPRESS}
        each.add_argument(
            "--out",
            type=Path,
            metavar="DIR",
            help=f"write {names}.json and {names}.html there",
            **given,
        )
        each.add_argument(
            "--json",
            metavar="FILE",
            help="write the results as JSON; - for standard output",
            **given,
        )
    engines.add_argument(
        "-q", "--quiet", action="store_true", default=argparse.SUPPRESS, help="print no progress"
    )


def _all(options: argparse.Namespace, registry: Registry) -> int:
    """Measure the engines on a few cases, and the formulation. This takes some minutes."""
    options.cases, options.engine, options.rounds, options.parts = CASES, [], ROUNDS, None
    return _measured(options, registry, formulation=True)


def _engines(options: argparse.Namespace, registry: Registry) -> int:
    """Measure run time against error for every engine and mode, at several efforts. The contestants
    take turns in one process.
    """
    return _measured(options, registry, formulation=False)


def _measured(options: argparse.Namespace, registry: Registry, *, formulation: bool) -> int:
    from ..extras import THREADS
    from ..harness.record import Outcome
    from ..report.meter import Meter
    from ..report.sections import deliver
    from ..studies.bench import engines as bench_engines
    from ..studies.bench.report import report
    from ..studies.paper import formulation as bench_formulation
    from .destinations import json_only

    if not any(name in os.environ for name in THREADS):
        return _with_one_thread(options.command, THREADS)
    problems = _destinations(options, bench_engines.NAME)
    unread: dict[str, str] = {}
    names = registry.cases() if [*options.cases] == ["all"] else options.cases
    cases = {name: found for name in names for found in registry.find_cases([name], unread)}
    problems += unread.values()
    engines = [
        engine
        for mode, known in (("projection", registry.engines), ("simulate", registry.simulations))
        for engine in registry.find_engines(
            [name for name in known if name in options.engine or not options.engine], problems, mode
        )
    ]
    others = [
        name for name in options.engine if name not in (*registry.engines, *registry.simulations)
    ]
    engines += registry.find_engines(others, problems)  # errors of the user, with a message
    if problems:
        raise KincheckError("\n".join(problems))
    with (
        json_only() if options.json == "-" else nullcontext(),
        Meter("bench", quiet=options.quiet, every=1.0) as meter,
    ):
        found: Bench = bench_engines.measure(
            cases,
            engines,
            tol=TOL,
            rounds=options.rounds,
            parts=options.parts or bench_engines.PARTS,
            command=options.command,
            progress=meter,
        )
        if formulation:
            meter("formulation", 1.0)
            rows = bench_formulation.measure(registry.case(STRUT), SEED, bench_formulation.STATES)
            found = bench_engines.with_formulation(found, rows)
    deliver(report(found), found, out=options.out, json=options.json)
    missing = {
        entry.engine
        for entry in found.entries
        if entry.outcome is Outcome.UNAVAILABLE and options.engine
    }
    complain(
        f"engine {name!r} is requested, but missing; {how_to_install(name)}"
        for name in sorted(missing)
    )
    return Status.FAILED if missing else Status.WITHIN


def _with_one_thread(command: str, variables: Sequence[str]) -> int:
    """Run the command again in a new process whose linear algebra uses one thread. Libraries read
    the number of threads when they are loaded.

    The native engine has one thread. With threads that wait for each other, the simulators' times
    would depend on the machine's load.
    """
    environment = {**os.environ, **dict.fromkeys(variables, "1")}
    return subprocess.run(
        [sys.executable, "-P", "-c", _MAIN, *shlex.split(command)[1:]], env=environment, check=False
    ).returncode


def _destinations(options: argparse.Namespace, name: str) -> list[str]:
    from .destinations import Destinations

    return Destinations.of(options).problems([f"{name}.{kind}" for kind in ("json", "html")])


def _formulation(options: argparse.Namespace, registry: Registry) -> int:
    """Measure the paper's claims: operation counts (Table 3), round-off of rows, errors of a whole
    sweep. This needs mpmath.
    """
    from ..report import sections as bench
    from ..studies.paper import formulation as bench_formulation

    if problems := _destinations(options, bench_formulation.NAME):
        raise KincheckError("\n".join(problems))
    found = bench_formulation.measure(registry.case(STRUT), options.seed, bench_formulation.STATES)
    bench.deliver(bench_formulation.report(found), found, out=options.out, json=options.json)
    return Status.WITHIN


def _compliance(options: argparse.Namespace, registry: Registry) -> int:
    """Measure the time of an equilibrium of a suspension, and of its compliance matrix, in a study
    of many samples: travel and lateral force on a grid.
    """
    from ..report.terminal import with_json
    from ..studies.bench.compliance import lines, measure

    found = measure(registry.find_case(options.case, driven=False), options.rounds)
    with with_json(found, options.json):
        print(*lines(found), sep="\n", file=sys.stderr if options.json == "-" else sys.stdout)
    return Status.WITHIN
