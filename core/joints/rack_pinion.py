"""Rack and pinion: one joint's displacement follows another's rotation. 1 row, two joints."""

from __future__ import annotations

from dataclasses import dataclass

from .base import length
from .coupler import Coupler


@dataclass(frozen=True)
class RackPinion(Coupler):
    """The second joint (rack) moves by the radius [m] times the turn of the first (pinion); the
    sign sets the sense.
    """

    type = "rack_pinion"
    freedoms = ("rotation", "translation")
    radius: float = length()

    @property
    def weights(self) -> tuple[float, float]:
        return -self.radius, 1.0
