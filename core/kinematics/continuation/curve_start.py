"""The beginning of a curve of poses: a curve is closed if it passes its beginning again, in the
same direction.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...trajectory import Array
from .pseudo_arclength import ArclengthWalk, Spot

# The cosine of two directions above which they are the same way: below it the curve crosses itself.
SAME_WAY = 0.9
# Two poses are one if no number differs by more than this part of the longest step: far above
# rounding.
SAME_POSE = 0.02
# Length over which the direction of the beginning is measured, and rounds of the secant rule that
# look for it.
SMALL, ROUNDS = 1e-6, 8


class Beginning:
    """The first spot of a walk, and the plane across the curve there."""

    def __init__(self, walk: ArclengthWalk, first: Spot, longest: float) -> None:
        self.walk, self.first, self.longest = walk, first, longest
        self._poses = walk.system.poses(first.state)
        after = walk.system.poses(walk.system.stepped(first.state, SMALL * first.dq[:, None]))
        self._way = (after - self._poses) / SMALL

    def passed(self, before: Spot, after: Spot) -> Spot | None:
        """Return the beginning as a spot at its length on the curve if the step between two spots
        passes it, else None.
        """
        if float(self.first.dq @ after.dq) < SAME_WAY:
            return None
        change, change_after = self._change(before), self._change(after)
        ahead, beyond = self._along(change), -self._along(change_after)
        if not (ahead > 0.0 <= beyond and np.abs(change_after).max() <= 2.0 * self.longest):
            return None
        share = ahead / (ahead + beyond)
        spot: Spot | None = None
        h, apart = (
            share * (after.arc - before.arc),
            np.abs((1.0 - share) * change + share * change_after).max(),
        )
        for _ in range(ROUNDS):
            spot = self.walk.advance(before, h)
            # beside a branch point: where it is between the two spots is known well enough
            if spot is None:
                break
            change = self._change(spot)
            gap, apart = self._along(change), np.abs(change).max()
            h += gap
            if abs(gap) <= SMALL * SMALL:
                break
        if apart > SAME_POSE * self.longest:
            return None
        turned = before.time + share * (after.time - before.time) if spot is None else spot.time
        return replace(self.first, arc=before.arc + h, time=turned)

    def _change(self, spot: Spot) -> Array:
        """Return the change from the pose of a spot to the beginning; Euler parameters p and -p are
        the same.
        """
        there = self.walk.system.poses(spot.state)
        there[:, 3:] *= np.where(
            (there[:, 3:] * self._poses[:, 3:]).sum(axis=1, keepdims=True) < 0.0, -1.0, 1.0
        )
        return self._poses - there

    def _along(self, change: Array) -> float:
        """Return the length of a change along the curve, to first order."""
        return float((change * self._way).sum() / (self._way * self._way).sum())
