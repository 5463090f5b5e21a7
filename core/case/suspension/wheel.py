"""Outputs of the wheel: toe, camber, steer angle, and displacements of its centre and contact."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ...algebra import Vec3
from ...jet import Jet, arctan2, norm
from ...trajectory import Array
from .base import Attitude, Change
from .corner import Corner, angle_in_view
from .vehicle import Axle, Convention


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
    measure = "rad"
    reads = ("wheel_center", "spin_marker")
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
    measure = "rad"
    positive = "to the left (ISO 8855), to the right (SAE J670)"
    reads = ("wheel_center", "spin_marker")

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
    measure = "rad"
    reads = ("wheel_center", "spin_marker")
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
    reads = ("wheel_center", "spin_marker", "wheel_contact")

    at: Place = Place.CONTACT

    @property
    def points(self) -> tuple[str, ...]:
        """Wheel centre; for the contact centre also the axis of rotation."""
        return super().points if self.at is Place.CONTACT else (self.vehicle.wheel_center,)

    @property
    def problem(self) -> str:
        """Reason why there is no contact centre: it needs the wheel's radius. Otherwise empty."""
        if self.at is Place.WHEEL_CENTER or self.vehicle.wheel_radius is not None:
            return ""
        return (
            "found no wheel_radius in [suspension], expected it for the contact centre; add it, or"
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
    measure = "m"
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
    measure = "m"
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
    measure = "m"
    positive = "x forward, y left, z up (ISO 8855); x forward, y right, z down (SAE J670)"
    reads = ("wheel_center",)

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
