"""Outputs of both wheels of an axle: track, roll angle, Ackermann, and the roll centre where the
wheels do not travel alike.

Vectors are of both corners, each in its own corner axes; see `Corner`. The left wheel has the y
axis of the body, the right one the opposite.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from ....algebra import Vec3, root
from ....case.quantity import HIDDEN
from ....jet import Jet, arctan2, choose, known, sign, sqrt
from .base import Rate, SuspensionOutput
from .corner import PARALLEL, Corner, Side, Vehicle, angle_in_view

# Wheels steered by less than this have no Ackermann of use [rad]: a quotient of two differences.
STRAIGHT = 1e-2
# A rack that turns the wheels by less than this steers nothing [rad/m]: usual ones do 5 to 12.
NO_STEER = 1e-3


@dataclass(frozen=True)
class AxleOutput(SuspensionOutput):
    """A quantity of both wheels of an axle.

    Attributes:
        other: the other wheel.
    """

    measure = "m"
    needs = ("wheel_radius",)
    further: ClassVar[Mapping[str, tuple[Any, Any]]] = {}

    other: Vehicle = field(metadata=HIDDEN)

    @property
    def vehicles(self) -> tuple[Vehicle, ...]:
        """The left and the right wheel."""
        both = (self.vehicle, self.other)
        return both if self.vehicle.side is Side.LEFT else both[::-1]

    @property
    def signs(self) -> str:
        """Convention of signs and axes, in words."""
        return self.vehicles[0].signs.replace("left wheel", "both wheels")


@dataclass(frozen=True)
class Track(AxleOutput):
    """Lateral distance of the contact centres."""

    type = "track"
    positive = "always"

    def value(self, left: Corner, right: Corner) -> Jet:
        """Return the track [m]."""
        return left.contact.y + right.contact.y


@dataclass(frozen=True)
class RollAngle(AxleOutput):
    """Angle of the body to the line through both contact centres, seen from the front."""

    type = "roll_angle"
    measure = "rad"
    positive = "right side of the body down"

    def value(self, left: Corner, right: Corner) -> Jet:
        """Return the roll angle [rad]."""
        a, b = left.contact, right.contact
        return arctan2(b.z - a.z, a.y + b.y)


@dataclass(frozen=True)
class MeanSteerAngle(AxleOutput):
    """Mean of the steer angles of both wheels (ISO 8855, 7.1.3), their static toe included."""

    type = "mean_steer_angle"
    measure = "rad"
    needs = ()
    positive = "to the left (ISO 8855), to the right (SAE J670)"

    def value(self, left: Corner, right: Corner) -> Jet:
        """Return the angle [rad]."""
        a, b = _to_the_left(left, right)
        return 0.5 * self.vehicle.convention.up * (a + b)


@dataclass(frozen=True)
class SteeringRatio(AxleOutput):
    """Turn of the steering wheel per mean steer angle, both as rates: 2 pi / rack_per_turn times
    the rack's travel per mean steer angle.

    It is of the motion of the rack alone, and has no value while the wheels do not steer.

    Attributes:
        rack: name of a point of the rack, which moves along the vehicle's y axis.
    """

    type = "steering_ratio"
    nowhere = "the wheels hardly steer there"
    measure = "1"
    needs = ("rack_per_turn",)
    positive = "always"

    rack: str

    @property
    def orders(self) -> int:
        """Value and rate, which need velocities and accelerations."""
        return 2

    def value(self, left: Corner, right: Corner) -> Jet:
        """Return the ratio [-]."""
        a, b = _to_the_left(left, right)
        turned = (0.5 * (a + b)).dot
        assert self.vehicle.rack_per_turn is not None
        ratio = 2.0 * np.pi / self.vehicle.rack_per_turn * left.point(self.rack).y.dot / turned
        return known(turned.x, NO_STEER * left.point(self.rack).y.v, sign(ratio.x) * ratio)


@dataclass(frozen=True)
class _WhileSteering(AxleOutput):
    """A quantity of steered wheels. It has no value while a wheel is straight, or toes against the
    other.
    """

    needs = ("wheel_radius", "wheelbase")
    nowhere = "a wheel is straight there, to 0.01 rad, or the wheels toe against each other"

    @property
    def orders(self) -> int:
        """The value alone: its rates grow without bound towards straight wheels."""
        return 1

    @abstractmethod
    def of_cotangents(self, inner: Jet, outer: Jet, ratio: Jet) -> Jet:
        """Return the value for cotangents of the steer angles towards the inner wheel.

        Args:
            ratio: track of the contact centres over the wheelbase [-].
        """

    def value(self, left: Corner, right: Corner) -> Jet:
        """Return the output over the samples."""
        a, b = left.spin, right.spin
        first, second = -(a.y / a.x), b.y / b.x  # to the left
        to_left = sign(b.x.x)
        inner = choose(1.0 + to_left, 1.0, first, -second)
        outer = choose(1.0 + to_left, 1.0, second, -first)
        assert self.vehicle.wheelbase is not None
        ratio = (left.contact.y + right.contact.y) / self.vehicle.wheelbase
        value, (x, y) = self.of_cotangents(inner, outer, ratio), (a.x.x, b.x.x)
        steered = known(x, STRAIGHT, known(y, STRAIGHT, value))
        return known(x - y, x + y, steered)  # to the same side: of opposite signs


@dataclass(frozen=True)
class Ackermann(_WhileSteering):
    """Part of the difference of cotangents that lets both wheels roll about one point of the rear
    axle's line: wheelbase / track * (cot outer - cot inner), the track being that of the contact
    centres (W. F. and D. L. Milliken, Race Car Vehicle Dynamics, chapter 19). It is the wheelbase
    over the distance behind the front axle at which the axes of both wheels cross.
    """

    type = "ackermann"
    measure = "1"
    positive = "the inner wheel steered further, fully at 1"

    def of_cotangents(self, inner: Jet, outer: Jet, ratio: Jet) -> Jet:
        """Return the part of the difference [-]."""
        return (outer - inner) / ratio


@dataclass(frozen=True)
class AckermannAngles(_WhileSteering):
    """Part of the difference of steer angles with the inner wheel as it is: (inner - outer) /
    (inner - ideal), the ideal outer wheel having cot ideal = cot inner + track / wheelbase.
    Adams/Car calls it percent Ackerman, with its turn centre from the inside wheel.
    """

    type = "ackermann_angles"
    measure = "1"
    positive = "the inner wheel steered further, fully at 1"

    def of_cotangents(self, inner: Jet, outer: Jet, ratio: Jet) -> Jet:
        """Return the part of the difference [-]."""
        one = ratio / ratio
        a, b, ideal = (arctan2(one, each) for each in (inner, outer, inner + ratio))
        return (a - b) / (a - ideal)


@dataclass(frozen=True)
class TurningCircle(_WhileSteering):
    """Diameter of the circle on which the outer front wheel rolls about a point of the rear axle's
    line: 2 wheelbase / sin outer (J. Reimpell, The Automotive Chassis, without the scrub radius,
    since the steer angle is that of the wheel itself).
    """

    type = "turning_circle"
    positive = "always"

    def of_cotangents(self, inner: Jet, outer: Jet, ratio: Jet) -> Jet:
        """Return the diameter [m]."""
        assert self.vehicle.wheelbase is not None
        return 2.0 * self.vehicle.wheelbase * sqrt(1.0 + outer * outer)


def _to_the_left(left: Corner, right: Corner) -> tuple[Jet, Jet]:
    """Return the steer angles of both wheels, positive to the left [rad]."""
    a, b = left.spin, right.spin
    return angle_in_view(-a.x, a.y), angle_in_view(b.x, b.y)


@dataclass(frozen=True)
class _AxleRollCenter(AxleOutput, Rate):
    """The kinematic roll centre: in the view from the front, the intersection of the lines from the
    contact centres to the instant centres, each wheel travelling by itself. It has no value where
    the lines are parallel.
    """

    nowhere = "the lines from the contact centres to the instant centres are parallel there"

    @property
    def problem(self) -> str:
        """Reason why there is none: a wheel has no driver of its travel. Otherwise empty."""
        if self.vehicle.travel:
            return ""
        return (
            f"found {self.type!r} without a driver of each wheel's travel, expected both. Name them"
            " by suspension.travel and suspension.other.travel"
        )

    def resting(self, at: Mapping[str, Vec3]) -> None:
        """Return None: both wheels always travel."""

    def place(self, left: Corner, right: Corner) -> tuple[Jet, Jet]:
        """Return y to the left and z of the intersection, from the middle of the body [m].

        A point P of a line satisfies v . P = v . C, v being the velocity of the contact centre C.
        """
        a, b, va, vb = (
            left.contact,
            right.contact,
            left.contact_velocity,
            right.contact_velocity,
        )
        first, second = va.y * a.y + va.z * a.z, vb.y * b.y + vb.z * b.z
        whole = va.y * vb.z + va.z * vb.y
        sizes = [v.y.x * v.y.x + v.z.x * v.z.x for v in (va, vb)]
        parallel = PARALLEL * root(sizes[0] * sizes[1])
        y = (first * vb.z - va.z * second) / whole
        z = (va.y * second + first * vb.y) / whole
        return known(whole.x, parallel, y), known(whole.x, parallel, z)


@dataclass(frozen=True)
class AxleRollCenterHeight(_AxleRollCenter):
    """Height of the roll centre above the line through both contact centres."""

    type = "axle_roll_center_height"
    positive = "above the road"

    def value(self, left: Corner, right: Corner) -> Jet:
        """Return the height [m]."""
        a, b = left.contact, right.contact
        y, z = self.place(left, right)
        along, up = a.y + b.y, a.z - b.z
        return (along * (z - a.z) - up * (y - a.y)) / sqrt(along * along + up * up)


@dataclass(frozen=True)
class AxleRollCenterOffset(_AxleRollCenter):
    """Lateral distance of the roll centre from the middle of the body, along its y axis."""

    type = "axle_roll_center_offset"
    positive = "to the left (ISO 8855), to the right (SAE J670)"

    def value(self, left: Corner, right: Corner) -> Jet:
        """Return the offset [m]."""
        y, _ = self.place(left, right)
        return self.vehicle.convention.up * y
