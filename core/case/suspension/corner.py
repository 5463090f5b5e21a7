"""A corner of the vehicle in motion: the vectors from which its outputs are computed.

All vectors are in corner axes: x forward, y outboard, z up, with the origin in the vehicle's centre
plane. A right wheel is the mirror image of a left one, and both have the same coordinates in corner
axes. One formula serves both sides, and only outputs defined by side distinguish them. For a right
wheel these axes are left-handed: a cross product changes its sign and may only be used if the sign
cancels.

All angles come from vectors: toe and camber of a turned wheel are no Euler angles of its carrier.
"""

from __future__ import annotations

from collections.abc import Mapping

from ...algebra import Scalar, Vec3, cross, vec
from ...jet import Jet, each, sqrt
from .rods_axis import rods_axis
from .vehicle import Vehicle


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

    @property
    def center(self) -> Vec3:
        """Wheel centre [m]."""
        return self.point(self.vehicle.wheel_center)

    @property
    def spin(self) -> Vec3:
        """Unit vector along the wheel's axis of rotation, outboard [-]."""
        return _unit(self.point(self.vehicle.spin_marker) - self.center)

    @property
    def heading(self) -> Vec3:
        """Unit vector along the intersection of wheel plane and road, forward [-]; z is zero."""
        s = self.spin
        level = sqrt(s.x * s.x + s.y * s.y)
        return Vec3(s.y / level, -s.x / level, 0.0)

    @property
    def aside(self) -> Vec3:
        """Unit vector in the road plane, perpendicular to the heading, outboard [-]; z is zero."""
        h = self.heading
        return Vec3(-h.y, h.x, 0.0)

    @property
    def rise(self) -> Vec3:
        """Unit vector of steepest ascent in the wheel plane [-]."""
        s = self.spin
        level = sqrt(s.x * s.x + s.y * s.y)
        return Vec3(-s.x * s.z / level, -s.y * s.z / level, level)

    @property
    def contact(self) -> Vec3:
        """Contact centre [m]: the lowest point of a disc with the wheel's radius. The road is at
        its height.
        """
        radius = self.vehicle.wheel_radius
        assert radius is not None
        return self.center - radius * self.rise

    @property
    def contact_velocity(self) -> Vec3:
        """Velocity of the wheel carrier's point at the contact centre, with the wheel locked to the
        carrier [m/s].

        Its arm from the wheel centre is -R (top.w top + third.w third), in two directions fixed to
        the carrier and perpendicular to the axis of rotation; only these turn. The third direction,
        a cross product, appears twice, so its sign cancels.
        """
        radius, w, s = self.vehicle.wheel_radius, self.rise, self.spin
        assert radius is not None
        top = _unit(self.point(self.vehicle.top_marker) - self.center)
        third = cross(s, top)
        return velocity(self.center) - radius * (
            (top @ w) * velocity(top) + (third @ w) * velocity(third)
        )

    @property
    def kingpin(self) -> tuple[Vec3, Vec3]:
        """A point of the steering axis [m], and a vector along it, upwards."""
        ends = [self.point(name) for name in self.vehicle.kingpin_points]
        if len(ends) == 2:
            lower, upper = ends
            return lower, upper - lower
        return rods_axis(self.center, ends[::2], ends[1::2])

    @property
    def kingpin_offset(self) -> Vec3:
        """Vector from the contact centre to the steering axis in the road plane [m]; z is zero."""
        lower, axis = self.kingpin
        contact = self.contact
        return lower + ((contact.z - lower.z) / axis.z) * axis - contact


def velocity(a: Vec3) -> Vec3:
    """Return the time derivative of a vector of jets."""
    return each(a, lambda jet: jet.dot)


def _unit(a: Vec3) -> Vec3:
    length: Scalar = sqrt(a @ a)
    return Vec3(a.x / length, a.y / length, a.z / length)


def distance(a: Vec3, b: Vec3) -> Jet:
    """Return the distance between two points [m]."""
    return sqrt((a - b) @ (a - b))
