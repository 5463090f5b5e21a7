"""Cost of many designs: against batch size, variants of the hardpoints solved together, one per
lane; and against threads, variants drawn, solved and reduced as by `kincheck sweep`.
"""

from __future__ import annotations

import os
import statistics
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from time import perf_counter

import msgspec
import numpy as np

from ....case.case import Case, size
from ....harness.compare import output_series
from ....joints import Kind
from ....kinematics import NativeSolver, ProgramSize, kinds, places
from ....program import ITERATIONS
from ....program.executor import compiler
from ....trajectory import PointMotion, Trajectory
from ...designs.design_batch import Variants
from ...designs.prepared import PreparedDesigns, prepare_designs
from ...sweep.sweep import sweep_designs
from ...sweep.variation import Coordinate, Law, Mode, Variation
from .precision import flops_of_sample
from .rounds import Peak, Spread, Work, spread, take_turns

SIZES = (1, 4, 16, 64, 256, 1024, 4096)
# Standard deviation of the hardpoints' coordinates, relative to the mechanism's size, as in a
# tolerance study.
SCATTER = 1e-3
SEED = 943745


class Batch(msgspec.Struct, frozen=True, kw_only=True):
    """A number of variants solved together.

    Attributes:
        solved: share of the samples reached; retried: number of variants solved again alone.
        error: largest position error of the first variant, the case itself, over the outputs in
            metres [m].
        us_per_sample: time per sample and variant [us].
        flops_per_sample, gflops: operations of the programs for an accepted sample, and per
            nanosecond.
        of_peak: fraction of the measured peak of a core; null if the peak is unknown.
    """

    case: str
    variants: int
    loop: str
    solved: float
    retried: int
    error: float | None
    us_per_sample: Spread
    flops_per_sample: float
    gflops: float
    of_peak: float | None


def measure_batches(case: Case, tol: float, rounds: int, peak: Peak | None) -> list[Batch]:
    """Solve batches of all sizes in turns with the peak kernel.

    Args:
        case: the case with its reference.
    """
    hardpoints = _every_hardpoint(case)
    varied, nominal = tuple(hardpoints.places), hardpoints.nominal
    designs = prepare_designs(NativeSolver(), case.mechanism, case.sweep.path, varied, case.points)
    scatter = (
        np.random.default_rng(SEED).normal(size=(len(nominal), max(SIZES))) * SCATTER * size(case)
    )
    scatter[:, 0] = 0.0
    batches = {
        count: partial(designs.solve, nominal[:, None] + scatter[:, :count], tol) for count in SIZES
    }
    work: dict[int, Work] = {**batches} if peak is None else {**batches, 0: peak}
    seconds = take_turns(work, rounds)
    rows: list[Batch] = []
    for count, solve in batches.items():
        found, n = solve(), len(case.sweep.values)
        reached = int(found.solved.sum())
        model = designs.route.model
        taken: list[float] = found.kept[model.rows[ITERATIONS].start][found.solved].tolist()
        iterations = statistics.fmean(taken) if taken else 0.0
        flops = flops_of_sample(ProgramSize.of(model), iterations, motions=True)
        rate = flops * reached / seconds[count].median
        rows.append(
            Batch(
                case=case.name,
                variants=count,
                loop="compiled" if compiler() else "python",
                solved=reached / (n * count),
                retried=found.retried,
                error=_error(case, designs, found),
                us_per_sample=seconds[count].times(1e6 / (n * count)),
                flops_per_sample=flops,
                gflops=1e-9 * rate,
                of_peak=None if peak is None else rate / peak.rate(seconds[0]),
            )
        )
    return rows


