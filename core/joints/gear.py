"""Gear: the rotations of two joints in a fixed ratio. 1 row between two joints."""

from __future__ import annotations

from dataclasses import dataclass

from .coupler import Coupler


@dataclass(frozen=True)
class Gear(Coupler):
    """The first joint turns by the ratio times the second; outer gears have a negative ratio."""

    type = "gear"
    freedoms = ("rotation", "rotation")
    ratio: float

    @property
    def weights(self) -> tuple[float, float]:
        return 1.0, -self.ratio
