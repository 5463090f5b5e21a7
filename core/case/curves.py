"""Curves on a grid of their own: the digits of their numbers as printed and the rounding behind
them, the samples they share with a sweep, and interpolation with an estimate of its error.
"""

from __future__ import annotations

import math
import re
from array import array
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Array

_NUMBER = re.compile(r"[-+]?(\d*)\.?(\d*)(?:[eE]([-+]?\d{1,9}))?")
# A double holds any decimal of 15 digits: with as many or more, a column is not rounded.
EXACT = 15
# Driver values with fewer digits are those that somebody set.
FEWEST_OF_DRIVER = 3
# Numbers of fewer digits are those of which zeros were left out.
FEWEST_DIGITS = 4
# Two steps may be equal by chance; of as many whole numbers, a common factor is none.
FEWEST_STEPS, MANY = 3, 10
# Differences of an even grid agree to this part of the step; those of rounded numbers do not.
_EVEN = 1e-9


@dataclass
class Printed:
    """The digits of a column of numbers, printed with as many decimals, or with as many digits.

    Programs leave out zeros at the end of a number: 0.4 beside 0.412 has three decimals, and 9.7361
    beside 10.0332 has six digits, or five. A number has as many decimals and digits as the column
    at most, whichever is coarser.

    Attributes:
        significant: most significant digits of a number.
        decimals: most decimals, less the exponent.
        own: decimals of each number, less the exponent.
    """

    significant: int = 0
    decimals: int | None = None
    own: array[int] = field(default_factory=lambda: array("q"))

    def add(self, text: str) -> None:
        """Take a further number of the column; any other text is a gap."""
        if self.exact:
            return
        if (found := _NUMBER.fullmatch(text.strip())) is None:
            self.own.append(0)
            return
        whole, part, exponent = found.groups()
        decimals = len(part) - int(exponent or 0)
        self.own.append(decimals)
        self.decimals = decimals if self.decimals is None else max(self.decimals, decimals)
        self.significant = max(self.significant, len((whole + part).lstrip("0")))

    @property
    def exact(self) -> bool:
        """Whether the numbers have all digits of doubles."""
        return self.significant >= EXACT

    @property
    def as_set(self) -> bool:
        """Whether the numbers have few digits: somebody may have set them."""
        return self.significant < FEWEST_OF_DRIVER

    def half(self, values: Array, *, alone: bool = False) -> Array:
        """Return half a unit of the last digit of each number; zero if they have all digits, or are
        zeros without decimals.

        Args:
            values: the numbers that were added, and anything at gaps.
            alone: whether each number counts by itself, since rows may be printed with fewer digits
                than others: it has the digits that it shows, but four if it shows fewer.
        """
        if self.exact or self.decimals is None or (self.significant == 0 and self.decimals <= 1):
            return np.zeros(values.shape)
        own, zero = np.array(self.own, dtype=np.float64), values == 0.0
        with np.errstate(all="ignore"):  # infinite beyond doubles; gaps
            whole = np.where(zero, -np.inf, np.floor(np.log10(np.abs(values))) + 1.0)
            column, four = (0.5 * 10.0 ** (whole - n) for n in (self.significant, FEWEST_DIGITS))
            fixed, shown = 0.5 * 10.0 ** -np.float64(self.decimals), 0.5 * 10.0**-own
        found = np.maximum(fixed, column)
        if not alone:
            return found
        # a zero with one decimal is written as another without any
        return np.maximum(found, np.where(zero, shown * (own > 1.0), np.minimum(shown, four)))


def is_even_grid(values: Array) -> bool:
    """Return whether the steps between values are equal."""
    return _are_equal(np.diff(values))


def _are_equal(steps: Array) -> bool:
    return len(steps) < 2 or float(np.ptp(steps)) <= _EVEN * float(np.abs(steps).max())


def is_set(values: Array, half: Array) -> bool:
    """Return whether somebody set values of time or a driver, so that they are not rounded: numbers
    of one or two digits, an even grid, forth or back, or multiples of one number.

    Rounded values may be even too: 5.73, 11.46 and 17.19 are tenths of a radian. So a step of three
    digits or more must end with 0, 25, 50 or 75.

    Args:
        half: half a unit of the last digit of each.
    """
    known, units = values[np.isfinite(values)], 2.0 * half[half > 0.0]
    if not units.size or float(np.abs(known).max(initial=0.0)) >= 10.0**EXACT * units.min():
        return False
    finest, coarsest = float(units.min()), float(units.max())
    if float(np.abs(known).max()) <= 100.5 * finest:
        return True
    steps = np.abs(np.diff(known))
    steps = steps[steps > 0.0]
    if len(steps) >= FEWEST_STEPS and _are_equal(steps):
        step = round(float(steps[0]) / finest)
    else:
        step = math.gcd(*map(int, np.round(known / finest).tolist()))
        # a factor of units of the last digit is one of those with the fewest decimals
        if len(known) < MANY or (step and step * finest < 1.5 * coarsest):
            return False
    return step < 100 or step % 10 == 0 or step % 25 == 0


