"""Limits of joints as files state them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from ...io.document import decimal, shown
from .element import Element

INFINITE = 1e15
"""Simulators write numbers beyond this for no limit; SDF has 1e16."""


@dataclass(frozen=True)
class Limit:
    """Bounds of a joint with one coordinate; infinite without one.

    Attributes:
        lower, upper: of its coordinate [rad or m].
        effort: of its motor, by size [N m or N].
        velocity: by size [rad/s or m/s].
    """

    lower: float = -math.inf
    upper: float = math.inf
    effort: float = math.inf
    velocity: float = math.inf

    @property
    def is_range(self) -> bool:
        """Whether its coordinate has two bounds, the lower one first."""
        return self.lower < self.upper and math.isfinite(self.upper - self.lower)


NO_LIMIT = Limit()


def limit_of(element: Element, texts: Mapping[str, str]) -> Limit:
    """Return the limit of the texts of its numbers, which may be missing or too large for one.

    Raises:
        CaseError: one is no number.
    """
    found = dict(vars(NO_LIMIT))
    for key, none in vars(NO_LIMIT).items():
        try:
            number = decimal(texts.get(key) or str(none))
        except ValueError:
            number = math.nan
        if math.isnan(number):
            raise element.fault(f"found {shown(texts[key])}, expected a number; correct the limit")
        found[key] = number if abs(number) < INFINITE else none
    return Limit(**found)
