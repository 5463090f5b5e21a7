"""Outputs of the steering axis, a line through two points: the physical one, not the axis about
which the wheel turns at once.
"""

from __future__ import annotations

from dataclasses import dataclass

from ...jet import Jet, arctan2
from .base import Attitude
from .corner import Corner


@dataclass(frozen=True)
class _Inclination(Attitude):
    """Angle between the steering axis and the vertical, in a view along an axis of the vehicle."""

    measure = "rad"
    needs = ("kingpin",)
    reads = ("kingpin",)


@dataclass(frozen=True)
class Caster(_Inclination):
    """Angle between the steering axis and the vertical, seen from the side."""

    type = "caster"
    positive = "top rearward"

    def value(self, corner: Corner) -> Jet:
        """Caster angle [rad]."""
        _, axis = corner.kingpin
        return arctan2(-axis.x, axis.z)


@dataclass(frozen=True)
class KingpinInclination(_Inclination):
    """Angle between the steering axis and the vertical, seen from the front."""

    type = "kingpin_inclination"
    positive = "top inboard"

    def value(self, corner: Corner) -> Jet:
        """Kingpin inclination [rad]."""
        _, axis = corner.kingpin
        return arctan2(-axis.y, axis.z)


@dataclass(frozen=True)
class _GroundOffset(Attitude):
    """A component of the way between the contact centre and where the steering axis meets the
    road.
    """

    measure = "m"
    needs = ("wheel_radius", "kingpin")
    reads = ("wheel_center", "spin_marker", "kingpin")


@dataclass(frozen=True)
class ScrubRadius(_GroundOffset):
    """Steering axis offset at ground: from where the axis meets the road to the contact centre,
    across the wheel's heading.

    As in ISO 8855 and Adams/Car it is measured along the tyre's axes, which turn with the wheel,
    not along the vehicle's.
    """

    type = "scrub_radius"
    positive = "the axis meeting the road inboard of the contact centre"

    def value(self, corner: Corner) -> Jet:
        """Scrub radius [m]."""
        return -(corner.aside @ corner.kingpin_offset)


@dataclass(frozen=True)
class MechanicalTrail(_GroundOffset):
    """Castor offset at ground (ISO 8855, 7.2.3): from the contact centre to where the axis meets
    the road, along the heading.
    """

    type = "mechanical_trail"
    positive = "the axis meeting the road ahead of the contact centre"

    def value(self, corner: Corner) -> Jet:
        """Mechanical trail [m]."""
        return corner.heading @ corner.kingpin_offset
