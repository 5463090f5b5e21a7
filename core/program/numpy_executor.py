"""Execution of plans with numpy: no start-up cost; the oracle of the tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Array
from .executor_protocol import Parts, Side
from .numpy_lanes import NumpyLanes
from .numpy_track import NumpyTrack
from .plan import MARGIN
from .tape import NODES


class NumpyExecutor(NumpyLanes):
    """Loops over the lanes of a plan; see `Executor`."""

    def track(self, sides: Sequence[Side], start: Array, n: int) -> NumpyTrack:
        """See `Executor`."""
        return NumpyTrack(self, sides, start, n)

    @property
    def room(self) -> int:
        """See `Executor`."""
        return self.lanes

    def table(self, columns: int) -> Array:
        """See `Executor`."""
        return np.empty((len(self.plan.kept), columns, self.room))

    def fan(self, samples: Array, out: Array, worst: Array, first: int, step: int) -> None:
        """See `Executor`."""
        plan, block = self.plan, self.block
        kept, remembered = list(plan.kept), list(plan.remembered)
        source, target = np.array(plan.carried_on).T
        past = block[plan.past : plan.past + NODES * len(remembered)].reshape(NODES, -1, self.lanes)
        alive = np.ones(self.lanes, dtype=np.bool_)
        for k, sample in enumerate(samples.T):
            accepted = self._accepted("extend", sample) if k >= NODES else ~alive
            if (alive & ~accepted).any():
                if k >= NODES:
                    self.go_back(samples[:, k - 1, None])
                    self.carry()
                accepted = self._accepted("predict", sample)
            alive &= accepted
            out[:, first + step * k] = np.where(alive, block[kept], np.nan)
            self._worsen(worst)
            past[k % NODES] = block[remembered]
            if k + 1 < NODES:
                for name in plan.remaining:
                    self.run(name)
                self.carry()
            else:
                block[target] = block[source]
        worst[:, ~alive] = np.nan

    def _worsen(self, worst: Array) -> None:
        largest, smallest = np.split(worst, [len(self.plan.largest)])
        np.maximum(largest, self.block[list(self.plan.largest)], out=largest)
        np.minimum(smallest, self.block[list(self.plan.smallest)], out=smallest)

    def _accepted(self, start: str, sample: Array) -> NDArray[np.bool_]:
        self.block[list(self.plan.sampled)] = sample[:, None]
        self.settle(start, self.plan.alone)
        return self.block[self.plan.slots[MARGIN]] > 0.0

    def fold(self, table: Array, totals: Array) -> None:
        """See `Executor`."""
        plan, block = self.plan, self.block
        for column, row in enumerate(table):
            block[list(plan.kept)] = totals[:, column]
            for some in row.reshape(-1, len(plan.taken), self.group):
                block[list(plan.taken)] = some
                for name in plan.after:
                    self.run(name)
            totals[:, column] = block[list(plan.kept)]

    def groups(self, lanes: int) -> int:
        """See `Executor`; always one, because programs are bound to all lanes."""
        return 1

    def parts(self, parts: Parts) -> Callable[[int], object]:
        """See `Executor`."""
        plan, block = self.plan, self.block

        def call(groups: int) -> None:
            for member, sources in zip(parts.members.tolist(), parts.taken, strict=True):
                block[list(plan.fixed)] = parts.fixed[member, :, None]
                block[list(plan.sampled)] = parts.samples
                block[list(plan.taken)] = parts.world[sources]
                self.attempt()
                row = parts.base + member * len(plan.kept)
                parts.world[row : row + len(plan.kept)] = block[list(plan.kept)]
                self._worsen(parts.worst)
                for slot, k in plan.left:
                    parts.ahead[member, k] = block[slot, -1]

        return call
