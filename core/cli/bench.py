"""kincheck bench: measure the engines, the formulation and its programs."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from ..errors import KincheckError
from ..extras import how_to_install
from ..options import (
    argument,
    destination,
    joint_types,
    json_file,
    option,
    options,
    verbosity,
    whole,
    with_values,
)
from ..report.progress import complain
from .parser import Command
from .registry import Registry, Status
from .run_options import TOL

if TYPE_CHECKING:
    from ..studies.bench.engines import Bench

SEED = 943745
STRUT = "mcpherson_strut"
CASES = (STRUT, "stewart_platform")
"""Cases of the full benchmark: a suspension, and a mechanism of thirteen bodies with
six coupled loops.
"""
PARTS = ("work", "loop", "batch", "study", "size", "processes")
# Rounds that settle a median to a tenth of the distance between the quartiles.
ROUNDS = 20

_MAIN = "import sys; from kincheck.core.cli.main import main; sys.exit(main(sys.argv[1:]))"


@options
class BenchEngines(Command):
    """Measure run time against error for every engine and mode, at several efforts. The contestants
    take turns in one process.
    """

    about: ClassVar[str] = "run time against error, batch and mechanism size, first use, memory"
    cases: tuple[str, ...] = option(
        f"built-in names, patterns, or case files; all: every built-in case; default: {STRUT}",
        metavar="CASE",
        several="once",
        default=(STRUT,),
    )
    joint_type: tuple[str, ...] = joint_types()
    engine: tuple[str, ...] = option(
        "default: all engines, in both modes",
        metavar="NAME",
        several="once",
        default=(),
    )
    rounds: int = option(
        "rounds of all contestants in turn; default %(default)s", whole(1), "N", default=ROUNDS
    )
    parts: tuple[str, ...] = option(
        "work against precision; whole loops as multiples of Pinocchio's; cost against batch"
        " size, of a study by threads, and against mechanism size; first use and memory;"
        " default: all",
        choices=PARTS,
        several="once",
        default=PARTS,
    )
    out: Path | None = destination("write bench.json and bench.html there", Path, "DIR")
    json: str | None = json_file()
    quiet: bool = verbosity("print no progress")

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        return _measured(self, registry, formulation=False)


def _measured(options: BenchEngines, registry: Registry, *, formulation: bool) -> int:
    from ..extras import THREADS
    from ..harness.record import Outcome
    from ..report.sections import deliver
    from ..report.terminal import Meter
    from ..studies.bench import engines as bench_engines
    from ..studies.bench.engines_report import report
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
            parts=options.parts,
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


def _destinations(options: BenchEngines | BenchFormulation, name: str) -> list[str]:
    from .destinations import Destinations

    return Destinations.of(options).problems([f"{name}.{kind}" for kind in ("json", "html")])


@options
class BenchFormulation(Command):
    """Measure the paper's claims: operation counts (Table 3), round-off of rows, errors of a whole
    sweep. This needs mpmath.
    """

    about: ClassVar[str] = "operation counts and round-off of the paper's rows"
    seed: int = option(
        "seed of the random states; default %(default)s", whole(0), "N", default=SEED
    )
    out: Path | None = destination(
        "write bench_formulation.json and bench_formulation.html there", Path, "DIR"
    )
    json: str | None = json_file()

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..report import sections as bench
        from ..studies.paper import formulation as bench_formulation

        if problems := _destinations(self, bench_formulation.NAME):
            raise KincheckError("\n".join(problems))
        found = bench_formulation.measure(registry.case(STRUT), self.seed, bench_formulation.STATES)
        bench.deliver(bench_formulation.report(found), found, out=self.out, json=self.json)
        return Status.WITHIN


@options
class BenchCompliance(Command):
    """Measure the time of an equilibrium of a suspension, and of its compliance matrix, in a study
    of many samples: travel and lateral force on a grid.
    """

    about: ClassVar[str] = (
        "equilibria and compliance matrices of a suspension, many samples together"
    )
    case: str = argument("case file of kincheck kc", "CASE")
    rounds: int = option("rounds; default %(default)s", whole(1), "N", default=ROUNDS)
    json: str | None = json_file()

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..report.terminal import with_json
        from ..studies.bench.compliance import lines, measure

        found = measure(registry.find_case(self.case, driven=False), self.rounds)
        with with_json(found, self.json):
            print(*lines(found), sep="\n", file=sys.stderr if self.json == "-" else sys.stdout)
        return Status.WITHIN


@options
class BenchAll(Command):
    """Measure the engines on a few cases, and the formulation. This takes some minutes."""

    about: ClassVar[str] = "measure the engines, the formulation and its programs"
    below: ClassVar[Mapping[str, type[Command]]] = {
        "engines": BenchEngines,
        "formulation": BenchFormulation,
        "compliance": BenchCompliance,
    }
    out: Path | None = destination("write bench.json and bench.html there", Path, "DIR")
    json: str | None = json_file()
    quiet: bool = verbosity("print no progress")

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        given = {name: getattr(self, name) for name in ("out", "json", "quiet", "command")}
        every = with_values(BenchEngines(), cases=CASES, **given)
        return _measured(every, registry, formulation=True)
