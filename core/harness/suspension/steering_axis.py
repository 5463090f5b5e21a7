"""Outputs of the steering axis, a line through two points: the physical one, not the axis about which the wheel turns at once."""

from __future__ import annotations

from dataclasses import dataclass

from ...jet import Jet, arctan2
from .base import Attitude
from .corner import Corner

_OFFSET = ("wheel_radius", "kingpin")
_OFFSET_READS = ("wheel_center", "spin_marker", "kingpin")


@dataclass(frozen=True)
class Caster(Attitude):
    """Angle between the steering axis and the vertical, seen from the side."""

    type = "caster"
    measure = "rad"
    needs = ("kingpin",)
    reads = ("kingpin",)
    positive = "top rearward"

    def value(self, corner: Corner) -> Jet:
        """Caster angle [rad]."""
        _, axis = corner.kingpin
        return arctan2(-axis.x, axis.z)


@dataclass(frozen=True)
class KingpinInclination(Attitude):
    """Angle between the steering axis and the vertical, seen from the front."""

    type = "kingpin_inclination"
    measure = "rad"
    needs = ("kingpin",)
    reads = ("kingpin",)
    positive = "top inboard"

    def value(self, corner: Corner) -> Jet:
        """Kingpin inclination [rad]."""
        _, axis = corner.kingpin
        return arctan2(-axis.y, axis.z)


@dataclass(frozen=True)
class ScrubRadius(Attitude):
    """Steering axis offset at ground: from where the axis meets the road to the contact centre, across the wheel's heading.

    As in ISO 8855 and Adams/Car it is measured along the tyre's axes, which turn with the wheel, not along the vehicle's.
    """

    type = "scrub_radius"
    measure = "m"
    needs = _OFFSET
    reads = _OFFSET_READS
    positive = "the axis meeting the road inboard of the contact centre"

    def value(self, corner: Corner) -> Jet:
        """Scrub radius [m]."""
        return -(corner.aside @ corner.kingpin_offset)


@dataclass(frozen=True)
class MechanicalTrail(Attitude):
    """Castor offset at ground (ISO 8855, 7.2.3): from the contact centre to where the axis meets the road, along the heading."""

    type = "mechanical_trail"
    measure = "m"
    needs = _OFFSET
    reads = _OFFSET_READS
    positive = "the axis meeting the road ahead of the contact centre"

    def value(self, corner: Corner) -> Jet:
        """Mechanical trail [m]."""
        return corner.heading @ corner.kingpin_offset
