"""One motion followed with numpy: all samples at once, as far as lanes suffice."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..trajectory import Array
from .executor_protocol import Side
from .numpy_lanes import NumpyLanes
from .plan import MARGIN


def _leading(margins: Array) -> int:
    """Return the number of accepted lanes before the first rejected one."""
    good = margins > 0.0
    return len(good) if good.all() else int(good.argmin())


class NumpyTrack:
    """See `Track`."""

    def __init__(self, executor: NumpyLanes, sides: Sequence[Side], start: Array, n: int) -> None:
        self._executor, self._sides, self._start, self._n = executor, sides, start, n
        self.anchors = np.tile(start, (len(sides), 1))

    def begin(self) -> Array:
        """See `Track`."""
        plan = self._executor.plan
        self.worst = np.repeat([0.0, np.inf], [len(plan.largest), len(plan.smallest)])
        self._kept = np.empty((len(plan.kept), self._n))
        return self._kept

    def run(self) -> Sequence[int]:
        """See `Track`. Both sides share one attempt: a numpy call takes longer than its numbers."""
        executor, counts = self._executor, [side.count for side in self._sides]
        if sum(counts) > executor.lanes:
            return [self.follow(k, 0, count, anew=True) for k, count in enumerate(counts)]
        plan, block = executor.plan, executor.block
        source, target = np.array(plan.carried).T
        ends = np.cumsum(counts)
        block[target] = self._start[:, None]
        for side, end in zip(self._sides, ends, strict=True):
            block[list(plan.sampled), end - side.count :] = side.samples[:, -1:]
            block[list(plan.sampled), end - side.count : end] = side.samples
        executor.heads[:] = [0, *ends[:-1]]
        try:
            executor.settle("predict", plan.joined)
        finally:  # after an interrupt the executor is used again
            executor.heads[:] = [0]
        lanes = [block[:, end - count : end] for count, end in zip(counts, ends, strict=True)]
        reached = [_leading(each[plan.slots[MARGIN]]) for each in lanes]
        for side, each, accepted in zip(self._sides, lanes, reached, strict=True):
            if accepted:
                self._keep(side, 0, each[:, :accepted])
        if reached == counts:
            return counts
        for name in plan.remaining:
            executor.run(name)
        for anchor, each, accepted in zip(self.anchors, lanes, reached, strict=True):
            anchor[:] = each[source, accepted - 1] if accepted else self._start
        return [
            self.follow(k, at, count, anew=False) if 0 < at < count else at
            for k, (at, count) in enumerate(zip(reached, counts, strict=True))
        ]

    def follow(self, side: int, at: int, stop: int, *, anew: bool) -> int:
        """See `Track`."""
        executor, samples = self._executor, self._sides[side].samples
        plan, block, lanes = executor.plan, executor.block, executor.lanes
        extrapolates = plan.extrapolates(lanes)
        carried, moved = (
            np.array(each).T
            for each in (plan.carried, plan.moved if extrapolates else plan.carried)
        )
        sampled, smooth, whole = list(plan.sampled), False, False
        block[carried[1]] = (self._start if anew else self.anchors[side])[:, None]
        while at < stop:
            # extrapolation needs groups that begin at a multiple of the lanes: a shorter group
            # goes up to there
            count = min(lanes - at % lanes if whole and extrapolates else lanes, stop - at)
            block[sampled, :count] = samples[:, at : at + count]
            block[sampled, count:] = samples[:, stop - 1 : stop]
            executor.settle("extrapolate" if smooth else "predict", plan.joined)
            accepted = _leading(block[plan.slots[MARGIN], :count])
            if accepted:
                self._keep(self._sides[side], at, block[:, :accepted])
            elif smooth:  # continue from the last accepted sample by its rates
                executor.go_back(samples[:, at - 1 : at])
            else:
                break
            whole = accepted == lanes
            smooth = extrapolates and whole and at % lanes == 0 and at + accepted < stop
            for name in () if smooth or not accepted else plan.remaining:
                executor.run(name)
            source, target = moved if smooth else carried
            block[target] = block[source, max(accepted - 1, 0), None]
            at += accepted
        self.anchors[side] = block[carried[1], 0]
        return at

    def _keep(self, side: Side, at: int, found: Array) -> None:
        plan = self._executor.plan
        self._kept[:, side.first + side.step * np.arange(at, at + found.shape[1])] = found[
            list(plan.kept)
        ]
        largest, smallest = np.split(self.worst, [len(plan.largest)])
        np.maximum(largest, found[list(plan.largest)].max(axis=1), out=largest)
        np.minimum(smallest, found[list(plan.smallest)].min(axis=1), out=smallest)
