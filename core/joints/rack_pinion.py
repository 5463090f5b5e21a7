"""Rack and pinion: the displacement of one joint rolls off the rotation of another. 1 row between
two joints.
"""

from __future__ import annotations

from dataclasses import dataclass

from .base import length
from .coupler import Coupler


@dataclass(frozen=True)
class RackPinion(Coupler):
    """The second joint, the rack's, moves by the radius [m] times the turn of the first, the
    pinion's; the sign sets the sense.
    """

    type = "rack_pinion"
    freedoms = ("rotation", "translation")
    radius: float = length()

    @property
    def coefficients(self) -> tuple[float, float]:
        return -self.radius, 1.0
