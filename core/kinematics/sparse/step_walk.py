"""The walk of a sparse system to one sample."""

from __future__ import annotations

from collections.abc import Callable
from math import log2

from ...failures import PoseFailure
from ..continuation.step_halving import HALVINGS, LONGER, Walk
from .sparse_equations import PoseError
from .step_state import Stand

LONGER_BY = int(log2(LONGER))


class StepWalk(Walk):
    """The walk from the present pose of the motion to a time.

    Args:
        here: the present pose.
        time: of the sample [s].
        reach: goes from a pose to a time, or raises PoseError.
        improve: changes to better rows at a pose, or raises PoseError.

    Attributes:
        here: the present pose, updated by the walk.
    """

    def __init__(
        self,
        here: Stand,
        time: float,
        reach: Callable[[Stand, float], Stand],
        improve: Callable[[Stand], Stand],
    ) -> None:
        self.here, self.time, self.reach, self.improve = here, time, reach, improve
        self._halvings = 1

    def follow(self, at: int, stop: int, parts: int) -> int:
        """Follow the step, or the rest of it."""
        try:
            self.here = self.reach(self.here, self.time)
        except PoseError:
            return at
        return stop

    def follow_part(self, at: int) -> PoseFailure | None:
        """Follow the longest successful part, and change to better rows there."""
        try:
            self.here = self.improve(self._part())
        except PoseError as error:
            return error.failure
        return None

    def _part(self) -> Stand:
        """Return the end of the longest part that succeeds along with its half (see `longest`).

        As in `part_of_step` the search begins at `LONGER` times the last part: towards a limit
        parts get shorter and shorter, and failed attempts cost most.

        Raises:
            PoseError: no part succeeds.
        """
        here, last, longer = self.here, None, None
        for k in range(self._halvings, HALVINGS + 1):
            try:
                found = self.reach(here, here.time + (self.time - here.time) * 0.5**k)
            except PoseError as error:
                last, longer = error, None
                continue
            if longer is not None:
                self._halvings = max(1, k - 1 - LONGER_BY)
                return longer
            longer = found
        assert last is not None  # no two parts in a row succeeded
        raise last
