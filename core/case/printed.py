"""Digits of numbers as they are printed, and the rounding that they stand for."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ..trajectory import Array

_NUMBER = re.compile(r"[-+]?(\d*)(\.?)(\d*)(?:[eE]([-+]?\d+))?")
# A double holds any decimal of 15 digits: with as many or more, a column is not rounded. With fewer
# than four digits, numbers that somebody chose (0.25, 1.5) cannot be told from rounded ones.
EXACT, FEWEST = 15, 4
# Differences of an even grid agree to this part of the step; those of rounded numbers do not.
_EVEN = 1e-9


@dataclass
class Printed:
    """The digits of a column of numbers, printed with as many decimals, or with as many digits.

    Attributes:
        significant: most significant digits of a number.
        decimals: most decimals, less the exponent.
        pointed: whether any number has a point or an exponent.
    """

    significant: int = 0
    decimals: int = 0
    pointed: bool = False

    def add(self, text: str) -> None:
        """Take a further number of the column."""
        if self.significant >= EXACT or (found := _NUMBER.fullmatch(text.strip())) is None:
            return
        whole, point, part, exponent = found.groups()
        pointed = bool(point or exponent)
        digits = (whole + part).lstrip("0")
        self.significant = max(self.significant, len(digits if pointed else digits.rstrip("0")))
        self.decimals = max(self.decimals, len(part) - int(exponent or 0))
        self.pointed = self.pointed or pointed

    @property
    def rounded(self) -> bool:
        """Whether the numbers are taken for rounded ones."""
        return self.pointed and FEWEST <= self.significant < EXACT

    def half(self, values: Array) -> Array:
        """Return half a unit of the last digit of each number, zero if they are not rounded.

        The last digit is the coarser of the one after `decimals` and the one after `significant`
        digits: a column printed in one format has one of the two, and a number that lost its
        trailing zeros has more digits than it shows.
        """
        if not self.rounded:
            return np.zeros_like(values)
        size = np.abs(values)
        first = np.floor(np.log10(np.where(size > 0.0, size, 1e-300)))
        last = np.maximum(-float(self.decimals), first + 1.0 - self.significant)
        return 0.5 * 10.0**last


def even(values: Array) -> bool:
    """Return whether the values are an even grid, which somebody chose and nobody rounded."""
    steps = np.diff(values)
    return len(steps) < 2 or float(np.ptp(steps)) <= _EVEN * float(np.abs(steps).max())
