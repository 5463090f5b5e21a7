"""Sweep over design variants: solve and reduce them chunk by chunk, differentiate, cross-check."""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from time import perf_counter, process_time
from typing import Any, Protocol

from ...case.case import Case
from ...errors import KincheckError
from ...harness.engine import Engine
from ...harness.execution import Solver
from ...harness.interrupts import deferred, hold
from ...harness.provenance import circumstances
from ...harness.workers.distributed import ClusterError
from ..variation.modes import Incomplete, Mode, Sampling
from ..variation.variation import Variation
from . import cross_check, result_tables, results
from .chunk import Chunk
from .chunk_execution import Source, on_threads
from .conformance import capabilities
from .gathered import Gathered
from .gradients import gradients
from .histograms import histogram, worst_sample
from .part_file import Part
from .reduce import quantiles
from .study import Ready, Study

# Variants kept for quantiles: the share below a 1 % quantile then has a standard error of 0.1 %.
KEPT = 10_000
# Limit of the memory of the kept values [bytes]; more outputs and samples allow fewer variants.
KEPT_BYTES = 64_000_000
# More variants are probably a mistake: at ten microseconds each, this number takes a day.
MOST_VARIANTS = 10**10


@dataclass(frozen=True, eq=False)
class Progress:
    """Progress of a sweep: finished, total and unsolved variants, the seconds of this run, and the
    variants solved in this run.
    """

    done: int
    total: int
    unsolved: int
    seconds: float
    solved: int


class Store(Protocol):
    """Storage for the values of all variants, chunk by chunk."""

    def write(self, chunk: Chunk) -> None:
        """Store a chunk's values and offsets; chunks come in order."""
        ...


@dataclass(frozen=True, eq=False)
class Check:
    """A cross-check: another engine solves a share of the variants too."""

    engine: Engine
    share: float
    solver: Solver
    tol: float
    progress: Callable[[int, int], None] = lambda done, total: None


