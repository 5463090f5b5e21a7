"""State of a motion of a sparse system, and the acceptance of its next poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...program import before, maximum
from ...trajectory import Array
from ..compiled.predictor import ABOUT
from ..compiled.request import CONSISTENT
from ..formulation.acceptance_criteria import TURNED_BY_PIVOTS, WORSE_BY_PIVOTS
from ..formulation.margins import (
    Block,
    Candidate,
    Limits,
    known_slope,
    least_slope,
    margins,
    slope_between,
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
    """A pose of the motion with its rates and tests.

    Attributes:
        time: of the pose; earlier: of the previous pose, the same without one.
        state, predicted: the pose, and the Taylor step to it from the previous pose; see
            `Numbering`.
        rates, accelerations: of the unknowns.
        turns: angles of turning drivers [rad from the design].
        closure, leftover, branch: largest residual of the solved and of the redundant rows,
            smallest branch test.
        pivot: smallest size; largest_pivot: its largest value so far; orientation: see `Blocks`.
        sigmas: of the blocks (`Blocks.sigmas`); the smallest pivot if all rows are solved, which
            keep the signs of their determinants; slopes: their change by the pose, zero if unknown;
            high: the largest value of each since the last choice of rows.
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
    """Candidates for the next poses, each reached from the one before it; shape (poses,) each.

    Attributes:
        done: whether Newton's iteration ended.
        closure, leftover, branch: see `Stand`.
        gap: distance from the Taylor step of the previous pose; step: from the previous pose; turn:
            largest change of a driver's angle from there.
        pivot: see `Stand`; chosen: whether pivots were chosen at each pose.
        turned: whether the orientation differs.
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
        """Return whether each pose meets each criterion, by the names of `margins`, shape (poses,).

        The limits are narrower than those of compiled programs, because pivots bound sigma less
        sharply than estimates do.

        Args:
            here: the pose before the first one.
            tol: largest accepted residual.
        """
        poses = len(self.done)
        with np.errstate(all="ignore"):
            found = margins(self._candidate(here), _limits(tol))
        return {
            name: (margin > 0.0).reshape(-1, poses).all(axis=0) for name, margin in found.items()
        }

    def _candidate(self, here: Stand) -> Candidate:
        """Return the poses as one candidate; arrays of blocks have shape (blocks, poses)."""
        sigmas = self.sigmas.T
        least = np.minimum(self.pivot, sigmas.min(axis=0, initial=np.inf))
        # SuperLU's exchange of rows makes pivots jump tenfold: their increase is no sign of a
        # motion away from a singular pose
        falls = min(here.pivot, here.sigmas.min(initial=np.inf)) if self.chosen else -np.inf
        return Candidate(
            done=self.done.astype(float),
            closure=self.closure,
            leftover=self.leftover,
            branch=self.branch,
            gap=self.gap,
            moved=self.step,
            reach=self.step,
            turns=[self.turn],
            sigma=least,
            before=falls,
            largest=np.maximum(self.pivot, here.largest_pivot),
            # signs of determinants change with the choice of rows too, so they do not replace the
            # test of sigma
            reversal=self.turned.astype(float),
            blocks=[Block(sigmas, before(sigmas, here.sigmas), np.maximum(*self._slopes(here)))],
        )

    def remembered(self, here: Stand) -> list[tuple[Array, Array, Array]]:
        """Return sigmas, slopes and high of each pose, see `Stand`."""
        slopes, _ = self._slopes(here)
        high = np.maximum.accumulate(np.vstack([here.high, self.sigmas]))[1:]
        return [*zip(self.sigmas, slopes.T, high, strict=True)]

    def _slopes(self, here: Stand) -> tuple[Array, Array]:
        """Return the slopes of sigmas at each pose, and those known before it, shape (blocks,
        poses) each.
        """
        sigmas, slope = self.sigmas.T, known_slope(here.slopes)
        with np.errstate(all="ignore"):
            found = slope_between(sigmas, before(sigmas, here.sigmas), self.step)
        least = least_slope(slope)[:, None]
        return maximum(found, least), maximum(before(found, slope), least)


def _limits(tol: float) -> Limits:
    return Limits(tol, max(CONSISTENT, tol), 0.0, worse=WORSE_BY_PIVOTS, turned=TURNED_BY_PIVOTS)


def lacked(h: Array, before: float) -> Array:
    """Return the growth of the error of the last Taylor step for other steps: the cube of their
    ratio, if they are not much longer.
    """
    return np.where(ABOUT * abs(before) > np.abs(h), (h / (before or 1.0)) ** 3, 0.0)


def distance(change: Array, scale: Array) -> Array:
    """The largest of a change of the state, each number measured by its scale; of several poses of
    each.
    """
    return np.abs(change.T * scale).max(axis=-1)
