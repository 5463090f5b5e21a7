"""The walk of a cascade along samples: many at once, on from the last one accepted by every
component.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ...failures import FailureKind, PoseFailure
from ...mechanism.motions import Path
from ...trajectory import Array
from ..compiled.request import SIGMA
from ..continuation.step_halving import Walk, part_of_step
from .component_lanes import Lanes

# Samples at once: all are predicted from one pose, and the farther they are from it the more
# iterations they take, and the more are tried in vain; and what a large chain takes its time for is
# memory: with 24 one of 200 loops takes up to 1.6 times as long. With 8 one of 16 loops takes 1.3
# times as long.
LANES = 16

Indices = NDArray[np.intp]
Keep = Callable[[Indices], None]
"""Takes samples, by their number outwards, from as many lanes."""


class ComponentWalk(Walk):
    """The walk over samples of a path, from the pose before the lanes.

    Args:
        samples: numbers of the samples, in their order.
        times: of all samples [s].
        given: tables of all samples, see `Lanes.sampled`.
        time: of that pose [s].
        tol: largest accepted residual.

    Attributes:
        time: of the pose before the lanes [s].
        sound, start: the last sound pose before the lanes, and its time.
    """

    def __init__(
        self,
        lanes: Lanes,
        samples: Indices,
        times: Array,
        given: Sequence[Array],
        path: Path,
        keep: Keep,
        *,
        time: float,
        tol: float,
    ) -> None:
        self.lanes, self.samples, self.times, self.given = lanes, samples, times, given
        self.path, self.keep, self.time, self.tol = path, keep, time, tol
        self.sound, self.start = lanes.anchor, time

    def run(self) -> tuple[int, PoseFailure | None]:
        """Follow all samples; see `advance`."""
        return self.advance(0, len(self.samples))

    def follow(self, at: int, stop: int, parts: int) -> int:
        """Follow as many samples at once as there are lanes, up to the first failure."""
        lanes, ahead = self.lanes, self.samples[at : min(at + LANES, stop)]
        good = lanes.attempt_at([each[:, ahead] for each in self.given]) > 0.0
        accepted = len(ahead) if good.all() else int(good.argmin())
        if not accepted:
            if lanes.sound:
                self.sound, self.start = lanes.anchor, self.time
            return at
        self.keep(ahead[:accepted])
        if accepted == len(ahead):
            lanes.go_on()
        else:
            lanes.carry(accepted - 1)
        self.time = float(self.times[ahead[accepted - 1]])
        return at + accepted

    def follow_part(self, at: int) -> PoseFailure | None:
        """Follow the longest accepted part."""
        reached = part_of_step(
            self.time,
            float(self.times[self.samples[at]]),
            lambda times: self.lanes.attempt(times, self.path),
            LANES,
        )
        if reached is None:
            return self._failure()
        lane, self.time = reached
        self.lanes.carry(lane)
        return None

    def _failure(self) -> PoseFailure:
        """Return the failure of the shortest part: its unsolved component, or the one nearest to
        singular.
        """
        lanes, cascade = self.lanes, self.lanes.cascade
        closure, sigma = (lanes.each(name)[:, lanes.last] for name in ("closure", SIGMA))
        closes = bool((closure <= self.tol).all())
        worst = int(np.nanargmin(sigma) if closes else np.nan_to_num(closure, nan=np.inf).argmax())
        order = [part for kind in cascade.kinds for part in kind.members]
        return PoseFailure(
            FailureKind.SINGULAR_AHEAD if closes else FailureKind.NOT_CONVERGED,
            closure[worst],
            self.tol,
            sigma=sigma[worst],
            where=f"the component of {', '.join(cascade.parts[order[worst]].bodies)}: ",
        )
