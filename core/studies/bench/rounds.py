"""Comparable times: contestants take turns in one process, so that other load of the machine
affects all of them.
"""

from __future__ import annotations

import gc
import math
from collections.abc import Callable, Mapping, Sequence
from time import perf_counter
from typing import TypeVar

import msgspec
import numpy as np

# Duration of a turn [s]: long against the clock's resolution, short against interruptions. Quick
# work is repeated in a turn.
TURN = 2e-3
# Number of first calls, one of which runs at full speed if programs are compiled at once; and the
# budget that limits slow work [s].
FIRST, PATIENCE = 16, 0.5

Key = TypeVar("Key")
Work = Callable[[], object]


class Spread(msgspec.Struct, frozen=True, kw_only=True):
    """A time over several rounds: median, quartiles and minimum; the owner states the unit."""

    least: float
    median: float
    lower: float
    upper: float
    rounds: int

    def times(self, factor: float) -> Spread:
        """Return the spread with all times multiplied by a factor, for another unit or amount."""
        least, median, lower, upper = (
            factor * each for each in (self.least, self.median, self.lower, self.upper)
        )
        return Spread(least=least, median=median, lower=lower, upper=upper, rounds=self.rounds)


def spread(values: Sequence[float]) -> Spread:
    """Return the spread of values, one per round."""
    least, lower, median, upper = np.percentile(values, (0.0, 25.0, 50.0, 75.0)).tolist()
    return Spread(least=least, median=median, lower=lower, upper=upper, rounds=len(values))


def take_turns(
    contestants: Mapping[Key, Work],
    rounds: int,
    progress: Callable[[float], object] = lambda done: None,
) -> dict[Key, Spread]:
    """Return the seconds of one call of each contestant, over rounds in which each has a turn.

    Each is called before all rounds. Quick work is also called before each turn, untimed, to refill
    the caches after the previous contestant. Python's garbage is collected only between rounds.
    `progress` is called before each round with the finished share.
    """
    calls = {key: _calls(work) for key, work in contestants.items()}
    times: dict[Key, list[float]] = {key: [] for key in contestants}
    enabled = gc.isenabled()
    try:
        for number in range(rounds):
            progress(number / rounds)
            gc.collect()
            gc.disable()
            for key, work in contestants.items():
                times[key].append(_turn(work, calls[key]))
            gc.enable()
    finally:
        (gc.enable if enabled else gc.disable)()
    return {key: spread(each) for key, each in times.items()}


def _calls(work: Work) -> int:
    """Return the number of warm calls in a turn."""
    return max(1, math.ceil(TURN / warmed(work)))


def warmed(work: Work, clock: Callable[[], float] | None = None) -> float:
    """Return the least time of several calls by a clock [s]: a first call may compile."""
    least, begin, clock = math.inf, perf_counter(), clock or perf_counter
    for _ in range(FIRST):
        before = clock()
        work()
        least = min(least, clock() - before)
        if perf_counter() - begin > PATIENCE:
            break
    return least


def _turn(work: Work, calls: int) -> float:
    if calls > 1:
        work()
    begin = perf_counter()
    for _ in range(calls):
        work()
    return (perf_counter() - begin) / calls
