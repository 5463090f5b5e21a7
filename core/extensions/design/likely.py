"""The most likely parameters, by measured numbers and by what was known before.

With u the parameters over their known deviations, r(u) the model's numbers less the measured ones
over their noise, and J the slopes of r, both noise and u are normal:

    minimise |Q r(u)|^2 + |u|^2.

Q takes out shifts of the numbers of any size: those that the data may have. The minimum is
chi-square distributed with a degree of freedom for each number that is left (the marginal
likelihood of a linear model), and the covariance of u is that of the linear model there,
(1 + J'QJ)^-1: a singular value s of QJ tells one combination of parameters sqrt(1 + s^2) times
better than before, one that is zero not at all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.special  # pyright: ignore[reportMissingTypeStubs]

from ...trajectory import Array

Model = Callable[[Array], tuple[Array, Array] | None]
"""Numbers off the measured ones over their noise, shape (numbers,), and their slopes by the
parameters, shape (numbers, parameters); None if a sample is not reached.
"""

NOTHING = 1e-12
"""A shift of which this part is left beside parameters and other shifts is one of theirs."""
ROUNDS = 40
_END = 1e-8
_MOST_DAMPING = 1e8
_special: Any = scipy.special


@dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters and what is known of them.

    Attributes:
        u: parameters over their known deviations, shape (parameters,).
        off: model less measured numbers over their noise, shape (numbers,).
        slopes: of these by the parameters, shape (numbers, parameters).
        free: shifts of any size, shape (numbers, shifts).
        rounds: of linearisation.
    """

    u: Array
    off: Array
    slopes: Array
    free: Array
    rounds: int

    @property
    def misfit(self) -> float:
        """The minimum: squares of the numbers and of the parameters."""
        left = _without(self.free, self.off)
        return float(left @ left + self.u @ self.u)

    @property
    def freedom(self) -> int:
        """The mean of the misfit, if data and model agree."""
        return len(self.off) - self.free.shape[1]

    @property
    def probability(self) -> float:
        """The probability of a misfit as large or larger, if data and model agree."""
        return float(_special.chdtrc(self.freedom, self.misfit))

    @property
    def evidence(self) -> float:
        """Minus twice the logarithm of the data's probability, but for a constant: a model that
        could do anything gets less of it than one that does what was measured.
        """
        sizes, _ = self.decomposed
        return self.misfit + float(np.log1p(sizes**2).sum())

    @cached_property
    def decomposed(self) -> tuple[Array, Array]:
        """Singular values of the slopes, one for each parameter, and the combinations as rows."""
        _, sizes, rows = np.linalg.svd(_without(self.free, self.slopes))
        return np.append(sizes, np.zeros(len(rows) - len(sizes))), rows

    @cached_property
    def covariance(self) -> Array:
        """The covariance of the parameters, shape (parameters, parameters)."""
        sizes, rows = self.decomposed
        return (rows.T / (1.0 + sizes**2)) @ rows

    def shift(self, direction: Array) -> tuple[float, float]:
        """Return the most likely size of a shift of the measured numbers, and its deviation;
        infinite if the parameters or other shifts can do the same.
        """
        own, slopes = _without(self.free, direction), _without(self.free, self.slopes)
        rest = own - slopes @ (self.covariance @ (slopes.T @ own))
        known = float(own @ rest)
        if known <= NOTHING * float(direction @ direction):
            return 0.0, np.inf
        return -float(rest @ (self.off - self.slopes @ self.u)) / known, known**-0.5


def most_likely(model: Model, start: Array, free: Array) -> Estimate | None:
    """Return the most likely parameters near a start, by damped Gauss-Newton steps; None if a
    sample of the start is not reached.

    Args:
        free: shifts of any size, shape (numbers, shifts).
    """
    found = model(start)
    if found is None:
        return None
    u, (off, slopes), damping, rounds = start, found, 0.0, 0
    while rounds < ROUNDS and damping < _MOST_DAMPING:
        rounds += 1
        left, by = _without(free, off), _without(free, slopes)
        kept = np.sqrt(1.0 + damping)
        system = np.vstack([by, kept * np.eye(len(u))])
        step = np.linalg.lstsq(system, -np.concatenate([left, u / kept]))[0]
        now = float(left @ left + u @ u)
        linear, moved = left + by @ step, u + step
        expected = now - float(linear @ linear + moved @ moved)
        if expected <= _END * max(1.0, now):
            break
        trial = model(moved)
        gained = -1.0
        if trial is not None:
            rest = _without(free, trial[0])
            gained = (now - float(rest @ rest + moved @ moved)) / expected
        if gained > 0.01 and trial is not None:
            u, (off, slopes) = moved, trial
        damping = 0.1 * damping if gained > 0.5 else max(10.0 * damping, 0.1)
        damping = 0.0 if damping < 1e-3 else damping
    return Estimate(u, off, slopes, free, rounds)


def _without(free: Array, values: Array) -> Array:
    """Return numbers, or columns of them, without their part along the shifts."""
    if not free.shape[1]:
        return values
    basis = np.linalg.qr(free)[0]
    return values - basis @ (basis.T @ values)
