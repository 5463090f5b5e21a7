"""Sweep over design variants: solve and reduce them chunk by chunk, in threads or on a cluster;
differentiate, cross-check.
"""

from __future__ import annotations

import hashlib
import pickle
import sys
from collections import OrderedDict, deque
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from itertools import islice
from threading import Lock
from time import perf_counter, process_time
from typing import Any, TypeAlias

import numpy as np

from ...case.case import Case
from ...errors import KincheckError
from ...harness.execution import error_text
from ...harness.interrupts import deferred, hold
from ...harness.provenance import circumstances
from ...harness.workers.serve import pack
from ...version import VERSION
from ..cluster.distributed import (
    SILENT,
    ClusterError,
    Tasks,
    connect_client,
    load_distributed,
)
from ..designs.design_batch import start_notes
from . import results
from .chunk_files import ParquetStore, Part
from .conformance import capabilities, histogram, worst_sample
from .cross_check import Check, Checked, choose_variants, cross_check, require_able
from .statistics import quantiles
from .study import Chunk, Ready, Study, gradients
from .study_choices import Incomplete, Mode, Sampling
from .variation import Variation

Chunks: TypeAlias = Generator[Chunk]
Source: TypeAlias = Callable[[Study, int], Chunks]
"""Solves the chunks of a study from an index on, and yields each chunk once, in order."""

# Chunks in progress for each thread: the thread solves one, the others wait for their turn.
AHEAD = 3


def on_threads(ready: Ready, jobs: int) -> Source:
    """Return the source in threads of this process; the programs run without Python's lock."""

    def solve(study: Study, first: int = 0) -> Chunks:
        if jobs == 1:
            yield from map(ready.chunk, range(first, study.chunks))
            return
        waiting = deque[Any]()
        with ThreadPoolExecutor(jobs) as pool:
            try:
                for index in range(first, study.chunks):
                    waiting.append(pool.submit(ready.chunk, index))
                    if len(waiting) >= AHEAD * jobs:
                        yield waiting.popleft().result()
                while waiting:
                    yield waiting.popleft().result()
            finally:
                pool.shutdown(wait=True, cancel_futures=True)

    return solve


def on_cluster(address: str, silent: float = SILENT) -> Source:
    """Return the source on the workers of a dask.distributed scheduler.

    If a worker is lost or silent, other workers repeat its tasks.

    Args:
        silent: longest time without a heartbeat of a worker [s].

    Raises:
        ClusterError: dask.distributed is not installed, the scheduler does not answer or
            disappeared, every worker of a task was lost, or a worker cannot solve.
    """

    def solve(study: Study, first: int = 0) -> Chunks:
        packed, ready = pack(study), dict[int, Chunk]()
        with connect_client(load_distributed(), address) as client:
            tasks = Tasks(client, address, silent)
            waiting = iter(range(first, study.chunks))
            for index in range(first, study.chunks):
                while index not in ready:
                    # asked each time: workers may come and go
                    more = AHEAD * tasks.threads - len(tasks) - len(ready)
                    for late in islice(waiting, max(0, more)):
                        tasks.submit(late, (solve_there, packed, late, VERSION))
                    number, found = tasks.next()
                    ready[number] = _chunk_or_error(found, address)
                yield ready.pop(index)

    return solve


def _chunk_or_error(found: Chunk | Exception, address: str) -> Chunk:
    """Return a chunk; raise an exception in its place with an explanation."""
    if isinstance(found, Chunk):
        return found
    if isinstance(found, ClusterError):
        raise found
    why = error_text(found)
    if type(found).__name__ == "KilledWorker":
        why = f"every worker that had some chunks was lost: {why}"
    elif not isinstance(found, TimeoutError):
        why = f"a worker cannot solve: {why}"
    raise ClusterError(f"scheduler {address}: {why}") from found


_ready: OrderedDict[bytes, Ready] = OrderedDict()
_lock = Lock()


