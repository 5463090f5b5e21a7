"""Cost of a tolerance study against threads: variants are drawn, solved and reduced, as by
`kincheck sweep`.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from time import perf_counter

import msgspec
import numpy as np

from ...case.case import Case, size
from ...joints import Kind
from ...kinematics import kinds, places
from ..tolerance.sweep import sweep_designs
from ..variation.variation import Coordinate, Law, Mode, Variation
from .batch import SCATTER, SEED
from .peak import Peak
from .rounds import Spread, spread

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
    return Variation(Mode.MONTE_CARLO, tuple(coordinates), sizes, nominal, np.eye(len(nominal)))
