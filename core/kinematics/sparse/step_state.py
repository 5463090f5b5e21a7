"""Where a motion of a sparse system stands, when Newton's iteration for the next pose may end, and
whether that is believed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array
from ..compiled.predictor import ABOUT
from ..compiled.request import CONSISTENT
from ..formulation.acceptance_criteria import (
    EPSILON,
    FALLS,
    FOLLOWED,
    LARGEST_CORRECTION,
    LARGEST_RATIO,
    LONGEST_STEP,
    LONGEST_TURN,
    NEGLIGIBLE,
    STEEPER,
    STEEPEST,
    TURNED_BY_PIVOTS,
    WORSE_BY_PIVOTS,
)

# An iteration with old factors costs half of one with new ones; it is worth it where it gains two
# digits.
CONTRACTS = 1e-2
# Residuals below this, some round-offs in rows of size one, are as small as they get; elsewhere an
# iteration that gains less than a digit though its factors are new shows that they are.
SETTLED, STALLS = 1e-15, 0.1


def _none() -> Array:
    return np.zeros(0)


@dataclass(frozen=True, eq=False)
class Stand:
    """Where a motion stands.

    Attributes:
        time: of the pose; earlier: of the one before it, the same where there is none.
        state, predicted: the pose, and what a Taylor step made of the one before; see `Numbering`.
        rates, accelerations: of the unknowns.
        turns: angles of the drivers that turn [rad from the design].
        closure, leftover, branch: largest residual of the rows solved and of the redundant ones,
            smallest branch test.
        pivot: size of the smallest; largest_pivot: the largest that it was so far; orientation: see
            `Blocks`.
        sigmas: of the blocks (`Blocks.sigmas`); where all rows are solved, which keep the signs of
            their determinants, the smallest pivot stands for all; slopes: how steeply they change,
            zero where nothing is known of that; high: the largest that each was since rows were
            last looked for.
    """

    time: float
    earlier: float
    state: Array
    predicted: Array
    rates: Array
    accelerations: Array
    turns: Array = field(default_factory=_none)
    iterations: int = 0
    closure: float = 0.0
    leftover: float = 0.0
    branch: float = 1.0
    pivot: float = 0.0
    largest_pivot: float = 0.0
    orientation: bytes = b""
    sigmas: Array = field(default_factory=_none)
    slopes: Array = field(default_factory=_none)
    high: Array = field(default_factory=_none)


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses that a motion may have come to, each by the one before it, and what the tests of them
    are of; shape (poses,) each.

    Attributes:
        done: whether Newton's iteration ended.
        closure, leftover, branch: see `Stand`.
        gap: to what a Taylor step made of the pose before; step: to that; turn: of a driver from
            there, the largest.
        pivot: see `Stand`; chosen: whether pivots were chosen at each pose.
        turned: whether the orientation is another.
        sigmas: shape (poses, blocks).
    """

    done: NDArray[np.bool_]
    closure: Array
    leftover: Array
    branch: Array
    gap: Array
    step: Array
    turn: Array
    pivot: Array
    chosen: bool
    turned: NDArray[np.bool_]
    sigmas: Array

    def passed(self, here: Stand, tol: float) -> Mapping[str, NDArray[np.bool_]]:
        """Which passed each test of a solution, by the names of `acceptance.margins`; less is known
        here, and more asked of it.

        Args:
            here: where the first of them is predicted from.
            tol: largest accepted residual.
        """
        largest = np.maximum(self.pivot, here.largest_pivot)
        uncertain = (WORSE_BY_PIVOTS * largest) * np.maximum(self.closure, EPSILON)
        least = np.minimum(self.pivot, self.sigmas.min(axis=1, initial=np.inf))
        # where SuperLU exchanges rows its pivots jump tenfold: their change is not held to
        falls = self.chosen & (least < min(here.pivot, here.sigmas.min(initial=np.inf)))
        before, known = np.vstack([here.sigmas, self.sigmas[:-1]]), np.maximum(*self._slopes(here))
        steepest = np.minimum(STEEPER * known, STEEPEST)
        ratio = np.maximum(self.sigmas, before) < LARGEST_RATIO * np.minimum(self.sigmas, before)
        return {
            "converged": self.done,
            "closed": self.closure <= tol,
            "consistent": self.leftover <= max(CONSISTENT, tol),
            "on the branch": self.branch > 0.0,
            "continued": self.gap <= LARGEST_CORRECTION * self.step + NEGLIGIBLE,
            "near": self.step <= LONGEST_STEP,
            "not turned round": self.turn <= LONGEST_TURN,
            "as regular": np.all(ratio, axis=1),
            "on this side": ~self.turned,
            # the signs of determinants do not say so where rows are chosen from more: they change
            # by the choice too
            "regular between": np.all(self.sigmas + before > steepest * self.step[:, None], axis=1),
            "certain": FOLLOWED * least**2 > uncertain,
            "not turned by rounding": (TURNED_BY_PIVOTS * least**2 > uncertain) | falls,
        }

    def remembered(self, here: Stand) -> list[tuple[Array, Array, Array]]:
        """Of each pose sigmas, slopes and high, as of `Stand`."""
        slopes, _ = self._slopes(here)
        high = np.maximum.accumulate(np.vstack([here.high, self.sigmas]))[1:]
        return [*zip(self.sigmas, slopes, high, strict=True)]

    def _slopes(self, here: Stand) -> tuple[Array, Array]:
        """How steeply sigmas change at each pose, and what was known of that before; shape (poses,
        blocks) each.
        """
        before = np.vstack([here.sigmas, self.sigmas[:-1]])
        change, moved = np.abs(self.sigmas - before), self.step[:, None]
        found = np.divide(change, moved, out=np.zeros_like(change), where=moved > NEGLIGIBLE)
        slopes = np.where(here.slopes > 0.0, here.slopes, STEEPEST)
        least = np.maximum(FALLS * slopes, EPSILON)
        return np.maximum(found, least), np.maximum(np.vstack([slopes, found[:-1]]), least)


def lacked(h: Array, before: float) -> Array:
    """By how much what a Taylor step lacked grows from the last step to others: by the cube, where
    they are not much longer.
    """
    return np.where(ABOUT * abs(before) > np.abs(h), (h / (before or 1.0)) ** 3, 0.0)


def distance(change: Array, scale: Array) -> Array:
    """The largest of a change of the state, each number measured by its scale; of several poses of
    each.
    """
    return np.abs(change.T * scale).max(axis=-1)
