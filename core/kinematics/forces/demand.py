"""Newton-Euler: the wrench demanded by a body's motion from joints and drivers, over any scalar.

M a + h - Q   for one body: force, and torque about the body's internal origin, in SI units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...algebra import ZERO, Mat3, Quat, Vec3, cross, vec
from ...mechanism.body import Body
from ...primitives.base import GROUND_POSE, GROUND_TWIST, Pose, Twist
from ..formulation.constraints import Frames
from ..formulation.formulation import Acceleration


@dataclass(frozen=True, slots=True)
class Wrench:
    """A force [N] and a torque about a body's internal origin [N m], global axes."""

    force: Vec3
    torque: Vec3

    @staticmethod
    def at(arm: Vec3, force: Vec3) -> Wrench:
        """Return the wrench of a force at the end of an arm [m]."""
        return Wrench(force, cross(arm, force))

    def __add__(self, b: Wrench) -> Wrench:
        return Wrench(self.force + b.force, self.torque + b.torque)

    def __neg__(self) -> Wrench:
        return Wrench(-self.force, -self.torque)


NO_WRENCH = Wrench(ZERO, ZERO)


@dataclass(frozen=True, eq=False)
class BodyStates:
    """Poses, twists and accelerations of the moving bodies by name, in the units of the frames."""

    frame: Frames
    poses: Mapping[str, Pose]
    twists: Mapping[str, Twist]
    accelerations: Mapping[str, Acceleration]

    def arm(self, body: str, position: Sequence[float]) -> Vec3:
        """Return the arm from a body's internal origin to a point of it, turned [m]."""
        return self.frame.unit * self._pose(body).turn(self.frame.arm(body, position))

    def place(self, body: str, position: Sequence[float]) -> Vec3:
        """Return the displacement of a point of a body since design [m]."""
        pose = self._pose(body)
        return self.frame.unit * (pose.u + pose.swing(self.frame.arm(body, position)))

    def velocity(self, body: str, position: Sequence[float]) -> Vec3:
        """Return the velocity of a point of a body [m/s]."""
        arm = self._pose(body).turn(self.frame.arm(body, position))
        return self.frame.unit * self.twists.get(body, GROUND_TWIST).of(arm)

    def spin(self, body: str) -> Vec3:
        """Return the angular velocity of a body [rad/s]."""
        return self.twists.get(body, GROUND_TWIST).w

    def turned(self, body: str, vector: Sequence[float]) -> Vec3:
        """Return a vector fixed in a body, given at design, in its current direction."""
        return self._pose(body).turn(vec(vector))

    def turn_of(self, body: str) -> Quat:
        """Return the rotation of a body since design."""
        return self._pose(body).q

    def _pose(self, body: str) -> Pose:
        return self.poses.get(body, GROUND_POSE)


def inertial(body: Body, at: BodyStates, gravity: Vec3) -> Wrench:
    """Return the demanded wrench of a body with mass: m (a - g), and I wdot + w x I w at C."""
    arm = arm_of_center(body, at)
    force = body.mass * (acceleration_of_center(body, at) - gravity)
    return Wrench(force, cross(at.frame.unit * arm, force) + spin_change(body, at))


def arm_of_center(body: Body, at: BodyStates) -> Vec3:
    """Return the arm from a body's internal origin to its centre of mass, turned [units]."""
    return at.poses[body.name].turn(at.frame.arm(body.name, body.center_of_mass or body.origin))


def acceleration_of_center(body: Body, at: BodyStates) -> Vec3:
    """Return the acceleration of a body's centre of mass [m/s^2]."""
    acceleration, twist = at.accelerations[body.name], at.twists[body.name]
    return at.frame.unit * acceleration.of(arm_of_center(body, at), twist)


def spin_change(body: Body, at: BodyStates) -> Vec3:
    """Return the change of a body's angular momentum about its centre of mass [N m].

    The body's own axes are global at design. The inertia, given at design in global axes, is
    therefore constant in them.
    """
    I = inertia_of(body)  # noqa: E741 - the field's letter
    if I is None:
        return ZERO
    pose, (w, w_t) = at.poses[body.name], spin_of(body, at)
    return pose.turn(I @ w_t + cross(w, I @ w))


def spin_of(body: Body, at: BodyStates) -> tuple[Vec3, Vec3]:
    """Return w and wdot of a body in its own axes, global at design."""
    back = at.poses[body.name].D.T
    w, w_t = at.twists[body.name].w, at.accelerations[body.name].w_t
    return w + back @ w, w_t + back @ w_t


def inertia_of(body: Body) -> Mat3 | None:
    """Return the inertia about the centre of mass at design, global axes; None for a point mass."""
    if body.inertia is None:
        return None
    xx, yy, zz, xy, yz, xz = body.inertia
    return Mat3(Vec3(xx, xy, xz), Vec3(xy, yy, yz), Vec3(xz, yz, zz))
