"""Outputs of the instantaneous motion of the wheel: roll centre, motion ratio, anti-dive,
anti-squat and anti-lift.

They are quotients of velocities. In a view along an axis of the vehicle, the instant centre of the
wheel carrier lies on the normal to the velocity of each of its points. Roll centre and anti-effects
need only the line from the contact centre to the instant centre. Definitions: W. F. and D. L.
Milliken, Race Car Vehicle Dynamics, chapter 17.
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
    """Height of the kinematic roll centre above the road, for parallel travel of an axle's wheels.

    It is the intersection of the vehicle's centre plane with the line from the contact centre to
    the instant centre of the front view. This line is normal to the contact's velocity (v_y, v_z)
    and rises by v_y / v_z per metre inboard.
    """

    type = "roll_center_height"
    measure = "m"
    needs = ("wheel_radius",)
    reads = _CARRIER
    positive = "above the road"

    def value(self, corner: Corner) -> Jet:
        """Return the height [m]."""
        v = corner.contact_velocity
        return corner.contact.y * (v.y / v.z)


@dataclass(frozen=True)
class MotionRatio(Rate):
    """Compression of a spring or damper between two points, per wheel travel.

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
        """Wheel centre and both ends."""
        return (*super().points, *self.between)

    def value(self, corner: Corner) -> Jet:
        """Return the motion ratio [-]."""
        a, b = (corner.point(name) for name in self.between)
        return -distance(a, b).dot / corner.center.z.dot


@dataclass(frozen=True)
class _Anti(Rate):
    """Part of a load transfer taken by the suspension links instead of the springs: 1 is all of it.

    It is share * tan * wheelbase / cg_height. tan is the slope of the side view's line from the
    wheel to the instant centre, positive if it rises towards the middle of the vehicle. The line
    starts at the contact centre if the wheel carrier holds the torque, and at the wheel centre if
    the vehicle's body does, through a shaft.
    """

    measure = "1"
    reads = _CARRIER
    needs = ("axle", "wheel_radius", "wheelbase", "cg_height", "brake_share")
    braking: ClassVar[bool] = True
    axle: ClassVar[Axle]

    @property
    def problem(self) -> str:
        """Reason why the axle of this wheel has no such output; empty if it has one."""
        if self.vehicle.axle is self.axle:
            return ""
        return (
            f"found {self.type!r} of a {self.vehicle.axle} axle, expected a {self.axle} one; remove"
            " it, or correct suspension.axle"
        )

    def value(self, corner: Corner) -> Jet:
        """Return the part of the load transfer [-]."""
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
    """Anti-dive of the front axle in braking."""

    type = "anti_dive"
    positive = "less dive in braking, none at 1"
    axle = Axle.FRONT


@dataclass(frozen=True)
class AntiLift(_Anti):
    """Anti-lift of the rear axle in braking."""

    type = "anti_lift"
    positive = "less lift in braking, none at 1"
    axle = Axle.REAR


@dataclass(frozen=True)
class AntiSquat(_Anti):
    """Anti-squat of the driven rear axle in acceleration."""

    type = "anti_squat"
    needs = (*_Anti.needs[:-1], "drive_share")
    positive = "less squat in acceleration, none at 1"
    braking = False
    axle = Axle.REAR
