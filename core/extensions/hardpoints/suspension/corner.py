"""A corner of the vehicle: its data and signs, and in motion the vectors from which its outputs are
computed.

Vectors in motion are in corner axes: x forward, y outboard, z up, with the origin in the vehicle's
centre plane. A right wheel is the mirror image of a left one, and both have the same coordinates in
corner axes. One formula serves both sides, and only outputs defined by side distinguish them. For a
right wheel these axes are left-handed: a cross product changes its sign and may only be used if the
sign cancels.

All angles come from vectors: toe and camber of a turned wheel are no Euler angles of its carrier.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property, reduce
from typing import TypeAlias

from ....algebra import Scalar, Vec3, cross, is_array, vec
from ....case.case import MARKER
from ....case.quantity import Convention
from ....jet import Jet, arctan2, choose, each, known, norm, sqrt
from ....mechanism.mechanism import Mechanism, Vector

# Distance from the wheel centre to the markers on the wheel carrier [m]: a rim's radius, so
# directions keep all digits of positions.
MARKER_DISTANCE = 0.25


class Side(StrEnum):
    """Side of the wheel, seen by the driver."""

    LEFT = "left"
    RIGHT = "right"

    @property
    def left(self) -> int:
        """Factor from an outboard component to one to the left."""
        return 1 if self is Side.LEFT else -1


class Axle(StrEnum):
    """Axle of the wheel."""

    FRONT = "front"
    REAR = "rear"


class Reaction(StrEnum):
    """Support of the torque of brakes or drive: the wheel carrier, or the vehicle's body."""

    OUTBOARD = "outboard"
    INBOARD = "inboard"