def _error(case: Case, designs: PreparedDesigns, found: Variants) -> float | None:
    """Return the position error of the first variant [m]."""
    points = {
        name: PointMotion(*(each[:, :, 0].T for each in designs.motion(found, name)))
        for name in case.points
    }
    solved = found.solved[:, 0]
    whole = Trajectory(points, solved, np.zeros_like(solved, dtype=np.int64), 0.0, "", {})
    errors = [
        np.abs(output_series(case, output, whole).position - case.reference[output.name].position)
        for output in case.outputs
        if output.unit == "m" and output.name in case.reference
    ]
    return float(np.max(errors)) if errors and np.isfinite(errors).all() else None


# Chunks of the size for a million variants, enough of them to let all threads end together.
VARIANTS = 262_144
# Rounds take some seconds each, so a few give a good median.
MOST_ROUNDS = 8
# Calls of the peak kernel in a round: as long as several chunks of a study.
CALLS = 1000


class StudyRate(msgspec.Struct, frozen=True, kw_only=True):
    """A study on a number of threads.

    Attributes:
        us_per_sample: time of the whole machine per sample and variant [us].
        times: speed relative to one thread, by round; 1 for one thread.
        peak_times: relative speed of the peak kernel, which needs no memory: the machine's share;
            null if unknown.
        unsolved: number of variants without a solution at some sample.
    """

    case: str
    variants: int
    jobs: int
    us_per_sample: Spread
    times: Spread
    peak_times: Spread | None
    unsolved: int


def measure_studies(case: Case, tol: float, rounds: int, peak: Peak | None) -> list[StudyRate]:
    """Sweep over designs on one thread and on two, in turns; without a second processor only on
    one.
    """
    variation, jobs = _every_hardpoint(case), range(1, 1 + min(2, os.cpu_count() or 1))
    seconds: dict[int, list[float]] = {each: [] for each in jobs}
    kernel: dict[int, list[float]] = {each: [] for each in jobs}
    # warm
    found = {
        each: sweep_designs(case, variation, samples=VARIANTS // 8, seed=SEED, tol=tol, jobs=each)
        for each in jobs
    }
    for _ in range(min(rounds, MOST_ROUNDS)):
        for each in jobs:
            found[each] = sweep_designs(
                case, variation, samples=VARIANTS, seed=SEED, tol=tol, jobs=each
            )
            seconds[each].append(found[each].measured["seconds"])
            if peak is not None:
                kernel[each].append(_side_by_side(peak, each) / each)
    points = VARIANTS * len(case.sweep.values)
    return [
        StudyRate(
            case=case.name,
            variants=VARIANTS,
            jobs=each,
            us_per_sample=spread(seconds[each]).times(1e6 / points),
            times=_times(seconds, each),
            peak_times=_times(kernel, each) if peak is not None else None,
            unsolved=found[each].unsolved,
        )
        for each in jobs
    ]


def _times(seconds: dict[int, list[float]], jobs: int) -> Spread:
    return spread([one / several for one, several in zip(seconds[1], seconds[jobs], strict=True)])


def _side_by_side(work: Callable[[], object], jobs: int) -> float:
    """Return the time of equally many calls in each thread [s]."""
    begin = perf_counter()
    with ThreadPoolExecutor(jobs) as pool:
        for done in [pool.submit(lambda: [work() for _ in range(CALLS)]) for _ in range(jobs)]:
            done.result()
    return perf_counter() - begin


def _every_hardpoint(case: Case) -> Variation:
    """Return variations of all points and lengths, independent as in batches."""
    known, scale = places(case.mechanism), SCATTER * size(case)
    varied = [name for name, kind in kinds(case.mechanism).items() if kind is not Kind.DIRECTION]
    coordinates = [
        Coordinate(name, axis, "m", Law.NORMAL, scale)
        for name in varied
        for axis in ("xyz" if len(known[name]) == 3 else ("",))
    ]  # fmt: skip
    nominal = np.array([number for name in varied for number in known[name]])
    sizes = {name: len(known[name]) for name in varied}
    return Variation(sizes, nominal, np.eye(len(nominal)), Mode.MONTE_CARLO, tuple(coordinates))
