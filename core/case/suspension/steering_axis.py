"""Outputs of the steering axis: the physical line through two points, or of a wheel on rods the
axis of its rotation in steering. It is not the instantaneous axis of rotation in travel.
"""

from __future__ import annotations

from dataclasses import dataclass

from ...jet import Jet, doubles, norm
from .base import Attitude
from .corner import Corner, angle_in_view


@dataclass(frozen=True)
class _Inclination(Attitude):
    """Angle between the steering axis and the vertical, in a view along an axis of the vehicle."""

    measure = "rad"
    needs = ("kingpin",)
    reads = ("wheel_center", "kingpin_points")


@dataclass(frozen=True)
class Caster(_Inclination):
    """Angle between the steering axis and the vertical, seen from the side."""

    type = "caster"
    positive = "top rearward"

    def value(self, corner: Corner) -> Jet:
        """Return the caster angle [rad]."""
        _, axis = corner.kingpin
        return angle_in_view(-axis.x, axis.z, doubles(norm(axis, 0.0)))


@dataclass(frozen=True)
class KingpinInclination(_Inclination):
    """Angle between the steering axis and the vertical, seen from the front."""

    type = "kingpin_inclination"
    positive = "top inboard"

    def value(self, corner: Corner) -> Jet:
        """Return the kingpin inclination [rad]."""
        _, axis = corner.kingpin
        return angle_in_view(-axis.y, axis.z, doubles(norm(axis, 0.0)))


@dataclass(frozen=True)
class _GroundOffset(Attitude):
    """A component of the vector between the contact centre and the intersection of steering axis
    and road.
    """

    measure = "m"
    needs = ("wheel_radius", "kingpin")
    reads = ("wheel_center", "spin_marker", "wheel_contact", "kingpin_points")


@dataclass(frozen=True)
class ScrubRadius(_GroundOffset):
    """Steering axis offset at ground, across the wheel's heading: from the intersection of steering
    axis and road to the contact centre.

    As in ISO 8855 and Adams/Car, it is measured along the tyre's axes, which turn with the wheel,
    not along the vehicle's.
    """

    type = "scrub_radius"
    positive = "the axis meeting the road inboard of the contact centre"

    def value(self, corner: Corner) -> Jet:
        """Return the scrub radius [m]."""
        return -(corner.aside @ corner.kingpin_offset)


@dataclass(frozen=True)
class MechanicalTrail(_GroundOffset):
    """Castor offset at ground (ISO 8855, 7.2.3), along the heading: from the contact centre to the
    intersection of steering axis and road.
    """

    type = "mechanical_trail"
    positive = "the axis meeting the road ahead of the contact centre"

    def value(self, corner: Corner) -> Jet:
        """Return the mechanical trail [m]."""
        return corner.heading @ corner.kingpin_offset
