"""A corner of the vehicle in motion: the vectors of which its outputs are made.

Everything is in corner axes: x forward, y outboard, z up, the origin in the vehicle's centre plane.
A right wheel is the mirror image of a left one, and in corner axes both have the same coordinates:
one formula serves both, and left and right cannot be told apart but by the outputs that mean to.
For a right wheel these axes are left-handed: a cross product in them has the other sign, so it may
only be used where that cancels.

All angles come from vectors: toe and camber of a turned wheel are no Euler angles of its carrier.
"""

from __future__ import annotations

from collections.abc import Mapping

from ...algebra import Scalar, Vec3, cross, vec
from ...jet import Jet, each, sqrt
from .vehicle import Vehicle


class Corner:
    """The wheel, its carrier and its steering axis as jets over the samples, corner axes [m].

    Args:
        at: global positions by name; of those, only what an output asks for needs to be there.
    """

    def __init__(self, vehicle: Vehicle, at: Mapping[str, Vec3]) -> None:
        self.vehicle = vehicle
        self._at = at
        self._axes = vec(vehicle.forward), vehicle.outboard, vec(vehicle.up)

    def point(self, name: str) -> Vec3:
        """A point [m]."""
        arm = self._at[name] - vec(self.vehicle.middle)
        x, y, z = (axis @ arm for axis in self._axes)
        return Vec3(x, y, z)

    @property
    def center(self) -> Vec3:
        """The wheel centre [m]."""
        return self.point(self.vehicle.wheel_center)

    @property
    def spin(self) -> Vec3:
        """Unit vector along the wheel's axis of rotation, outboard [-]."""
        return _unit(self.point(self.vehicle.spin_marker) - self.center)

    @property
    def heading(self) -> Vec3:
        """Unit vector along the intersection of the wheel plane with the road, forward [-]; z is
        zero.
        """
        s = self.spin
        level = sqrt(s.x * s.x + s.y * s.y)
        return Vec3(s.y / level, -s.x / level, 0.0)

    @property
    def aside(self) -> Vec3:
        """Unit vector in the road plane at right angles to the heading, outboard [-]; z is zero."""
        h = self.heading
        return Vec3(-h.y, h.x, 0.0)

    @property
    def rise(self) -> Vec3:
        """Unit vector in the wheel plane that goes up the steepest way [-]."""
        s = self.spin
        level = sqrt(s.x * s.x + s.y * s.y)
        return Vec3(-s.x * s.z / level, -s.y * s.z / level, level)

    @property
    def contact(self) -> Vec3:
        """The contact centre [m]: the lowest point of a disc with the wheel's radius. The road is
        level with it.
        """
        radius = self.vehicle.wheel_radius
        assert radius is not None
        return self.center - radius * self.rise

    @property
    def contact_velocity(self) -> Vec3:
        """Velocity of the wheel carrier's point that is at the contact centre, the wheel locked to
        its carrier [m/s].

        Its arm from the wheel centre is -R (top.w top + third.w third) in directions fixed to the
        carrier, at right angles to the axis of rotation; only these turn. The third direction, a
        cross product, is there twice, so its sense cancels.
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
        """The lower point of the steering axis [m], and the way from there to the upper one [m]."""
        assert self.vehicle.kingpin is not None
        lower, upper = (self.point(name) for name in self.vehicle.kingpin)
        return lower, upper - lower

    @property
    def kingpin_offset(self) -> Vec3:
        """The vector from the contact centre to where the steering axis meets the road [m]; z is
        zero.
        """
        lower, axis = self.kingpin
        contact = self.contact
        return lower + ((contact.z - lower.z) / axis.z) * axis - contact


def velocity(a: Vec3) -> Vec3:
    """The derivative of a vector of jets by time."""
    return each(a, lambda jet: jet.dot)


def _unit(a: Vec3) -> Vec3:
    length: Scalar = sqrt(a @ a)
    return Vec3(a.x / length, a.y / length, a.z / length)


def distance(a: Vec3, b: Vec3) -> Jet:
    """Between two points [m]."""
    return sqrt((a - b) @ (a - b))
