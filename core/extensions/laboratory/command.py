"""Commands that measure kincheck and the engines: kincheck bench and stress."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from ...case.io.reader_options import Supplied
from ...cli.parser import Command
from ...cli.registry import Registry, Status
from ...cli.shared_options import MODE, MODES, TOL
from ...errors import KincheckError, refuse, unknown
from ...extras import how_to_install
from ...options import (
    argument,
    destination,
    joint_types,
    json_file,
    names_of_given,
    option,
    options,
    positive,
    switch,
    verbosity,
    whole,
    with_values,
)
from ...report.progress import complain

if TYPE_CHECKING:
    from ...harness.engine import Engine
    from .bench.engines import Bench
    from .stress.families import Family
    from .stress.run import Stress
SEED = 943745
STRUT = "mcpherson_strut"
CASES = (STRUT, "stewart_platform")
"""Cases of the full benchmark: a suspension, and a mechanism of thirteen bodies with
six coupled loops.
"""
LOADED = "mcpherson_strut_loaded"
WITHOUT = ("four_bar", "planar_slider_crank", "rssr")
"""Cases for the time without machine code: whole turns."""
PARTS = ("work", "loop", "batch", "study", "size", "processes")
# Rounds that settle a median to a tenth of the distance between the quartiles.
ROUNDS = 20


def _rounds(what: str) -> Any:
    return option(f"{what}; default %(default)s", whole(1), "N", default=ROUNDS)


_MAIN = "import sys; from kincheck.core.cli.main import main; sys.exit(main(sys.argv[1:]))"


@options
class BenchEngines(Command):
    """Measure run time against error for every engine and mode, at several efforts. The contestants
    take turns in one process.
    """

    about = "run time against error, batch and mechanism size, first use, memory"
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
    rounds: int = _rounds("rounds of all contestants in turn")
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
        return _measure_engines(self, registry, formulation=False)


def _measure_engines(options: BenchEngines, registry: Registry, *, formulation: bool) -> int:
    from msgspec.structs import replace

    from ...cli.destinations import json_only
    from ...extras import THREADS
    from ...harness.record import Outcome
    from ..reports.reports import deliver
    from ..sweep.meter import Meter
    from .bench import engines as bench_engines
    from .bench.report import report
    from .paper import formulation as bench_formulation

    if not any(name in os.environ for name in THREADS):
        # Run the command again in a new process whose linear algebra uses one thread: libraries
        # read the number when they are loaded. The native engine has one thread. With threads that
        # wait for each other, the simulators' times would depend on the machine's load.
        words = [sys.executable, "-P", "-c", _MAIN, *shlex.split(options.command)[1:]]
        environment = {**os.environ, **dict.fromkeys(THREADS, "1")}
        return subprocess.run(words, env=environment, check=False).returncode
    problems = options.unwritable(*_files(bench_engines.NAME))
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
    others = [name for name in options.engine if name not in registry.every_engine]
    engines += registry.find_engines(others, problems)  # errors of the user, with a message
    refuse(problems)
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
            found = replace(found, formulation=rows)
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


def _files(name: str) -> list[str]:
    return [f"{name}.{kind}" for kind in ("json", "html")]


@options
class BenchFormulation(Command):
    """Measure the paper's claims: operation counts (Table 3), round-off of rows, errors of a whole
    sweep. This needs mpmath.
    """

    about = "operation counts and round-off of the paper's rows"
    seed: int = option(
        "seed of the random states; default %(default)s", whole(0), "N", default=SEED
    )
    out: Path | None = destination(
        "write bench_formulation.json and bench_formulation.html there", Path, "DIR"
    )
    json: str | None = json_file()

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ..reports.reports import deliver
        from .paper import formulation as bench_formulation

        refuse(self.unwritable(*_files(bench_formulation.NAME)))
        found = bench_formulation.measure(registry.case(STRUT), self.seed, bench_formulation.STATES)
        deliver(bench_formulation.report(found), found, out=self.out, json=self.json)
        return Status.WITHIN


@options
class BenchCompliance(Command):
    """Measure the time of an equilibrium of a suspension, and of its compliance matrix, in a study
    of many samples: travel and lateral force on a grid.
    """

    about = "equilibria and compliance matrices of a suspension, many samples together"
    case: str = argument("case file of kincheck kc", "CASE")
    rounds: int = _rounds("rounds")
    json: str | None = json_file()

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from .bench import compliance

        return _tell(self, compliance, registry.find_case(self.case, driven=False))


@options
class BenchCurves(Command):
    """Measure the time of all outputs of many designs against their kinematics alone, of exact
    slopes by the geometry, of a sweep, of the live page's answer, and of the first use.
    """

    about = "outputs of many designs, and their slopes by the geometry"
    case: str = argument("table of hardpoints", "TABLE")
    axle: str | None = option("motion of both wheels", metavar="MOTION")
    rounds: int = _rounds("rounds")
    json: str | None = json_file()

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from .bench import curves

        supplied = Supplied(axle=self.axle)
        case = registry.find_case(self.case, supplied, driven=False)
        return _tell(self, curves, case, Path(self.case), supplied)


@options
class BenchNumpy(Command):
    """Measure the motion of cases without machine code, as an installation without extras solves
    it, by processor time.
    """

    about = "motions without machine code"
    case: tuple[str, ...] = option(
        f"built-in names, patterns, or case files; default: {' '.join(WITHOUT)}",
        metavar="CASE",
        several="once",
        default=WITHOUT,
    )
    rounds: int = _rounds("rounds")
    json: str | None = json_file()

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from .bench import without_machine_code

        return _measure_cases(self, registry, without_machine_code)


@options
class BenchForces(Command):
    """Measure the forces of cases beside their motion, by processor time: solved, and read."""

    about = "forces beside the motion"
    case: tuple[str, ...] = option(
        f"built-in names, patterns, or case files; default: {LOADED}",
        metavar="CASE",
        several="once",
        default=(LOADED,),
    )
    rounds: int = _rounds("rounds")
    json: str | None = json_file()

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from .bench import forces

        return _measure_cases(self, registry, forces)


def _measure_cases(options: BenchNumpy | BenchForces, registry: Registry, bench: Any) -> int:
    problems: dict[str, str] = {}
    cases = {case.name: case for case in registry.find_cases(options.case, problems)}
    refuse(problems.values())
    return _tell(options, bench, cases)


def _tell(options: Any, bench: Any, *given: Any) -> int:
    """Measure by a module of benchmarks, and print the results."""
    from ...report.terminal import with_json

    found = bench.measure(*given, options.rounds)
    with with_json(found, options.json) as console:
        print(*bench.lines(found), sep="\n", file=console.file)
    return Status.WITHIN


@options
class BenchSize(Command):
    """Measure how the native engine's cost grows with the size of a mechanism: chains of loops and
    rings, by processor time. A step is the growth from one size to the next, as a multiple of the
    growth of the size.
    """

    about = "the native engine's cost by size, and its steps"
    loops: tuple[int, ...] = option("loops of chains", whole(1), "N", several="once", default=())
    cranks: tuple[int, ...] = option("cranks of rings", whole(3), "N", several="once", default=())
    rounds: int = _rounds("rounds")
    json: str | None = json_file()

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from .bench import growth

        given = self.loops or self.cranks
        loops, cranks = (self.loops, self.cranks) if given else (growth.LOOPS, growth.CRANKS)
        return _tell(self, growth, loops, cranks)


@options
class BenchAll(Command):
    """Measure the engines on a few cases, and the formulation. This takes some minutes."""

    about = "measure the engines, the formulation and its programs"
    below: ClassVar[Mapping[str, type[Command]]] = {
        "engines": BenchEngines,
        "formulation": BenchFormulation,
        "compliance": BenchCompliance,
        "curves": BenchCurves,
        "numpy": BenchNumpy,
        "forces": BenchForces,
        "size": BenchSize,
    }
    out: Path | None = destination("write bench.json and bench.html there", Path, "DIR")
    json: str | None = json_file()
    quiet: bool = verbosity("print no progress")

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        given = {name: getattr(self, name) for name in ("out", "json", "quiet", "command")}
        every = with_values(BenchEngines(), cases=CASES, **given)
        return _measure_engines(every, registry, formulation=True)


SAMPLES = 2000
FILES = ("stress.json", "stress.html", "stress.md")
OF_FAMILIES = ("family", "samples", "seed", "no_proofs")
"""Options of random mechanisms."""


@options
class StressEngines(Command):
    """Run engines on random mechanisms that are difficult for solvers, and judge every sample.

    Exit status: 0 no sample is silently wrong or refused for a wrong reason, 1 some are, 2 the tool
    could not do its work, or an engine supports none of the samples.
    """

    about = "stress-test engines with random degenerate mechanisms"
    family: tuple[str, ...] = option("default: all families", metavar="NAME", several="together")
    list: bool = switch("list the families")
    samples: int | None = option(
        f"number of samples over all families; default {SAMPLES}",
        whole(1),
        "N",
    )
    seed: int | None = option("seed of the random mechanisms; default 0", whole(0), "S")
    engine: tuple[str, ...] = option("default: native", metavar="NAME", several="together")
    mode: str | None = option(MODE, choices=MODES)
    out: Path | None = destination(
        "write the tables there, and the smallest bad cases as reduced case files", Path, "DIR"
    )
    json: str | None = json_file()
    no_proofs: bool = switch(
        "skip the proof of a share of the reference motions, which needs python-flint",
    )
    replay: tuple[Path, ...] = option("judge case files instead", Path, "FILE", several="together")
    tol: float | None = option(
        f"largest accepted constraint residual of replayed files; default {TOL:g}",
        positive,
        "X",
    )
    quiet: bool = verbosity("print no progress")

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        from ...cli.destinations import json_only
        from ...harness.engine import STANDARD
        from ...report.terminal import page, table_without_heads
        from ..reports.reports import deliver
        from .stress.families import FAMILIES
        from .stress.report import idle, markdown, report
        from .stress.verdicts import BAD

        if self.list:
            if found := names_of_given(
                self, [name for name in vars(self) if name not in ("list", "command")]
            ):
                raise KincheckError(f"--list runs nothing. Leave out {found}.")
            rows = [(name, family.about) for name, family in FAMILIES.items()]
            page(None).print(table_without_heads(rows))
            return Status.WITHIN
        problems: list[str] = []
        engines = registry.find_engines(self.engine or [STANDARD], problems, self.mode)
        if self.replay:
            if self.out or self.json:
                problems.append("--replay only prints its findings. Leave out --out and --json.")
            if found := names_of_given(self, OF_FAMILIES):
                problems.append(
                    f"--replay judges files, which belong to no family. Leave out {found}."
                )
            refuse(problems)
            return _replay(self, registry, engines)
        if self.tol is not None:
            problems.append(
                "--tol is for replayed files, and families have their own tolerances. Leave it out,"
                " or give --replay."
            )
        wanted = dict.fromkeys(self.family or FAMILIES)
        problems += [unknown("family", name, FAMILIES) for name in wanted if name not in FAMILIES]
        refuse([*problems, *self.unwritable(*FILES)])
        with json_only() if self.json == "-" else nullcontext():
            found = _run(self, [FAMILIES[name] for name in wanted], engines, problems)
        made = report(found)
        problems += [
            *(f"family {name} was not finished: {why}" for name, why in found.unfinished.items()),
            *idle(found),
        ]
        beside = {FILES[2]: markdown(made)}
        deliver(made, found, out=self.out, json=self.json, beside=beside, problems=problems)
        bad = any(cell.samples[verdict] for cell in found.cells for verdict in BAD)
        return Status.DEVIATES if bad else Status.WITHIN


def _run(
    options: StressEngines,
    families: list[Family],
    engines: list[Engine],
    problems: list[str],
) -> Stress:
    """Run the families; reduce and save bad examples.

    Args:
        problems: receives the reasons of examples that cannot be written.
    """
    from msgspec.structs import replace

    from ..sweep.meter import Meter
    from .stress.reduction import save
    from .stress.run import stress

    with Meter("stress", quiet=options.quiet) as meter:
        found, examples = stress(
            families,
            engines,
            samples=options.samples or SAMPLES,
            seed=options.seed or 0,
            command=options.command,
            prove=not options.no_proofs,
            progress=meter,
        )
    if options.out is not None and examples:
        saved = [save(example, options.out, problems) for example in examples]
        found = replace(found, findings=saved)
    return found


def _replay(options: StressEngines, registry: Registry, engines: list[Engine]) -> int:
    """Judge case files by following their motion from the design."""
    from .stress.reduction import judge
    from .stress.verdicts import BAD, Verdict

    bad, examined = False, set[str]()
    for file in options.replay:
        case = registry.find_case(str(file))
        for engine in engines:
            found = judge(case, engine, options.tol or TOL)
            counts = ", ".join(
                f"{verdict} {found.counts[verdict]}" for verdict in Verdict if found.counts[verdict]
            )
            print(f"{file.name}  {engine.name} {engine.mode}: {counts}")
            if any(
                found.counts[verdict]
                for verdict in Verdict
                if verdict not in (Verdict.UNJUDGED, Verdict.UNSUPPORTED)
            ):
                examined.add(engine.name)
            for verdict in BAD:
                sample = found.first(verdict)
                if sample is not None:
                    bad = True
                    worst = found.worst[0]
                    off = (
                        ""
                        if worst is None
                        else f", position error {worst:.2g} times the round-off bound"
                    )
                    print(
                        f"  {verdict} first at {case.sweep.driver} ="
                        f" {case.sweep.values[sample]:.9g}{off}"
                    )
            if found.message:
                print(f"  {found.message}")
    if idle := [engine.name for engine in engines if engine.name not in examined]:
        raise KincheckError(
            f"no sample of {', '.join(idle)} was judged. Give another engine or other files."
        )
    return Status.DEVIATES if bad else Status.WITHIN
