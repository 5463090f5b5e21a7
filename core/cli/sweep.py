"""kincheck sweep: solve many variants of a case's design and reduce its outputs over them."""

from __future__ import annotations

import argparse
import math
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import KincheckError
from ..harness.interrupts import hold, status_of, words_of
from ..report.progress import complain
from ..version import VERSION
from . import execution_options, import_options
from .registry import Registry, Status
from .sweep_inputs import limited, only
from .sweep_options import FILES, LIMITS, PART, add_options
from .sweep_replay import checking_solver, replay, replay_problems

if TYPE_CHECKING:
    from ..harness.engine import Engine
    from ..studies.tolerance.chunk_files import Part
    from ..studies.tolerance.results import SweepResults
    from ..studies.tolerance.study import Study
    from ..studies.tolerance.sweep import Progress

# Interval between lines of progress without a terminal [s].
EVERY = 10.0


def add(commands: Any) -> None:
    """Add the command to the parser."""
    sweep: argparse.ArgumentParser
    sweep = commands.add_parser(
        "sweep", help="solve many variants of a design", description=_sweep.__doc__
    )
    sweep.set_defaults(do=_sweep)
    add_options(sweep)


def _sweep(options: argparse.Namespace, registry: Registry) -> int:
    """Solve variants of a case whose hardpoints, directions and lengths vary, and reduce its
    outputs over them.

    Exit status: 0 every variant has a solution and every cross-check agrees, 1 otherwise, 2 the
    tool could not do its work. An interrupted sweep writes its partial results and exits with
    status 130.
    """
    from ..studies.tolerance.study import Study
    from ..studies.tolerance.sweep import how_many
    from ..studies.variation.variation_file import read_variation
    from .destinations import Destinations

    problems: list[str] = []
    names = ("results.json", "report.html") if options.replay else FILES
    problems += Destinations.of(options).problems(names)
    if options.scheduler is not None and options.jobs is not None:
        problems.append("--scheduler: the cluster decides the number of threads; leave out --jobs")
    problems += replay_problems(options)
    if options.replay and (options.store or options.scheduler):
        problems.append(
            "--replay solves in this process and stores nothing; leave out --store and --scheduler"
        )
    if options.resume and (options.out is None or options.replay):
        problems.append(
            "--resume continues from a folder of results: give --out DIR, and leave out --replay"
        )
    engine, share = _check(options, registry, problems)
    whole = registry.find_case(options.case, import_options.supplied(options))
    case = only(whole, options.output, problems)
    import_options.tell_left_out([case])
    problems = problems or execution_options.unreachable(options)
    if problems:
        raise KincheckError("\n".join(problems))
    variation = read_variation(options.vary, whole)
    variation = limited(options, variation, whole, case)
    if options.replay and options.samples is None:
        samples = variation.count or 0
    else:
        samples = how_many(variation, options.samples)
    variation = variation.sampled(options.sampling, samples)
    study = Study(case, variation, samples, options.seed, options.order, options.tol)
    if options.replay:
        return replay(options, registry, study, engine)
    with ExitStack() as stack:
        part = None if options.out is None else stack.enter_context(_part(options))
        stops: list[KeyboardInterrupt | KincheckError] = []
        results = _solve(options, study, engine, share, part, stops, problems)
        hold()
        problems += _deliver(options, results) + (part.problems if part is not None else [])
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


def _check(
    options: argparse.Namespace, registry: Registry, problems: list[str]
) -> tuple[Engine | None, float]:
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
            f"--check {options.check}: found the share {text!r}, expected a fraction such as"
            " 0.01; correct it"
        )
    engines = registry.find_engines([name], problems)
    return (engines[0] if engines else None), share


def _part(options: argparse.Namespace) -> Part:
    """Return the file of the finished part, with all facts that its numbers depend on besides the
    study.
    """
    import numpy as np

    from ..harness.provenance import processor
    from ..program.llvm.compiler import available
    from ..studies.tolerance.chunk_files import Part
    from .joint_loading import sources

    facts = {
        "kincheck": VERSION,
        "numpy": np.__version__,
        "llvm": available(),
        "processor": processor(),
    }
    return Part(
        options.out / PART, facts | {"joints": sources(options.joint_type)}, resume=options.resume
    )


def _solve(
    options: argparse.Namespace,
    study: Study,
    engine: Engine | None,
    share: float,
    part: Part | None,
    stops: list[KeyboardInterrupt | KincheckError],
    problems: list[str],
) -> SweepResults:
    from ..harness.resource_limits import default_jobs
    from ..report.meter import Meter
    from ..studies.tolerance.chunk_files import ParquetStore
    from ..studies.tolerance.sweep import Check, on_cluster, sweep_designs

    def solved(progress: Progress) -> None:
        rate = f"{progress.solved / progress.seconds:.3g} variants/s"
        unsolved = f", {progress.unsolved} unsolved" if progress.unsolved else ""
        meter(
            f"[{progress.done}/{progress.total}] {rate}{unsolved}", progress.done / progress.total
        )

    def checked(done: int, total: int) -> None:
        meter(f"[{done}/{total}] checked", done / total)

    meter = Meter("sweep", quiet=options.quiet, every=EVERY)
    check = None
    if engine is not None:
        check = Check(engine, share, checking_solver(options, engine), options.tol, checked)
    with ExitStack() as stack:
        stack.enter_context(meter)
        store = (
            None
            if options.store is None
            else stack.enter_context(ParquetStore(options.store, study))
        )
        results = sweep_designs(
            study.case,
            study.variation,
            samples=options.samples,
            seed=options.seed,
            sampling=options.sampling,
            order=options.order,
            incomplete=options.incomplete,
            tol=options.tol,
            jobs=options.jobs or default_jobs(),
            source=None if options.scheduler is None else on_cluster(options.scheduler),
            check=check,
            store=store,
            progress=solved,
            command=options.command,
            part=part,
            stopped=stops.append,
        )
    problems += [] if store is None else store.problems
    return results


def _deliver(options: argparse.Namespace, results: SweepResults) -> list[str]:
    """Print the table and write the requested files; return the problems in writing."""
    from ..case.io.atomic_files import to_standard_output, write_all
    from ..harness.record import to_json
    from ..studies.tolerance.page import page
    from ..studies.tolerance.tables import envelope_csv, gradient_csv, limits_csv, print_sweep

    encoded = to_json(results)
    contents = [(Path(options.json), encoded)] if options.json not in (None, "-") else []
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
    problems = write_all(contents)  # first: the reader of standard output may have closed it
    print_sweep(results, sys.stderr if options.json == "-" else sys.stdout)
    if options.json == "-":
        to_standard_output(encoded)
    return problems
