"""Outputs of the way the wheel is going: roll centre, motion ratio, anti-dive, anti-squat and
anti-lift.

They are quotients of velocities. In a view along an axis of the vehicle, the instant centre of the
wheel carrier lies on the normal to the velocity of any of its points; the line from the contact
centre to it is all that roll centre and anti-effects need. Definitions: W. F. and D. L. Milliken,
Race Car Vehicle Dynamics, chapter 17.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ...jet import Jet
from .base import Rate
from .corner import Corner, distance, velocity
from .vehicle import Axle, Reaction

_CARRIER = ("wheel_center", "spin_marker", "top_marker")


@dataclass(frozen=True)
class RollCenterHeight(Rate):
    """Height above the road of the kinematic roll centre of an axle whose wheels travel in
    parallel.

    The line from the contact centre to the instant centre of the front view, cut with the vehicle's
    centre plane: with the contact's velocity (v_y, v_z) it is normal to that and rises by v_y / v_z
    over a metre inboard.
    """

    type = "roll_center_height"
    measure = "m"
    needs = ("wheel_radius",)
    reads = _CARRIER
    positive = "above the road"

    def value(self, corner: Corner) -> Jet:
        """Height [m]."""
        v = corner.contact_velocity
        return corner.contact.y * (v.y / v.z)


@dataclass(frozen=True)
class MotionRatio(Rate):
    """Compression of a spring or damper between two points, over wheel travel.

    Attributes:
        between: names of its ends.
    """

    type = "motion_ratio"
    measure = "1"
    reads = ("wheel_center",)
    positive = "compressed in jounce"

    between: tuple[str, str]

    @property
    def points(self) -> tuple[str, ...]:
        """The wheel centre and the ends."""
        return (*super().points, *self.between)

    def value(self, corner: Corner) -> Jet:
        """Motion ratio [-]."""
        a, b = (corner.point(name) for name in self.between)
        return -distance(a, b).dot / corner.center.z.dot


@dataclass(frozen=True)
class _Anti(Rate):
    """The part of a load transfer that the suspension links take, so that the springs need not: 1
    is all of it.

    share * tan * wheelbase / cg_height, tan being the slope of the side view's line from the wheel
    to the instant centre, rising towards the middle of the vehicle. It starts at the contact centre
    where the wheel carrier holds the torque, and at the wheel centre where the vehicle's body does,
    through a shaft.
    """

    measure = "1"
    reads = _CARRIER
    needs = ("axle", "wheel_radius", "wheelbase", "cg_height", "brake_share")
    braking: ClassVar[bool] = True
    axle: ClassVar[Axle]

    @property
    def problem(self) -> str:
        """Each is of one axle."""
        if self.vehicle.axle is self.axle:
            return ""
        return (
            f"found {self.type!r} of a {self.vehicle.axle} axle, expected a {self.axle} one; remove"
            " it, or correct suspension.axle"
        )

    def value(self, corner: Corner) -> Jet:
        """Part of the load transfer [-]."""
        car = self.vehicle
        share, reaction = (
            (car.brake_share, car.brakes) if self.braking else (car.drive_share, car.drive)
        )
        assert share is not None
        assert car.wheelbase is not None
        assert car.cg_height is not None
        v = corner.contact_velocity if reaction is Reaction.OUTBOARD else velocity(corner.center)
        towards_middle = 1.0 if self.axle is Axle.FRONT else -1.0
        return towards_middle * share * car.wheelbase / car.cg_height * (v.x / v.z)


@dataclass(frozen=True)
class AntiDive(_Anti):
    """Of the front axle, in braking."""

    type = "anti_dive"
    positive = "less dive in braking, none at 1"
    axle = Axle.FRONT


@dataclass(frozen=True)
class AntiLift(_Anti):
    """Of the rear axle, in braking."""

    type = "anti_lift"
    positive = "less lift in braking, none at 1"
    axle = Axle.REAR


@dataclass(frozen=True)
class AntiSquat(_Anti):
    """Of the driven rear axle, in acceleration."""

    type = "anti_squat"
    needs = (*_Anti.needs[:-1], "drive_share")
    positive = "less squat in acceleration, none at 1"
    braking = False
    axle = Axle.REAR
