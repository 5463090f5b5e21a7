"""The least move of a design to bring its outputs into bands.

With u the moves over their boxes, and g(u) the outputs over their bands, -1 to 1 within:

    minimise |u|^2  such that  -1 <= g(u) <= 1,  low <= u <= high.

A round linearises g by its exact slopes, inside a region of trust. A linear programme tells by how
much the linear bands must be exceeded, t. The move of least norm that exceeds them by t is then a
least distance programme (Lawson and Hanson 1974, chapter 23), which non-negative least squares
solve. Their multipliers tell what a wider band is worth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.optimize  # pyright: ignore[reportMissingTypeStubs]

from ...trajectory import Array

Bands = Callable[[Array], tuple[Array, Array] | None]
"""Outputs over their bands, shape (numbers,), and their slopes by the moves over their boxes, shape
(numbers, moves); None if a sample is not reached.
"""

HELD = 1e-7
"""A band is held up to this share of its half-width: the rounding of an ill-conditioned design."""
ROUNDS = 80
_optimize: Any = scipy.optimize
_END = 1e-12
_LEAST_TRUST = 1e-9
# A bound that is exceeded weighs at least so much against the norm, which is of size one.
_WEIGHT = 1e3


@dataclass(frozen=True, eq=False)
class LeastMove:
    """The end of a search.

    Attributes:
        moves: over their boxes, shape (moves,).
        numbers: how far each is from the middle of its band, over the half-width.
        multipliers: by how much the norm falls, if each band becomes wider by its half-width, shape
            (numbers,).
        rounds: of linearisation.
    """

    moves: Array
    numbers: Array
    multipliers: Array
    rounds: int

    @property
    def excess(self) -> float:
        """How far the worst number is beyond its band, over the half-width; not positive if all
        bands are held.
        """
        return float(self.numbers.max()) - 1.0

    @property
    def norm(self) -> float:
        """The root of the sum of squares of the moves over their boxes."""
        return float(np.linalg.norm(self.moves))

    @property
    def held(self) -> bool:
        """Whether all bands are held."""
        return self.excess <= HELD

    @property
    def order(self) -> tuple[bool, float]:
        """The better search comes first: bands held, then the norm, else the smaller excess."""
        return (False, self.norm) if self.held else (True, self.excess)


def least_move(bands: Bands, start: Array, low: Array, high: Array) -> LeastMove | None:
    """Return where the search from a start ends; None if a sample of the start is not reached.

    Args:
        low, high: ends of the box, shape (moves,).
    """
    found = bands(start)
    if found is None:
        return None
    u, (g, slopes), trust, weight = start, found, 1.0, _WEIGHT
    multipliers, rounds = np.zeros(len(g)), 0
    while rounds < ROUNDS and trust >= _LEAST_TRUST:
        rounds += 1
        new, excess, multipliers = _of_linear(
            u, g, slopes, np.maximum(low, u - trust), np.minimum(high, u + trust)
        )
        weight = max(weight, 4.0 * float(multipliers.sum()))
        merit = _merit(u, float(np.abs(g).max()) - 1.0, weight)
        expected = merit - _merit(new, excess, weight)
        if expected <= _END * max(1.0, abs(merit)):
            break
        trial = bands(new)
        gained = -1.0
        if trial is not None:
            gained = (merit - _merit(new, float(np.abs(trial[0]).max()) - 1.0, weight)) / expected
        if gained > 0.1 and trial is not None:
            u, (g, slopes) = new, trial
        trust = min(2.0, 2.0 * trust) if gained > 0.75 else trust if gained > 0.25 else trust / 4.0
    norm = float(np.linalg.norm(u))
    worth = multipliers / norm if norm > 0.0 else np.zeros(len(g))
    return LeastMove(u, np.abs(g), worth, rounds)


def _merit(u: Array, excess: float, weight: float) -> float:
    return float(u @ u) + weight * max(excess, 0.0)


def _of_linear(
    u: Array, g: Array, slopes: Array, low: Array, high: Array
) -> tuple[Array, float, Array]:
    """Return the moves of least norm that exceed the linear bands least, by how much they do, and
    the multiplier of each number.
    """
    shift, n = g - slopes @ u, len(u)
    rows = np.vstack([slopes, -slopes])
    free = np.concatenate([-1.0 - shift, shift - 1.0])  # rows @ v >= free - t
    found = _optimize.linprog(
        np.r_[np.zeros(n), 1.0],
        A_ub=-np.column_stack([rows, np.ones(len(rows))]),
        b_ub=-free,
        bounds=[*zip(low, high, strict=True), (0.0, None)],
        method="highs",
    )
    least = np.clip(found.x[:n], low, high)
    excess = max(0.0, float((free - rows @ least).max()))
    beyond = excess * (1.0 + 1e-9) + (1e-9 if excess else 0.0)
    every = np.vstack([rows, np.eye(n), -np.eye(n)])
    bounds = np.concatenate([free - beyond, low, -high])
    system, goal = np.vstack([every.T, bounds]), np.r_[np.zeros(n), 1.0]
    weights: Array = _optimize.nnls(system, goal, maxiter=50 * len(rows))[0]
    rest = np.r_[every.T @ weights, bounds @ weights - 1.0]
    new, worth = least, np.zeros(len(g))
    if abs(rest[n]) > 1e-3 / (2.0 + n):  # else round-off has taken the place of a distance
        v = np.clip(-rest[:n] / rest[n], low, high)
        if float((bounds[: len(rows)] - rows @ v).max()) <= 1e-8 + 1e-6 * excess:
            new = v
            worth = (weights / -rest[n])[: len(rows)].reshape(2, -1).sum(axis=0)
    return new, float(max(0.0, (free - rows @ new).max())), worth