@dataclass(frozen=True, kw_only=True)
class Vehicle:
    """One wheel's corner of a vehicle, in SI units and global axes at design. None is unknown and
    not needed.

    Attributes:
        forward, up: perpendicular unit vectors fixed to the vehicle's body [-].
        wheel_center: name of the point.
        static_toe, static_camber: angles at design [rad], as defined in `wheel`.
        wheel_axis: name of a point of the carrier on the axis of rotation, outboard of the centre,
            instead of both angles.
        middle: a point of the vehicle's centre plane [m].
        wheel_radius: loaded, from the wheel centre to the contact centre in the wheel plane [m].
        wheel_contact: name of a point of the carrier at this distance from the wheel centre, which
            variants of the design may move.
        kingpin: names of the lower and the upper point of the steering axis; or of the ends of four
            rods, on the body and on the wheel carrier each: the axis is then that of the screw
            about which the wheel turns when the fifth rod moves and the height of its centre is
            held.
        cg_height: height of the centre of gravity above the road [m].
        rack_per_turn: travel of the rack per turn of the steering wheel [m].
        travel: driver of the wheel's travel, if other drivers move too, and that of the axle's
            other wheel if there is one: derivatives by travel move these alone, and hold the
            others. Empty: derivatives are along the sweep.
        brake_share, drive_share: parts of the vehicle's braking and driving force at this axle [-].
    """

    convention: Convention
    side: Side
    forward: Vector
    up: Vector
    wheel_center: str
    static_toe: float = 0.0
    static_camber: float = 0.0
    wheel_axis: str | None = None
    middle: Vector = (0.0, 0.0, 0.0)
    axle: Axle | None = None
    wheel_radius: float | None = None
    wheel_contact: str | None = None
    kingpin: tuple[str, str] | tuple[tuple[str, str], ...] | None = None
    wheelbase: float | None = None
    cg_height: float | None = None
    rack_per_turn: float | None = None
    brakes: Reaction = Reaction.OUTBOARD
    brake_share: float | None = None
    drive: Reaction = Reaction.INBOARD
    drive_share: float | None = None
    travel: tuple[str, ...] = ()

    @property
    def kingpin_points(self) -> tuple[str, ...]:
        """Names of the points that define the steering axis."""
        return tuple(
            name
            for each in self.kingpin or ()
            for name in ((each,) if isinstance(each, str) else each)
        )

    @property
    def outboard(self) -> Vec3:
        """Global unit vector to the left or to the right, away from the centre plane."""
        return self.side.left * cross(vec(self.up), vec(self.forward))

    def spin(self, mechanism: Mechanism) -> Vec3:
        """Return the global unit vector along the wheel's axis of rotation at design, outboard."""
        if self.wheel_axis is None:
            toe, camber = self.static_toe, self.static_camber
            level = math.sin(toe) * vec(self.forward) + math.cos(toe) * self.outboard
            return math.cos(camber) * level + -math.sin(camber) * vec(self.up)
        along = self._arm(mechanism, self.wheel_axis)
        return (1.0 / math.sqrt(along @ along)) * along

    def radius(self, mechanism: Mechanism) -> float | None:
        """Return the wheel's radius at design [m]; None if unknown."""
        if self.wheel_contact is None:
            return self.wheel_radius
        ends = (mechanism.point(name) for name in (self.wheel_center, self.wheel_contact))
        return math.dist(*(end.position for end in ends))

    def aside(self, mechanism: Mechanism) -> float:
        """Return how far outboard of the wheel centre the point of the axis is at design [m]."""
        assert self.wheel_axis is not None
        return self.outboard @ self._arm(mechanism, self.wheel_axis)

    def _arm(self, mechanism: Mechanism, point: str) -> Vec3:
        center = mechanism.point(self.wheel_center).position
        return vec(mechanism.point(point).position) - vec(center)

    @property
    def spin_marker(self) -> str:
        """Name of the carrier's point on the axis of rotation, outboard of the wheel centre."""
        return self.wheel_axis or f"{MARKER}{self.wheel_center}.spin"

    @property
    def top_marker(self) -> str:
        """Name of a point of the carrier beside the axis of rotation, above or below the centre."""
        return self.wheel_contact or f"{MARKER}{self.wheel_center}.top"

    def markers(self, mechanism: Mechanism) -> dict[str, Vector]:
        """Return the positions of the points that the mechanism lacks at design, by name [m]."""
        sides = dict[str, Vec3]()
        if self.wheel_axis is None:
            sides[self.spin_marker] = self.spin(mechanism)
        if self.wheel_contact is None:
            sides[self.top_marker] = vec(self.up)
        center = vec(mechanism.point(self.wheel_center).position)
        places = {name: center + MARKER_DISTANCE * along for name, along in sides.items()}
        return {name: (at.x, at.y, at.z) for name, at in places.items()}

    @property
    def signs(self) -> str:
        """Convention, wheel and axes in words, for the head of each table of these outputs."""
        where = f"{self.axle} {self.side}" if self.axle else str(self.side)
        forward, up = (", ".join(f"{x:g}" for x in axis) for axis in (self.forward, self.up))
        return (
            f"{self.convention.words}; {where} wheel; forward is [{forward}] and up [{up}] in the"
            " case's axes"
        )


_Column: TypeAlias = Sequence[Jet]
# Lines of less than this angle to each other, or to a plane, have no intersection of use [rad], and
# a direction as near to that of a view has no angle there: ten digits are left of them.
PARALLEL = 1e-4
# Angles this near to minus half a turn are plus half a turn [rad]: a thousand residuals.
HALF_TURN = 1e-9


