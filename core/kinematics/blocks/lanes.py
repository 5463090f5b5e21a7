"""The blocks of a mechanism bound to lanes, one sample a lane, as the walk sees them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...failures import PoseFailure
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...program import MARGIN
from ...trajectory import Array
from ..compiled.request import SIGMA, Request, accept_by
from ..compiled.sample_rows import LARGEST_OF_PARTS, SMALLEST_OF_PARTS
from ..continuation.singular_crossing import Numbers
from ..formulation.acceptance_criteria import EPSILON, WORSE

WORST = (*LARGEST_OF_PARTS, *SMALLEST_OF_PARTS)
"""Tests of which the worst of all blocks is known."""
CLOSURES, SIGMAS, MARGINS = (WORST.index(name) for name in ("closure", SIGMA, MARGIN))
"""Rows of those."""
Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Anchor:
    """The pose before the lanes, to be restored later.

    Attributes:
        time: of the pose [s].
        pose: of all blocks, as the lanes keep it.
        motions: the wanted motions there, shape (columns,); none if they were not taken along.
        error: a bound of its error by its tests [units].
    """

    time: float
    pose: Any
    _numbers: Callable[[Any], Numbers]
    motions: Array = field(default_factory=lambda: np.empty(0))
    error: float = 0.0

    @property
    def numbers(self) -> Numbers:
        """The numbers of all blocks."""
        return self._numbers(self.pose)


class Lanes(ABC):
    """Blocks bound to lanes; all lanes are predicted from one pose, the last one accepted by every
    block.

    Attributes:
        mechanism, request: what is bound, and the wanted motions.
        unit: length unit of the residuals [m].
        details: the blocks as the record of every solution shows them.
        design: the design position.
        many: number of lanes.
        worst: the worst tests of all blocks, shape (WORST, room).
        last: the lane of the last time of the last attempt.
    """

    mechanism: Mechanism
    request: Request
    unit: float
    details: Mapping[str, Any]
    design: Anchor
    many: int
    worst: Array
    last: int = 0

    def attempt(self, times: Array, path: Path) -> Array:
        """Solve all blocks at times, up to the number of lanes, each lane alone; return the margin
        of each time, positive if accepted.
        """
        return self.attempt_at(self.sampled(times, path))

    def accept(self, tol: float, *, crossing: bool = False) -> None:
        """Set the tolerance, and whether a singular pose may be crossed."""
        self.accept_by(accept_by(tol, crossing=crossing))

    def begin(self) -> None:
        """Forget the findings of before."""
        return

    @abstractmethod
    def accept_by(self, limits: Mapping[str, float]) -> None:
        """Set the numbers of `ACCEPT`."""

    @abstractmethod
    def depart(self, time: float, path: Path) -> PoseFailure | None:
        """Stand at a time of a path with the rates there, with no step behind."""

    @abstractmethod
    def anchor(self, time: float) -> Anchor:
        """Return the pose before the lanes, at a time."""

    def taken(self, time: float) -> Anchor:
        """Return the pose that was carried from the first lane, with its motions."""
        closure, sigma = (float(self.worst[row, 0]) for row in (CLOSURES, SIGMAS))
        error = WORSE * max(closure, EPSILON) / sigma
        return replace(self.anchor(time), motions=self.motions(1)[:, 0], error=error)

    @abstractmethod
    def restore(self, anchor: Anchor) -> None:
        """Set the pose before the lanes."""

    @abstractmethod
    def sampled(self, times: Array, path: Path) -> list[Array]:
        """Return the inputs at times, tables of shape (numbers, times)."""

    @abstractmethod
    def attempt_at(self, tables: Sequence[Array], *, neighbours: bool = False) -> Array:
        """Attempt all blocks as `attempt` does, with tables from `sampled`.

        Args:
            neighbours: the times are neighbours on the way.
        """

    @abstractmethod
    def carry(self, lane: int) -> None:
        """Predict from a solved lane from now on, whichever it is."""

    def go_on(self) -> None:
        """Predict from the last lane from now on."""
        self.carry(self.last)

    @abstractmethod
    def motions(self, count: int) -> Array:
        """Return the wanted motions of the first lanes, shape (columns, count)."""

    @abstractmethod
    def uncertain(self, count: int, path: Path) -> Mapping[int, float]:
        """Return which of the first lanes are left uncertain by their residuals, and a bound of the
        error of each.
        """

    @property
    def findings(self) -> Mapping[str, Any]:
        """What the record of a solution says beside the tests, since `begin`."""
        return {}

    @property
    @abstractmethod
    def sound(self) -> bool:
        """Whether no block is nearly singular at the pose before the lanes."""

    @abstractmethod
    def failure(self, tol: float) -> PoseFailure:
        """Return the failure of the last lane."""
