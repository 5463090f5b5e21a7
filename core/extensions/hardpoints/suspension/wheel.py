"""Outputs of a wheel: toe, camber, steer angle, displacements; of its steering axis; turns of its
arms and bars; and of its instantaneous motion: roll centre, jacking, motion ratio, anti-dive,
anti-squat and anti-lift.

The steering axis is the physical line through two points, or of a wheel on rods the axis of its
rotation in steering. It is not the instantaneous axis of rotation in travel.

Outputs of the instantaneous motion are quotients of velocities. In a view along an axis of the
vehicle, the instant centre of the wheel carrier lies on the normal to the velocity of each of its
points. Roll centre and anti-effects need only the line from the contact centre to the instant
centre. Definitions: W. F. and D. L. Milliken, Race Car Vehicle Dynamics, chapter 17.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

import numpy as np

from ....algebra import Vec3, cross
from ....jet import Jet, arctan2, norm, sqrt
from ....trajectory import Array
from .base import Attitude, Change, Rate, SuspensionOutput
from .corner import Axle, Convention, Corner, Reaction, angle_in_view, distance, velocity


class Place(StrEnum):
    """Point at which a displacement of the wheel is measured."""

    WHEEL_CENTER = "wheel_center"
    CONTACT = "contact"


class AxisName(StrEnum):
    """An axis of the convention."""

    X = "x"
    Y = "y"
    Z = "z"


@dataclass(frozen=True)
class Toe(Attitude):
    """Angle in the road plane between the vehicle's x axis and the wheel plane (ISO 8855, 7.1.6).

    In corner axes the axis of rotation s of a toed-in wheel points forward: tan = s_x / s_y.
    """

    type = "toe"
    nowhere = "the wheel lies on its side there"
    positive = "toe-in"

    def value(self, corner: Corner) -> Jet:
        """Return the toe-in [rad]."""
        s = corner.spin
        return angle_in_view(s.x, s.y)


@dataclass(frozen=True)
class SteerAngle(Attitude):
    """The angle of `Toe`, about the z axis of the convention by the right-hand rule: one sign for
    both wheels.
    """

    type = "steer_angle"
    positive = "to the left (ISO 8855), to the right (SAE J670)"

    @property
    def sense(self) -> str:
        """Left if the z axis points up, right if it points down."""
        return (
            "positive: to the left"
            if self.vehicle.convention is Convention.ISO_8855
            else "positive: to the right"
        )

    def value(self, corner: Corner) -> Jet:
        """Return the steer angle [rad]."""
        s, side = corner.spin, self.vehicle.side.left * self.vehicle.convention.up
        return side * angle_in_view(-s.x, s.y)


@dataclass(frozen=True)
class Camber(Attitude):
    """Angle between the vehicle's z axis and the wheel plane, independent of toe: sin = -s_z."""

    type = "camber"
    positive = "top outboard"

    def value(self, corner: Corner) -> Jet:
        """Return the camber [rad], by its tangent: a sine near one has lost half its digits."""
        s = corner.spin
        return arctan2(-s.z, norm(Vec3(s.x, s.y, 0.0 * s.z), 1.0))


def camber_of_front_view(seen: Array, toe: Array) -> Array:
    """Return `Camber` [rad], shape (n,), from the camber that is seen along the vehicle's x axis.

    Some programs give that one. In corner axes its tangent is -s_z / s_y, that of `Camber` is
    -s_z / sqrt(s_x^2 + s_y^2), and cos(toe) = s_y / sqrt(s_x^2 + s_y^2).

    Args:
        seen: the camber that is seen [rad], shape (n,).
        toe: the toe-in [rad], shape (n,).
    """
    return np.arctan(np.tan(seen) * np.cos(toe))


@dataclass(frozen=True)
class _Shift(Change):
    at: Place = Place.CONTACT

    @property
    def problem(self) -> str:
        """Reason why there is no contact centre: it needs the wheel's radius. Otherwise empty."""
        if self.at is Place.WHEEL_CENTER or self.vehicle.wheel_radius is not None:
            return ""
        return (
            "found no wheel_radius in [suspension], expected it for the contact centre. Add it, or"
            ' at = "wheel_center"'
        )

    def _position(self, corner: Corner) -> Vec3:
        return corner.contact if self.at is Place.CONTACT else corner.center


@dataclass(frozen=True)
class HalfTrackChange(_Shift):
    """Lateral displacement of contact centre or wheel centre: half of an axle's track change in
    parallel travel.
    """

    type = "half_track_change"
    positive = "outboard, a wider track"

    def value(self, corner: Corner) -> Jet:
        """Return the half track [m]."""
        return self._position(corner).y


@dataclass(frozen=True)
class WheelbaseChange(_Shift):
    """Longitudinal displacement of contact centre or wheel centre. Forward lengthens the wheelbase
    at the front, rearward at the rear.
    """

    type = "wheelbase_change"
    positive = "a longer wheel base: forward at the front, rearward at the rear"
    needs = ("axle",)

    @property
    def sense(self) -> str:
        """Direction of a longer wheelbase."""
        return (
            f"positive: {'forward' if self.vehicle.axle is Axle.FRONT else 'rearward'}, a longer"
            " wheel base"
        )

    def value(self, corner: Corner) -> Jet:
        """Return the coordinate along the wheelbase [m]."""
        x: Jet = self._position(corner).x
        return x if self.vehicle.axle is Axle.FRONT else -x


