"""Digits of numbers as they are printed, and the rounding behind them."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from ..trajectory import Array

_NUMBER = re.compile(r"[-+]?(\d*)\.?(\d*)(?:[eE]([-+]?\d{1,9}))?")
# A double holds any decimal of 15 digits: with as many or more, a column is not rounded.
EXACT = 15
# Driver values with fewer digits are those that somebody set.
FEWEST_OF_DRIVER = 3
# Differences of an even grid agree to this part of the step; those of rounded numbers do not.
_EVEN = 1e-9


@dataclass
class Printed:
    """The digits of a column of numbers, printed with as many decimals, or with as many digits.

    A spreadsheet leaves out the zeros at the end of a number: 0.4 beside 0.412 has three decimals.
    Of the two formats, the column has the one that leaves out fewer of them.

    Attributes:
        significant: most significant digits of a number.
        decimals: most decimals, less the exponent.
        numbers: how many there are but for zeros, which have no significant digit.
        all_significant, all_decimals: sums over these.
    """

    significant: int = 0
    decimals: int | None = None
    numbers: int = 0
    all_significant: int = 0
    all_decimals: int = 0

    def add(self, text: str) -> None:
        """Take a further number of the column."""
        if self.exact or (found := _NUMBER.fullmatch(text.strip())) is None:
            return
        whole, part, exponent = found.groups()
        decimals = len(part) - int(exponent or 0)
        self.decimals = decimals if self.decimals is None else max(self.decimals, decimals)
        if digits := (whole + part).lstrip("0"):
            self.significant = max(self.significant, len(digits))
            self.numbers += 1
            self.all_significant += len(digits)
            self.all_decimals += decimals

    @property
    def exact(self) -> bool:
        """Whether the numbers have all digits of doubles."""
        return self.significant >= EXACT

    @property
    def as_set(self) -> bool:
        """Whether the numbers have few digits: somebody may have set them."""
        return self.significant < FEWEST_OF_DRIVER

    def half(self, values: Array) -> Array:
        """Return half a unit of the last digit of each number; zero if they have all digits, or are
        zeros without decimals.
        """
        places = self.decimals or 0
        if self.exact or self.decimals is None or (self.numbers == 0 and places <= 1):
            return np.zeros(values.shape)
        fixed = np.full(values.shape, 0.5 * 10.0**-places)
        left_out = self.numbers * places - self.all_decimals
        if left_out <= self.numbers * self.significant - self.all_significant:
            return fixed
        first = np.floor(np.log10(np.where(values == 0.0, 1.0, np.abs(values))))
        return np.where(values == 0.0, fixed, 0.5 * 10.0 ** (first + 1.0 - self.significant))


def even(values: Array) -> bool:
    """Return whether the values are an even grid, which somebody chose and nobody rounded."""
    return even_steps(np.diff(values))


def even_steps(steps: Array) -> bool:
    """Return whether steps are those of an even grid."""
    return len(steps) < 2 or float(np.ptp(steps)) <= _EVEN * float(np.abs(steps).max())


def multiples(values: Array, decimals: int) -> bool:
    """Return whether the values, in units of their last decimal, have a common factor, so that
    somebody set them.
    """
    largest = float(np.abs(values).max())
    if largest > 0.0 and decimals + math.log10(largest) > EXACT:
        return False
    units = np.round(values * 10.0**decimals) if largest else values
    return math.gcd(*map(int, units.tolist())) != 1