def solve_there(packed: bytes, index: int, version: str) -> Chunk:
    """Solve a chunk in a worker of a cluster. The worker keeps the compiled model for later chunks.

    Raises:
        ClusterError: the worker has another version of kincheck.
    """
    if version != VERSION:
        raise ClusterError(
            f"kincheck {VERSION} on the cluster's worker, expected {version} as in the sweep."
            " Install the same there."
        )
    key = hashlib.sha256(packed).digest()
    with _lock:  # a worker's threads share the model; a worker keeps the models of two studies
        if key not in _ready:
            _ready[key] = Ready.of(pickle.loads(packed))
            if len(_ready) > 2:
                _ready.popitem(last=False)
        ready = _ready[key]
    return ready.chunk(index)


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
    store: ParquetStore | None = None,
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
        require_able(study, check)
        study = replace(study, picked=choose_variants(study.samples, check.share, seed))
    study = replace(study, subset=min(1.0, _subset_size(study) / study.samples))
    ready = Ready.of(study)
    found = study.empty_chunk
    for chunk in part.finished(study) if part is not None else ():
        found += _without_store(chunk, store)
    begin, cpu, earlier = perf_counter(), process_time(), found.count
    seconds = processor = 0.0
    checked: list[Checked] = []
    try:
        with closing((source or on_threads(ready, jobs))(study, found.index + 1)) as chunks:
            for chunk in chunks:
                with deferred():  # an interrupt waits: a chunk is added everywhere or nowhere
                    if part is not None:
                        part.add(chunk)
                    found += _without_store(chunk, store)
                seconds, processor = perf_counter() - begin, process_time() - cpu
                new = found.count - earlier
                progress(Progress(found.count, study.samples, found.failures, seconds, new))
        if check is not None:
            checked = cross_check(study, check, found.picked)
        hold()
    except (KeyboardInterrupt, ClusterError) as reason:
        if stopped is None or not found.count:
            raise
        stopped(reason)
    slopes = gradients(study)
    exact = (
        study.subset >= 1.0
        and variation.mode is not Mode.MONTE_CARLO
        and found.count == study.samples
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
    route = ready.outputs.designs.route
    run["cases"][case.name]["notes"] += start_notes(route, tol)
    measured = _speed_figures(
        study, found.count - earlier, jobs if source is None else None, seconds, processor
    )
    return results.SweepResults(
        run=run,
        case=case.name,
        mode=str(variation.mode),
        seed=seed,
        samples=found.count,
        asked=study.samples,
        coordinates=results.coordinates(study),
        driver={name: values.tolist() for name, values in case.sweep.moved.items()},
        sampling=str(sampling),
        correlations=results.correlations(study),
        length_unit=variation.units.length,
        angle_unit=variation.units.angle,
        outputs=results.envelopes(study, found.summary, kept, ready.nominal, histograms),
        limits=limits,
        incomplete=str(incomplete),
        quantiles_of=kept[0].kept,
        gradients=results.gradient_table(study, slopes),
        effects=results.effect_table(study, np.concatenate(found.effects, axis=1)),
        unsolved=found.failures,
        failed=[*found.unsolved],
        retried=found.retried,
        check_engine=check.engine.name if check else None,
        checked=checked,
        measured=measured | {"peak_memory_mb": _peak_memory()},
    )


def _without_store(chunk: Chunk, store: ParquetStore | None) -> Chunk:
    """Return a chunk without the values of all variants, after their storage."""
    if store is not None:
        store.write(chunk)
    return replace(chunk, stored=())


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
                f"{variation.mode} draws as many variants as it is told. Give --samples."
            )
        listed = samples
    elif samples is not None:
        raise KincheckError(
            f"--samples: {variation.mode} has {listed} variants as listed, none is drawn. Leave"
            " it out."
        )
    if not 1 <= listed <= MOST_VARIANTS:
        raise KincheckError(
            f"{listed} variants, expected 1 to {MOST_VARIANTS}. Vary less at once, or in fewer"
            " steps."
        )
    return listed


def _subset_size(study: Study) -> int:
    return max(1, min(KEPT, KEPT_BYTES // (8 * len(study.rows) * len(study.case.sweep.values))))


def _speed_figures(
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