class Corner:
    """The wheel, its carrier and its steering axis as jets over the samples, in corner axes [m].

    Args:
        at: global positions by name; only the points used by the output are required.
    """

    def __init__(self, vehicle: Vehicle, at: Mapping[str, Vec3]) -> None:
        self.vehicle = vehicle
        self._at = at
        self._axes = vec(vehicle.forward), vehicle.outboard, vec(vehicle.up)

    def point(self, name: str) -> Vec3:
        """Return the position of a point [m]."""
        arm = self._at[name] - vec(self.vehicle.middle)
        x, y, z = (axis @ arm for axis in self._axes)
        return Vec3(x, y, z)

    @cached_property
    def center(self) -> Vec3:
        """Wheel centre [m]."""
        return self.point(self.vehicle.wheel_center)

    @cached_property
    def spin(self) -> Vec3:
        """Unit vector along the wheel's axis of rotation, outboard [-]."""
        return _unit(self.point(self.vehicle.spin_marker) - self.center)

    @cached_property
    def _level(self) -> Jet:
        """Length of the spin's projection on the road [-]; NaN for a wheel on its side."""
        s = self.spin
        level = sqrt(s.x * s.x + s.y * s.y)
        return known(level.x, PARALLEL, level)

    @cached_property
    def heading(self) -> Vec3:
        """Unit vector along the intersection of wheel plane and road, forward [-]; z is zero."""
        s, level = self.spin, self._level
        return Vec3(s.y / level, -s.x / level, 0.0)

    @cached_property
    def aside(self) -> Vec3:
        """Unit vector in the road plane, perpendicular to the heading, outboard [-]; z is zero."""
        h = self.heading
        return Vec3(-h.y, h.x, 0.0)

    @cached_property
    def rise(self) -> Vec3:
        """Unit vector of steepest ascent in the wheel plane [-]."""
        s, level = self.spin, self._level
        return Vec3(-s.x * s.z / level, -s.y * s.z / level, level)

    @cached_property
    def radius(self) -> Scalar:
        """The wheel's radius [m]."""
        if self.vehicle.wheel_contact is not None:
            return distance(self.point(self.vehicle.wheel_contact), self.center)
        assert self.vehicle.wheel_radius is not None
        return self.vehicle.wheel_radius

    @cached_property
    def contact(self) -> Vec3:
        """Contact centre [m]: the lowest point of a disc with the wheel's radius. The road is at
        its height.
        """
        return self.center - self.radius * self.rise

    @cached_property
    def contact_velocity(self) -> Vec3:
        """Velocity of the wheel carrier's point at the contact centre, with the wheel locked to the
        carrier [m/s].

        Its arm from the wheel centre is -R (top.w top + third.w third), in two directions fixed to
        the carrier and perpendicular to the axis of rotation; only these turn. The third direction,
        a cross product, appears twice, so its sign cancels.
        """
        w = self.rise
        _, top, third = self._axes_of_carrier
        return velocity(self.center) - self.radius * (
            (top @ w) * velocity(top) + (third @ w) * velocity(third)
        )

    @cached_property
    def _axes_of_carrier(self) -> tuple[Vec3, Vec3, Vec3]:
        """Three perpendicular unit vectors fixed to the wheel carrier, the first along the spin."""
        s = self.spin
        beside = self.point(self.vehicle.top_marker) - self.center
        top = _unit(beside - (beside @ s) * s)
        return s, top, cross(s, top)

    @cached_property
    def roll(self) -> Jet:
        """Rate of turn of the carrier in the view from the front, from outboard to up [rad/s]."""
        return _sum(velocity(axis).z * axis.y for axis in self._axes_of_carrier)

    @cached_property
    def pitch(self) -> Jet:
        """Rate of turn of the carrier in the view from the side, from up to forward [rad/s]."""
        return _sum(velocity(axis).x * axis.z for axis in self._axes_of_carrier)

    @cached_property
    def kingpin(self) -> tuple[Vec3, Vec3]:
        """A point of the steering axis [m], and a vector along it, upwards."""
        ends = [self.point(name) for name in self.vehicle.kingpin_points]
        if len(ends) == 2:
            lower, upper = ends
            return lower, upper - lower
        return rods_axis(self.center, ends[::2], ends[1::2])

    @cached_property
    def kingpin_offset(self) -> Vec3:
        """Vector from the contact centre to the steering axis in the road plane [m]; z is zero. It
        is NaN for an axis parallel to the road.
        """
        lower, axis = self.kingpin
        contact = self.contact
        rise = known(axis.z.x, PARALLEL * norm(axis, 0.0).x, axis.z)
        return lower + ((contact.z - lower.z) / rise) * axis - contact


