"""kincheck sweep: solve many variants of a case's design and reduce its outputs over them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...case.io.reader_options import Supplied
from ...cli.parser import Command
from ...cli.registry import Registry, Status
from ...cli.shared_options import TOL
from ...errors import KincheckError, refuse, unknown
from ...harness.interrupts import hold, status_of, words_of
from ...options import (
    ONE_CASE,
    argument,
    destination,
    group,
    joint_types,
    json_file,
    option,
    options,
    positive,
    switch,
    verbosity,
    whole,
)
from ...report.progress import complain, explain_no_comparison, missing_requirements
from ...version import VERSION
from ..cluster.source import SCHEDULER, Scheduler
from .study_choices import Incomplete, Sampling

if TYPE_CHECKING:
    from ...case.case import Case
    from ...harness.engine import Engine
    from ...harness.execution import Solver
    from .chunk_files import Part
    from .results import SweepResults
    from .study import Study
    from .sweep import Progress
    from .variation import Variation

PART = "sweep.part"
"""File of the finished part of a sweep, in its folder of results until the sweep ends."""

LIMITS = "limits.csv"
"""File of the specification limits, for studies with limits."""

FILES = ("sweep.json", "sweep.html", "envelope.csv", "gradients.csv")

# Interval between lines of progress without a terminal [s].
EVERY = 10.0


@options
class Sweep(Command):
    """Solve variants of a case whose hardpoints, directions and lengths vary, and reduce its
    outputs over them.

    Exit status: 0 every variant has a solution and every cross-check agrees, 1 otherwise, 2 the
    tool could not do its work. An interrupted sweep writes its partial results and exits with
    status 130.
    """

    about = "solve many variants of a design"
    case: str | Path | Case = argument(ONE_CASE, "CASE")
    variation: str | Path = option(
        "file that states what varies, and by how much (kincheck-vary/1)",
        Path,
        "FILE",
        flag="--vary",
        required=True,
        kw_only=False,
    )
    samples: int | None = option("number of random variants", whole(1), "N", default=None)
    seed: int = option("seed of the random variants; default %(default)s", whole(0), "S", default=0)
    sampling: Sampling = option(
        "sampling of the variants: random, Latin hypercube or Sobol sequence; default %(default)s",
        Sampling,
        choices=[*Sampling],
        default=Sampling.RANDOM,
    )
    limit: tuple[str, ...] = option(
        "specification limits of an output, as toe:-2:2deg, or in the units of the --vary file;"
        " one may be empty."
        " The study counts the variants inside, with Cp and Cpk",
        metavar="OUTPUT:LOW:HIGH",
        several="repeated",
        default=(),
    )
    incomplete: Incomplete = option(
        "variants that do not reach all samples: outside of the limits, or left out of the"
        " yield; default %(default)s",
        Incomplete,
        choices=[*Incomplete],
        default=Incomplete.OUTSIDE,
    )
    output: tuple[str, ...] = option(
        "only these outputs; default: all",
        metavar="NAME",
        several="together",
        default=(),
    )
    order: int = option(
        "also reduce time derivatives up to this order; default %(default)s",
        int,
        choices=(0, 1, 2),
        default=0,
    )
    tol: float = option(
        f"largest accepted constraint residual; default {TOL:g}", positive, "X", default=TOL
    )
    jobs: int | None = option(
        "number of threads; default: half the processors", whole(1), "N", default=None
    )
    scheduler: str | None = destination(SCHEDULER, metavar="ADDRESS")
    check: str | None = destination(
        "rebuild a share of the variants, at least one, as separate cases, and solve them"
        " with this engine; default share 0.01",
        metavar="ENGINE[:SHARE]",
    )
    replay: tuple[int, ...] = option(
        "solve only these variants of the seed, each as a separate case, as kincheck run"
        " does; also with the engine of --check",
        whole(0),
        "INDEX",
        several="once",
        init=False,
    )
    store: Path | None = destination("write the values of all variants as Parquet", Path)
    out: Path | None = destination(
        f"write {', '.join(FILES)} there, and {LIMITS} if there are limits", Path, "DIR"
    )
    json: str | None = json_file()
    resume: bool = switch(
        f"continue the same sweep from its finished part, {PART} in the folder of --out", init=False
    )
    quiet: bool = verbosity("print no progress")
    joint_type: tuple[str, ...] = joint_types()
    supplied: Supplied = group(default_factory=Supplied, kw_only=False)

    def answer(self, registry: Registry) -> SweepResults:
        """Solve variants of a case whose dimensions vary, and reduce its outputs over them.

        Raises:
            KincheckError: a file is invalid, or the number of samples is missing or superfluous.
        """
        study = self._study(registry, [])
        return self.solve(study)

    def _study(self, registry: Registry, problems: list[str]) -> Study:
        """Return the study.

        Raises:
            KincheckError: these problems, or those of the files.
        """
        from .study import Study
        from .sweep import how_many
        from .variation_file import read_variation

        whole = registry.case_of(self)
        case = only(whole, self.output, problems)
        if self.scheduler is not None:
            problems = problems or Scheduler.unreachable(self)
        refuse(problems)
        variation = with_limits(self, read_variation(Path(self.variation), whole), whole, case)
        if self.replay and self.samples is None:
            samples = variation.count or 0
        else:
            samples = how_many(variation, self.samples)
        variation = variation.sampled(self.sampling, samples)
        return Study(case, variation, samples, self.seed, self.order, self.tol)

    def solve(self, study: Study, **how: Any) -> SweepResults:
        """Solve a study."""
        from ...harness.resource_limits import default_jobs
        from .sweep import sweep_designs

        return sweep_designs(
            study.case,
            study.variation,
            samples=self.samples,
            seed=self.seed,
            sampling=self.sampling,
            order=self.order,
            incomplete=self.incomplete,
            tol=self.tol,
            jobs=self.jobs or default_jobs(),
            command=self.command,
            **how,
        )

    def run(self, registry: Registry) -> int:
        """Do the work of the command line."""
        problems: list[str] = []
        names = ("results.json", "report.html") if self.replay else FILES
        problems += self.unwritable(*names)
        if self.scheduler is not None and self.jobs is not None:
            problems.append(
                "--scheduler: the cluster decides the number of threads. Leave out --jobs."
            )
        latin = self.sampling is Sampling.LATIN
        if self.replay and latin and self.samples is None:
            problems.append(
                "--replay: a Latin hypercube depends on the number of variants. Give --samples."
            )
        if self.replay and not latin and self.samples is not None:
            problems.append("--replay: seed and index identify a variant. Leave out --samples.")
        if self.replay and (self.store or self.scheduler):
            problems.append(
                "--replay solves in this process and stores nothing. Leave out --store and"
                " --scheduler."
            )
        if self.resume and (self.out is None or self.replay):
            problems.append(
                "--resume continues from a folder of results. Give --out DIR, and leave out"
                " --replay."
            )
        engine, share = _check(self, registry, problems)
        study = self._study(registry, problems)
        if self.replay:
            return replay(self, registry, study, engine)
        with ExitStack() as stack:
            part = None if self.out is None else stack.enter_context(_part(self, self.out))
            stops: list[KeyboardInterrupt | KincheckError] = []
            results = _solve(self, study, engine, share, part, stops, problems)
            hold()
            problems += _deliver(self, results) + (part.problems if part is not None else [])
        for reason in stops:
            why = words_of(reason) if isinstance(reason, KeyboardInterrupt) else str(reason)
            goes_on = (
                "--resume continues from there"
                if part is not None
                else "with --out DIR, --resume can continue it"
            )
            problems.append(
                f"{why}: {results.samples} of {results.asked} variants are solved; {goes_on}"
            )
        complain(problems)
        if stops and isinstance(stops[0], KeyboardInterrupt):
            return status_of(stops[0])
        if problems:
            return Status.FAILED
        if part is not None:
            part.remove()
        return Status.DEVIATES if results.unsolved or results.deviating else Status.WITHIN


def _check(options: Sweep, registry: Registry, problems: list[str]) -> tuple[Engine | None, float]:
    """Return the engine of the cross-check, and the share of the variants."""
    if options.check is None:
        return None, 0.0
    name, _, text = options.check.partition(":")
    try:
        share = float(text) if text else 0.01
    except ValueError:
        share = math.nan
    if not 0.0 < share <= 1.0:
        problems.append(
            f"--check {options.check}: found the share {text!r}, expected a fraction such as 0.01."
        )
    engines = registry.find_engines([name], problems)
    return (engines[0] if engines else None), share


def _part(options: Sweep, folder: Path) -> Part:
    """Return the file of the finished part, with all facts that its numbers depend on besides the
    study.
    """
    import numpy as np

    from ...cli.joint_loading import sources
    from ...harness.provenance import processor
    from ...program.executor import compiler
    from .chunk_files import Part

    facts: dict[str, Any] = {
        "kincheck": VERSION,
        "numpy": np.__version__,
        "llvm": compiler() is not None,
        "processor": processor(),
    }
    facts |= {"joints": sources(options.joint_type)}
    return Part(folder / PART, facts, resume=options.resume)


def _solve(
    options: Sweep,
    study: Study,
    engine: Engine | None,
    share: float,
    part: Part | None,
    stops: list[KeyboardInterrupt | KincheckError],
    problems: list[str],
) -> SweepResults:
    from .chunk_files import ParquetStore
    from .meter import Meter
    from .sweep import Check, on_cluster

    def show_progress(progress: Progress) -> None:
        rate = f"{progress.solved / progress.seconds:.3g} variants/s"
        unsolved = f", {progress.unsolved} unsolved" if progress.unsolved else ""
        meter(
            f"[{progress.done}/{progress.total}] {rate}{unsolved}", progress.done / progress.total
        )

    def show_checks(done: int, total: int) -> None:
        meter(f"[{done}/{total}] checked", done / total)

    meter = Meter("sweep", quiet=options.quiet, every=EVERY)
    check = None
    if engine is not None:
        check = Check(engine, share, checking_solver(options, engine), options.tol, show_checks)
    with ExitStack() as stack:
        stack.enter_context(meter)
        store = (
            None
            if options.store is None
            else stack.enter_context(ParquetStore(options.store, study))
        )
        results = options.solve(
            study,
            source=None if options.scheduler is None else on_cluster(options.scheduler),
            check=check,
            store=store,
            progress=show_progress,
            part=part,
            stopped=stops.append,
        )
    problems += [] if store is None else store.problems
    return results


def _deliver(options: Sweep, results: SweepResults) -> list[str]:
    """Print the table and write the requested files; return the problems in writing."""
    from ...harness.record import to_json
    from ...report.terminal import deliver
    from .page import page
    from .tables import envelope_csv, gradient_csv, limits_csv, print_sweep

    encoded = to_json(results)
    contents: list[tuple[Path, bytes]] = []
    if options.out is not None:
        texts = (
            encoded,
            page(results).encode(),
            envelope_csv(results).encode(),
            gradient_csv(results).encode(),
        )
        contents += [(options.out / name, text) for name, text in zip(FILES, texts, strict=True)]
    if options.out is not None and results.limits:
        contents.append((options.out / LIMITS, limits_csv(results).encode()))
    return deliver(contents, encoded, options.json, partial(print_sweep, results))


def only(case: Case, names: Sequence[str], problems: list[str]) -> Case:
    """Return the case with the named outputs only, or with all if none is named."""
    there = [output.name for output in case.outputs]
    problems += [unknown("output", name, there) for name in names if name not in there]
    wanted = tuple(output for output in case.outputs if output.name in names or not names)
    return replace(case, outputs=wanted)


def with_limits(options: Sweep, variation: Variation, whole: Case, case: Case) -> Variation:
    """Return the variation with limits for the outputs of the case; limits of the options replace
    those of the file.
    """
    from .variation_file import limits_of_texts

    given = limits_of_texts(options.limit, whole, variation.units)
    limits = {each.output: each for each in (*variation.limits, *given)}
    there = {output.name for output in case.outputs}
    kept = {
        name: each
        for name, each in limits.items()
        if name in there or name.rpartition(".")[0] in there
    }
    if left_out := [name for name in limits if name not in kept]:
        complain(
            [f"limits of {', '.join(left_out)}: left out, as --output leaves out these outputs"]
        )
    return replace(variation, limits=tuple(kept.values()))


def replay(options: Sweep, registry: Registry, study: Study, engine: Engine | None) -> int:
    """Solve single variants as a run does, with its table, report and exit status."""
    from ...cli.destinations import deliver
    from ...harness import run as running
    from ...harness.engine import STANDARD

    for index in options.replay:
        if study.samples and index >= study.samples:
            raise KincheckError(
                f"--replay {index}: there are {study.samples} variants, 0 to {study.samples - 1}."
                " Give one of them."
            )
    native = registry.engine(STANDARD)
    engines = [native] if engine is None or engine.name == STANDARD else [native, engine]
    cases = [study.of_variant(index) for index in dict.fromkeys(options.replay)]
    results = running.run(
        cases,
        engines,
        tol=options.tol,
        command=options.command,
        solver=checking_solver(options, engines[-1]),
    )
    problems: list[str] = []
    deliver(results, problems, options)
    if engine is not None:
        problems += missing_requirements(results, [], [engine.name]) + explain_no_comparison(
            results
        )
    complain(problems)
    return Status.FAILED if problems else Status.of(results)


def checking_solver(options: Sweep, engine: Engine) -> Solver:
    """Return the solver of checked variants: this process for an engine without foreign code,
    worker processes for others.
    """
    from ...harness.engine import runs_in_process
    from ...harness.execution import solve_in_process
    from ...harness.resource_limits import Limits, default_jobs
    from ...harness.workers.pool import in_workers
    from ..cluster.distributed import on_cluster

    if options.scheduler is not None:
        return on_cluster(options.scheduler, Limits())
    if runs_in_process(engine):
        return solve_in_process
    return in_workers(options.jobs or default_jobs(), Limits())