def sweep_designs(
    case: Case,
    variation: Variation,
    *,
    samples: int | None = None,
    seed: int = 0,
    sampling: Sampling = Sampling.RANDOM,
    order: int = 0,
    incomplete: Incomplete = Incomplete.OUTSIDE,
    tol: float = 1e-12,
    jobs: int = 1,
    source: Source | None = None,
    check: Check | None = None,
    store: Store | None = None,
    progress: Callable[[Progress], None] = lambda progress: None,
    command: str = "",
    part: Part | None = None,
    stopped: Callable[[KeyboardInterrupt | ClusterError], None] | None = None,
) -> results.SweepResults:
    """Solve all variants of a case and reduce its outputs over them, chunk by chunk.

    Args:
        case: the case; its reference is not used.
        variation: the varied coordinates, from `read_variation`.
        samples: number of variants to draw; None if the variation lists them.
        seed: seed of the draws; equal seeds give equal variants on any machine with any `jobs`.
        sampling: choice of the drawn points.
        order: highest time derivative of the outputs to reduce: 0, 1 or 2.
        incomplete: judgement of variants that do not reach all samples, by the limits.
        tol: largest accepted constraint residual, relative to the mechanism's size.
        jobs: number of threads.
        source: solver of the chunks; None for threads of this process.
        check: an engine to cross-check with.
        store: receives the values of all variants.
        progress: called after every chunk.
        command: the command line, kept with the results.
        part: file of the solved chunks, with the chunks of an earlier, stopped sweep.
        stopped: called with the reason of an early stop; the results then hold the finished
            variants. Without `stopped`, or without a finished variant, the reason is raised.

    Raises:
        KincheckError: the number of variants is missing or does not fit the mode, the
            nominal design cannot be solved, the engine of the check is missing or unable, or
            there is no cluster.
    """
    started = datetime.now(UTC)
    case = replace(case, reference={})
    count = how_many(variation, samples)
    variation = variation.sampled(sampling, count)
    study = Study(case, variation, count, seed, order, tol, whole=store is not None)
    if check is not None:
        cross_check.require_able(study, check.engine, check.solver, check.tol)
        study = replace(study, picked=cross_check.chosen(study.samples, check.share, seed))
    study = replace(study, subset=min(1.0, _kept(study) / study.samples))
    ready = Ready.of(study)
    found = Gathered(study)
    for chunk in part.finished(study) if part is not None else ():
        found.add(chunk)
        if store is not None:
            store.write(chunk)
    begin, cpu, earlier = perf_counter(), process_time(), found.done
    checked: list[cross_check.Checked] = []

    def measured_so_far() -> dict[str, Any]:
        return _measured(
            study,
            found.done - earlier,
            jobs if source is None else None,
            perf_counter() - begin,
            process_time() - cpu,
        )

    try:
        with closing((source or on_threads(ready, jobs))(study, found.chunks)) as chunks:
            for chunk in chunks:
                with deferred():  # an interrupt waits: a chunk is added everywhere or nowhere
                    found.add(chunk)
                    if store is not None:
                        store.write(chunk)
                    if part is not None:
                        part.add(chunk)
                progress(
                    Progress(
                        found.done,
                        study.samples,
                        found.failures,
                        perf_counter() - begin,
                        found.done - earlier,
                    )
                )
        measured = measured_so_far()
        if check is not None:
            checked = cross_check.check(
                study, check.engine, check.solver, found.picked, check.tol, check.progress
            )
        hold()
    except (KeyboardInterrupt, ClusterError) as reason:
        if stopped is None or not found.done:
            raise
        stopped(reason)
        measured = measured_so_far()
    slopes = gradients(ready)
    exact = (
        study.subset >= 1.0
        and variation.mode is not Mode.MONTE_CARLO
        and found.done == study.samples
    )
    by_row = [[each[k] for each in found.kept] for k in range(len(study.rows))]
    limits = capabilities(study, found.limited, found.summary, by_row, incomplete)
    histograms = [
        histogram(parts, worst_sample(study, limits, found.summary, k))
        for k, parts in enumerate(by_row)
    ]
    with ThreadPoolExecutor(jobs) as pool:  # sorting runs without Python's lock
        kept = list(pool.map(partial(quantiles, exact=exact), by_row))
    run = circumstances([case], started=started, tol=tol, command=command)
    run["cases"][case.name]["notes"] += ready.designs.start_notes(tol)
    return results.SweepResults(
        run=run,
        case=case.name,
        mode=str(variation.mode),
        seed=seed,
        samples=found.done,
        asked=study.samples,
        coordinates=result_tables.coordinates(study),
        driver={name: values.tolist() for name, values in case.sweep.moved.items()},
        sampling=str(sampling),
        correlations=result_tables.correlations(study),
        length_unit=variation.units.length,
        angle_unit=variation.units.angle,
        outputs=result_tables.envelopes(study, found.summary, kept, ready.nominal, histograms),
        limits=limits,
        incomplete=str(incomplete),
        quantiles_of=kept[0].kept,
        gradients=result_tables.gradient_table(study, slopes),
        gradient_messages={
            variation.coordinates[k].name: message for k, message in sorted(slopes.messages.items())
        },
        effects=result_tables.effect_table(study, found.effects),
        unsolved=found.failures,
        failed=found.unsolved,
        retried=found.retried,
        check_engine=check.engine.name if check else None,
        checked=checked,
        measured=measured | {"peak_memory_mb": _peak_memory()},
    )


def how_many(variation: Variation, samples: int | None) -> int:
    """Return the number of variants.

    Args:
        samples: number of draws; None if the variants are listed.

    Raises:
        KincheckError: the number is missing, superfluous or too large.
    """
    listed = variation.count
    if listed is None:
        if samples is None:
            raise KincheckError(
                f"{variation.mode} draws as many variants as it is told; give --samples"
            )
        listed = samples
    elif samples is not None:
        raise KincheckError(
            f"--samples: {variation.mode} has {listed} variants as listed, none is drawn; leave"
            " it out"
        )
    if not 1 <= listed <= MOST_VARIANTS:
        raise KincheckError(
            f"{listed} variants, expected 1 to {MOST_VARIANTS}; vary less at once, or in fewer"
            " steps"
        )
    return listed


def _kept(study: Study) -> int:
    return max(1, min(KEPT, KEPT_BYTES // (8 * len(study.rows) * len(study.case.sweep.values))))


def _measured(
    study: Study, solved: int, jobs: int | None, seconds: float, cpu: float
) -> dict[str, Any]:
    """Return the rates of solving and reducing variants; a cluster has no rates by core."""
    points = solved * len(study.case.sweep.values)
    found: dict[str, Any] = {"seconds": seconds, "variants_per_second": solved / seconds}
    if jobs is not None and points:
        found |= {
            "jobs": jobs,
            "us_per_sample_and_core": 1e6 * seconds * jobs / points,
            "cpu_us_per_sample": 1e6 * cpu / points,
        }
    return found


def _peak_memory() -> float | None:
    """Return the peak memory of this process [MB, 1e6 bytes]; None on Windows."""
    if sys.platform == "win32":
        return None
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 1e6