@dataclass(frozen=True)
class WheelDisplacement(Change):
    """Displacement of the wheel centre relative to the body, along an axis of the convention."""

    type = "wheel_displacement"
    positive = "x forward, y left, z up (ISO 8855); x forward, y right, z down (SAE J670)"

    component: AxisName = AxisName.Z

    @property
    def sense(self) -> str:
        """Direction of the axis."""
        iso = self.vehicle.convention is Convention.ISO_8855
        ways = {
            AxisName.X: "forward",
            AxisName.Y: "left" if iso else "right",
            AxisName.Z: "up" if iso else "down",
        }
        return f"positive: {ways[self.component]}"

    def value(self, corner: Corner) -> Jet:
        """Return the coordinate [m]."""
        x, y, z = corner.center
        up = self.vehicle.convention.up
        shifts: dict[AxisName, Jet] = {
            AxisName.X: x,
            AxisName.Y: up * self.vehicle.side.left * y,
            AxisName.Z: up * z,
        }
        return shifts[self.component]


@dataclass(frozen=True)
class _Inclination(Attitude):
    """Angle between the steering axis and the vertical, in a view along an axis of the vehicle."""

    needs = ("kingpin",)
    nowhere = "the steering axis lies along the view there"


@dataclass(frozen=True)
class Caster(_Inclination):
    """Angle between the steering axis and the vertical, seen from the side."""

    type = "caster"
    positive = "top rearward"

    def value(self, corner: Corner) -> Jet:
        """Return the caster angle [rad]."""
        _, axis = corner.kingpin
        return angle_in_view(-axis.x, axis.z, norm(axis, 0.0).x)


@dataclass(frozen=True)
class KingpinInclination(_Inclination):
    """Angle between the steering axis and the vertical, seen from the front."""

    type = "kingpin_inclination"
    positive = "top inboard"

    def value(self, corner: Corner) -> Jet:
        """Return the kingpin inclination [rad]."""
        _, axis = corner.kingpin
        return angle_in_view(-axis.y, axis.z, norm(axis, 0.0).x)


@dataclass(frozen=True)
class _GroundOffset(Attitude):
    """A component of the vector between the contact centre and the intersection of steering axis
    and road.
    """

    measure = "m"
    needs = ("wheel_radius", "kingpin")
    nowhere = "the steering axis is parallel to the road there"


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
    positive = "compressed in jounce"

    between: tuple[str, str]

    def value(self, corner: Corner) -> Jet:
        """Return the motion ratio [-]."""
        a, b = (corner.point(name) for name in self.between)
        return -distance(a, b).dot / corner.center.z.dot


@dataclass(frozen=True)
class JackingCoefficient(Rate):
    """Vertical force of the links on the body per lateral force at the contact: the slope of the
    line from the contact centre to the instant centre of the front view, v_y / v_z.

    By virtual work, a lateral force F outboard changes the force of the springs by F v_y / v_z, and
    the links carry the rest of the wheel's load.
    """

    type = "jacking_coefficient"
    measure = "1"
    needs = ("wheel_radius",)
    positive = "a force inboard on the tyre lifts the body"

    def value(self, corner: Corner) -> Jet:
        """Return the coefficient [-]."""
        v = corner.contact_velocity
        return v.y / v.z


@dataclass(frozen=True)
class Twist(SuspensionOutput):
    """Turn of a part from design about an axis fixed to the body: of an arm with a torsion bar, a
    rocker, or half an anti-roll bar.

    Attributes:
        about: names of two points of the axis, and of a point of the part.
    """

    type = "twist"
    measure = "rad"
    positive = "right-handed about the axis from its first to its second point, on the left side"

    about: tuple[str, str, str]

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the angle [rad]: of the part's point at design and now, seen along the axis."""
        return self.value(Corner(self.vehicle, at), Corner(self.vehicle, design))

    def value(self, now: Corner, then: Corner) -> Jet:
        """Return the angle from one pose to another [rad]."""
        first, second, part = self.about
        axis = now.point(second) - now.point(first)
        r, r_design = (each.point(part) - each.point(first) for each in (now, then))
        along = axis @ axis
        across = cross(r_design, r) @ axis
        return arctan2(
            across * sqrt(along), along * (r_design @ r) - (axis @ r_design) * (axis @ r)
        )


@dataclass(frozen=True)
class _Anti(Rate):
    """Part of a load transfer taken by the suspension links instead of the springs: 1 is all of it.

    It is share * tan * wheelbase / cg_height. tan is the slope of the side view's line from the
    wheel to the instant centre, positive if it rises towards the middle of the vehicle. The line
    starts at the contact centre if the wheel carrier holds the torque, and at the wheel centre if
    the vehicle's body does, through a shaft.
    """

    measure = "1"
    needs = ("axle", "wheel_radius", "wheelbase", "cg_height", "brake_share")
    braking: ClassVar[bool] = True
    axle: ClassVar[Axle]

    @property
    def problem(self) -> str:
        """Reason why the axle of this wheel has no such output; empty if it has one."""
        if self.vehicle.axle is self.axle:
            return ""
        return (
            f"found {self.type!r} of a {self.vehicle.axle} axle, expected a {self.axle} one. Remove"
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
