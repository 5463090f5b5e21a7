"""The walk along a motion, sample by sample, with parts of failed steps.

The compiled solver, the solver by components and the sparse solver share it. Each predicts, solves
and accepts poses in its own way: many samples in a call, all components at once, or a sparse
system.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np

from ...failures import MOST_PARTS, FailureKind, PoseFailure
from ...trajectory import Array

# A failing step is tried at its halves, quarters, ... down to this many halvings, and so many at
# once: to 1e-12 of it, for a crank that passes within 1e-9 of its length beside a pivot turns its
# rocker by half a turn over such a part of a sweep.
HALVINGS, AT_ONCE = 40, 8
# The next part is looked for among those up to so many times as long as the last: towards a limit
# they get shorter and shorter.
LONGER = 8.0


class Walk(ABC):
    """A walk over samples in their order, each from the pose before."""

    @abstractmethod
    def follow(self, at: int, stop: int, parts: int) -> int:
        """Follow samples as far as each continues the motion; return the number passed.

        Args:
            at: number passed so far.
            stop: number to pass.
            parts: number of parts taken of the step to the next sample.
        """

    @abstractmethod
    def follow_part(self, at: int) -> PoseFailure | None:
        """Follow a part of the step to the next sample; return the failure if no part succeeds."""

    def advance(self, at: int, stop: int) -> tuple[int, PoseFailure | None]:
        """Follow samples to the last one, or to the first one out of reach.

        A failed step is divided: the longest successful part is followed, and the rest of the step
        is tried again.

        Returns:
            The number of samples passed, and the failure if it is not `stop`.
        """
        parts = 0
        while at < stop:
            passed = self.follow(at, stop, parts)
            if passed > at:
                at, parts = passed, 0
                continue
            if parts == MOST_PARTS:
                return at, PoseFailure(FailureKind.TOO_MANY_PARTS)
            failure = self.follow_part(at)
            if failure is not None:
                return at, failure
            parts += 1
        return at, None


def longest(margins: Array) -> int | None:
    """Return the longest part of a step, of parts each half of the one before, with both it and its
    half accepted; None without one.

    One of many parts may be accepted by chance, at a pose of another assembly; two such parts are
    not halves of each other.
    """
    good = np.flatnonzero((margins[:-1] > 0.0) & (margins[1:] > 0.0))
    return int(good[0]) if len(good) else None


def part_of_step(
    here: float,
    wanted: float,
    attempt: Callable[[Array], Array],
    lanes: int,
    length: float = math.inf,
) -> tuple[int, float] | None:
    """Return a part of a step: the lane that reaches it, and its end time; None without one.

    Args:
        attempt: sends as many lanes to as many times, longest part first; returns their margins.
        length: of the longest part to try [s].
    """
    whole = wanted - here
    start = max(1, math.ceil(math.log2(abs(whole) / length))) if 0.0 < length < abs(whole) else 1
    for first in range(start, HALVINGS, lanes - 1):  # a part counts if its half is reached too
        times: Array = here + whole * 0.5 ** np.arange(float(first), first + lanes)
        part = longest(attempt(times)[: HALVINGS + 1 - first])
        if part is not None:
            return part, float(times[part])
    return None
