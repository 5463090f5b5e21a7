"""The walk along a motion, sample by sample, with parts of the steps that fail.

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

        A step that fails is divided: the longest part that succeeds is followed, and the rest of
        the step is tried again.

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
    """The longest part of a step to go, of parts each half of the one before: one that was
    accepted, and its half too.

    Of so many parts one may be accepted by chance, at a pose of another assembly; two such are not
    halves of each other.
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
    """A part of a step that can be gone: the lane that goes it, and the time where it stands then;
    None where none can.

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
