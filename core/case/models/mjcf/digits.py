"""Digits of a model file: how far its numbers are rounded, and which gaps these digits leave."""

from __future__ import annotations

import re
import statistics
from dataclasses import dataclass

from .attributes import ORIENTATION
from .elements import Element

# What prints numbers writes six digits and more; fewer are a designer's own numbers.
FEWEST = 6
# Gaps and angles, relative to the size, that numbers of six digits leave.
COARSEST, FINEST = 1e-5, 1e-12
_PLACES = ("pos", "axis", "anchor", "relpose", "fromto", *ORIENTATION)
_NUMBER = re.compile(r"[-+]?0*\.?0*([0-9][0-9.]*)(?:[eE][-+]?[0-9]+)?")


@dataclass(frozen=True)
class Digits:
    """Tolerance of gaps left by the digits of a file [m], and its origin in words."""

    tolerance: float
    why: str


def digits_of(root: Element, size: float) -> Digits:
    """Return the tolerance of a model of a size [m], by the digits of its places.

    Numbers of six digits and more count, half of which have as many or more; a model without any is
    taken to have six.
    """
    counts = [
        count
        for element in root.below()
        for name in _PLACES
        for text in element.attributes.get(name, "").split()
        if (count := _significant(text)) >= FEWEST
    ]
    digits = int(statistics.median(counts)) if counts else FEWEST
    # the last digit, ten times: gaps of several places add up
    tolerance = size * min(COARSEST, max(FINEST, 10.0 ** (1 - digits)))
    return Digits(tolerance, f"the file's digits, {digits}: {tolerance:.2g} m")


def _significant(text: str) -> int:
    """Return the number of significant digits of a decimal, without zeros at its end."""
    found = _NUMBER.fullmatch(text)
    return len(found[1].replace(".", "").rstrip("0")) if found else 0
