"""Where a motion of a sparse system stands, and when Newton's iteration for the next pose may end."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array
from ..continuity import STEEPEST

# An iteration with old factors costs half of one with new ones; it is worth it where it gains two digits.
CONTRACTS = 1e-2
# Residuals below this, some round-offs in rows of size one, are as small as they get; elsewhere an iteration that gains less than
# a digit though its factors are new shows that they are.
SETTLED, STALLS = 1e-15, 0.1


@dataclass(frozen=True, eq=False)
class Stand:
    """Where a motion stands.

    Attributes:
        time: of the pose; earlier: of the one before it, the same where there is none.
        state, predicted: the pose, and what a Taylor step made of the one before; see `Numbering`.
        rates, accelerations: of the unknowns.
        closure, leftover, branch: largest residual of the rows solved and of the redundant ones, smallest branch test.
        sigmas: of the blocks (`Blocks.sigmas`), where there are more rows than are solved.
        pivot: size of the smallest; largest_pivot: the largest that it was so far; orientation: see `Blocks`.
    """

    time: float
    earlier: float
    state: Array
    predicted: Array
    rates: Array
    accelerations: Array
    iterations: int = 0
    closure: float = 0.0
    leftover: float = 0.0
    branch: float = 1.0
    pivot: float = 0.0
    largest_pivot: float = 0.0
    orientation: bytes = b""
    sigmas: Array = field(default_factory=lambda: np.zeros(0))


def regular_between(sigmas: Array, sigmas_before: Array, moved: Array) -> NDArray[np.bool_]:
    """Whether no block can have been singular on the way, shape (poses,). The signs of determinants do not say so where rows are
    chosen from more: they change by the choice too.
    """
    return np.all(sigmas + sigmas_before > STEEPEST * moved[:, None], axis=1)


def distance(change: Array, scale: Array) -> Array:
    """The largest of a change of the state, each number measured by its scale; of several poses of each."""
    return np.abs(change.T * scale).max(axis=-1)