def angle_in_view(y: Jet, x: Jet, size: Scalar = 1.0) -> Jet:
    """Return the angle of a direction in a view [rad], in -pi..pi; NaN where the direction is that
    of the view itself.

    Half a turn is positive: engines that agree but for round-off must not differ by a whole turn.

    Args:
        size: length of the direction, its component along the view included.
    """
    angle, limit = arctan2(y, x), PARALLEL * size
    if not (is_array(angle.x) and angle.x.dtype == object):  # proofs end here
        # minus half a turn, but for a margin, is farther from a quarter than any other angle
        beyond = angle.x - 0.5 * math.pi
        angle = choose(beyond, 1.5 * math.pi - HALF_TURN, angle + 2.0 * math.pi, angle)
    return known(y.x * y.x + x.x * x.x, limit * limit, angle)


def velocity(a: Vec3) -> Vec3:
    """Return the time derivative of a vector of jets."""
    return each(a, lambda jet: jet.dot)


def _sum(parts: Iterable[Jet]) -> Jet:
    return reduce(operator.add, parts)


def _unit(a: Vec3) -> Vec3:
    length: Scalar = sqrt(a @ a)
    return Vec3(a.x / length, a.y / length, a.z / length)


def distance(a: Vec3, b: Vec3) -> Jet:
    """Return the distance between two points [m]."""
    return sqrt((a - b) @ (a - b))


def rods_axis(center: Vec3, inner: Sequence[Vec3], outer: Sequence[Vec3]) -> tuple[Vec3, Vec3]:
    """Return the point of the axis nearest to the wheel centre [m], and a vector along it, with z =
    1.

    A rod along d with its outer end at r from the centre keeps its length if d . v + (r x d) . w =
    0, v being the velocity of the centre and w that of rotation. Four rods, v_z = 0 and w_z = 1
    leave four equations for v_x, v_y, w_x and w_y. The axis of a screw is at w x v / (w . w) from
    the centre.

    Args:
        inner, outer: ends of the four rods, in corner axes [m].
    """
    along = [b - a for a, b in zip(inner, outer, strict=True)]
    arms = [cross(b - center, d) for b, d in zip(outer, along, strict=True)]
    columns: list[_Column] = [
        [each.x for each in along],
        [each.y for each in along],
        [each.x for each in arms],
        [each.y for each in arms],
    ]
    right = [-each.z for each in arms]
    whole = _determinant(columns)
    # Cramer's rule: jets allow no pivoting
    v_x, v_y, w_x, w_y = (
        _determinant([*columns[:k], right, *columns[k + 1 :]]) / whole for k in range(4)
    )
    w, v = Vec3(w_x, w_y, whole / whole), Vec3(v_x, v_y, 0.0)
    x, y, z = cross(w, v)
    square = w @ w
    return center + Vec3(x / square, y / square, z / square), w


def _determinant(columns: Sequence[_Column]) -> Jet:
    """Return the determinant of four columns, by pairs of minors of two columns each (Laplace)."""
    a, b, c, d = columns

    def minor(p: _Column, q: _Column, i: int, j: int) -> Jet:
        return p[i] * q[j] - p[j] * q[i]

    rows = ((0, 1, 2, 3), (0, 3, 1, 2), (2, 3, 0, 1), (1, 2, 0, 3))
    odd = ((0, 2, 1, 3), (1, 3, 0, 2))
    total = [minor(a, b, i, j) * minor(c, d, k, m) for i, j, k, m in rows]
    less = [minor(a, b, i, j) * minor(c, d, k, m) for i, j, k, m in odd]
    return total[0] + total[1] + total[2] + total[3] - less[0] - less[1]