FEWEST = 4
"""Fewest rows to interpolate a curve with an estimate of the error."""
# Slopes are taken over this part of the range at least, so that noise of near rows is no slope.
_WINDOW = 0.02
# Rows are taken in blocks, with as many rows beside them as change a spline there by 1e-12.
_BLOCK, _NEAR = 64, 40


def match_rows(rows: Array, at: Array, allowed: float) -> NDArray[np.intp] | None:
    """Return the row of each sample, -1 where there is none; None if a row is at no sample.

    Args:
        rows, at: driver values of the curve and of the sweep.
        allowed: largest difference of equal ones.
    """
    if len(rows) == len(at) and (np.abs(rows - at) <= allowed).all():
        return np.arange(len(at))
    order = np.argsort(at, kind="stable")
    above = np.clip(np.searchsorted(at[order], rows), 0, len(at) - 1)
    near = np.stack([order[np.maximum(above - 1, 0)], order[above]])
    best = np.take_along_axis(near, np.abs(at[near] - rows).argmin(axis=0)[None], 0)[0]
    if (np.abs(at[best] - rows) > allowed).any() or len(set(best.tolist())) < len(rows):
        return None
    found = np.full(len(at), -1)
    found[best] = np.arange(len(rows))
    return found


def interpolate(x: Array, y: Array, at: Array) -> tuple[Array, Array]:
    """Return values of the cubic spline through a curve, and their error, at samples within it.

    The error is that of rows predicted from the others, by splines through every second row: the
    largest of the four rows around a sample. For a smooth curve it is some 15 times the spline's
    own, and for a noisy one it has the noise. A gap wider than those is taken for as much worse.

    Args:
        x: driver values of the curve, increasing, at least `FEWEST`.
        y: its values.
        at: samples, not outside x but for rounding.
    """
    # slow to import, and rarely wanted
    from scipy.interpolate import CubicSpline  # pyright: ignore[reportMissingTypeStubs]

    spline: Any = CubicSpline
    count = len(x)
    error = np.zeros(count)
    for first in (1, 2):
        left_out = np.arange(first, count - 1, 2)
        kept = np.setdiff1d(np.arange(count), left_out)
        error[left_out] = np.abs(spline(x[kept], y[kept])(x[left_out]) - y[left_out])
    above = np.clip(np.searchsorted(x, at), 1, count - 1)
    around = np.stack([np.clip(above + k, 1, count - 2) for k in (-2, -1, 0, 1)])
    # a row was predicted across the gap that it left; a wider gap around a sample has more of it
    wider = (x[above] - x[above - 1]) / (x[around + 1] - x[around - 1])
    largest: Array = np.max(error[around] * np.maximum(1.0, wider**4), axis=0)
    return spline(x, y)(at), largest


def bound_rounding(x: Array, half: Array, at: Array, within: NDArray[np.bool_]) -> Array:
    """Return by how much the spline through a curve changes at most, if each row changes by up to
    half a unit of its last digit; zero at samples outside.

    A row changes the spline ever less at intervals away from it: there, by a factor of two or more
    for each, because twice the sum of two neighbours is the diagonal of the spline's equations.

    Args:
        x: driver values of the curve, increasing, at least `FEWEST`.
        half: largest changes of its rows.
        at: samples.
        within: those that are not outside x.
    """
    from scipy.interpolate import CubicSpline  # pyright: ignore[reportMissingTypeStubs]

    spline: Any = CubicSpline
    found = np.zeros_like(at)
    if not half.any():
        return found
    block = np.clip(np.searchsorted(x, at), 1, len(x) - 1) // _BLOCK
    for k in np.unique(block[within]).tolist():
        here = within & (block == k)
        near = slice(max(0, k * _BLOCK - _NEAR), (k + 1) * _BLOCK + _NEAR)
        weights: Array = spline(x[near], np.eye(len(x[near])))(at[here])
        found[here] = np.abs(weights) @ half[near]
    return found


def slopes(x: Array, y: Array, at: Array) -> Array:
    """Return the absolute slope of a curve near samples.

    Args:
        x: driver values, not decreasing, at least two.
    """
    reach = _WINDOW * float(x[-1] - x[0])
    above = np.clip(np.searchsorted(x, at), 1, len(x) - 1)
    below: NDArray[np.intp] = np.searchsorted(x, at - reach)
    beyond: NDArray[np.intp] = np.searchsorted(x, at + reach, side="right")
    low, high = np.minimum(below, above - 1), np.maximum(beyond - 1, above)
    base: Array = x[high] - x[low]
    rise: Array = y[high] - y[low]
    return np.abs(rise) / np.where(base > 0.0, base, np.inf)
