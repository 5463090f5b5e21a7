"""A corner of the vehicle in motion: the vectors from which its outputs are computed.

All vectors are in corner axes: x forward, y outboard, z up, with the origin in the vehicle's centre
plane. A right wheel is the mirror image of a left one, and both have the same coordinates in corner
axes. One formula serves both sides, and only outputs defined by side distinguish them. For a right
wheel these axes are left-handed: a cross product changes its sign and may only be used if the sign
cancels.

All angles come from vectors: toe and camber of a turned wheel are no Euler angles of its carrier.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TypeAlias

import numpy as np

from ...algebra import Scalar, Vec3, cross, vec
from ...jet import Jet, arctan2, doubles, each, norm, sqrt, where
from ...trajectory import Array
from .vehicle import Vehicle

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
        return where(doubles(level) > PARALLEL, level)

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
        w, s = self.rise, self.spin
        beside = self.point(self.vehicle.top_marker) - self.center
        top = _unit(beside - (beside @ s) * s)
        third = cross(s, top)
        return velocity(self.center) - self.radius * (
            (top @ w) * velocity(top) + (third @ w) * velocity(third)
        )

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
        size = doubles(norm(axis, 0.0))
        rise = where(np.abs(doubles(axis.z)) > PARALLEL * size, axis.z)
        return lower + ((contact.z - lower.z) / rise) * axis - contact


def angle_in_view(y: Jet, x: Jet, size: Array | float = 1.0) -> Jet:
    """Return the angle of a direction in a view [rad], in -pi..pi; NaN where the direction is that
    of the view itself.

    Half a turn is positive: engines that agree but for round-off must not differ by a whole turn.

    Args:
        size: length of the direction, its component along the view included.
    """
    angle, seen = arctan2(y, x), np.hypot(doubles(x), doubles(y))
    if np.asarray(angle.x).dtype != object:  # a proved number ends here
        angle += np.where(angle.x < HALF_TURN - np.pi, 2.0 * np.pi, 0.0)
    return where(seen > PARALLEL * size, angle)


def velocity(a: Vec3) -> Vec3:
    """Return the time derivative of a vector of jets."""
    return each(a, lambda jet: jet.dot)


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
