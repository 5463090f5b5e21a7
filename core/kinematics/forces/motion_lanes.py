"""A solved motion as lanes of samples, in the variables of the equations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from ...algebra import ZERO, angle_about, cross, quat, vec
from ...errors import SolveError
from ...joints.base import unit
from ...mechanism.drivers import JointDriver
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...primitives.base import GROUND_POSE, Pose, Twist
from ...trajectory import Array, Trajectory
from ..formulation.constraints import frames
from ..formulation.formulation import Acceleration
from ..formulation.state_vectors import displaced
from .demand import BodyStates
from .elements import Applied, at_work

Follow: TypeAlias = Callable[[str, Array, Array], Array]
"""Returns the angle of a joint with all its turns, of its name, its angle counted by rates and its
rate at the solved samples [rad, rad/s].
"""


class MotionLanes:
    """The motion at the solved samples: states of the bodies and of force elements, as lanes.

    Attributes:
        frame, times, n: frames of the mechanism, times of the solved samples [s], and their number.
        poses: poses of the moving bodies.
        at: poses, twists and accelerations.
        drive: value from design, velocity and acceleration of every driver [SI], shape
            (3, drivers, n).
        values, rates: value from design and velocity, by driver.
        applied: force elements at work, by name.

    Raises:
        SolveError: the motion lacks a body or its accelerations.
    """

    def __init__(
        self, mechanism: Mechanism, path: Path, motion: Trajectory, follow: Follow | None = None
    ) -> None:
        self._follow = follow
        self.mechanism, self.frame = mechanism, frames(mechanism)
        solved = motion.solved
        self.times: Array = path.times[solved]
        self.n = len(self.times)
        self.poses = self._poses(motion)
        self.at = self._states(motion)
        names = [driver.name for driver in mechanism.drivers]
        self.drive = path.drive(names, self.times) if names else np.empty((3, 0, self.n))
        self.rates = dict(zip(names, self.drive[1], strict=True))
        self.values = dict(zip(names, self.drive[0], strict=True))
        self.applied: Mapping[str, Applied] = at_work(mechanism, self.at, self.angle)

    def _poses(self, motion: Trajectory) -> dict[str, Pose]:
        missing = [body.name for body in self.mechanism.moving if body.name not in motion.bodies]
        if missing:
            raise SolveError(f"forces: the motion of body {missing[0]!r} is missing")
        placed = {
            name: (each.r[motion.solved], each.p[motion.solved])
            for name, each in motion.bodies.items()
        }
        return displaced(self.mechanism, self.frame, placed)

    def _states(self, motion: Trajectory) -> BodyStates:
        solved = motion.solved
        twists, accelerations = dict[str, Twist](), dict[str, Acceleration]()
        for body in self.mechanism.moving:
            moved = motion.bodies[body.name]
            if moved.v is None or moved.a is None:
                raise SolveError(f"forces: body {body.name!r} has no accelerations; give order 2")
            frame = Pose.of(ZERO, quat(moved.p[solved].T))
            v, a = moved.v[solved].T, moved.a[solved].T
            w, w_t = frame.turn(vec([*v[3:]])), frame.turn(vec([*a[3:]]))
            arm = self.poses[body.name].turn(self.frame.arm(body.name, body.origin))
            per_unit = 1.0 / self.frame.unit
            twists[body.name] = Twist(per_unit * vec([*v[:3]]) - cross(w, arm), w)
            # the origin's acceleration, less the part of the arm from the internal origin
            added = Acceleration(ZERO, w_t).of(arm, twists[body.name])
            accelerations[body.name] = Acceleration(per_unit * vec([*a[:3]]) - added, w_t)
        return BodyStates(self.frame, self.poses, twists, accelerations)

    def angle(self, name: str) -> Array:
        """Return the angle of a joint over the samples [rad], continuous, zero at design.

        The angle of a driven joint, or of a joint geared to one, is exact. Other angles follow the
        rates from the sample nearest to the design, and `follow` corrects their turns.
        """
        known = self._driven.get((name, "rotation"))
        if known is not None or not self.n:
            return np.zeros(0) if known is None else known
        joint: Any = self.mechanism.joint(name)
        i, j = (self.poses.get(body, GROUND_POSE) for body in joint.bodies)
        axis = vec([*unit(joint.axis)])
        order = np.argsort(self.times, kind="stable")
        angle: Array = (angle_about(axis, i.q.conjugate() * j.q) + np.zeros(self.n))[order]
        spin = self.at.spin(joint.j) - self.at.spin(joint.i)
        along = self.at.turned(joint.i, [*unit(joint.axis)])
        rate: Array = (along @ spin + np.zeros(self.n))[order]
        expected = 0.5 * (rate[1:] + rate[:-1]) * np.diff(self.times[order])
        jumps: Array = np.round((expected - np.diff(angle)) / (2.0 * np.pi))
        turned = angle.copy()
        turned[1:] += 2.0 * np.pi * np.cumsum(jumps)
        nearest = float(turned[int(np.argmin(np.abs(self.times[order])))])
        continuous, rates = np.empty(self.n), np.empty(self.n)
        continuous[order] = turned - 2.0 * np.pi * round(nearest / (2.0 * np.pi))
        rates[order] = rate
        return self._follow(name, continuous, rates) if self._follow else continuous

    @cached_property
    def _driven(self) -> Mapping[tuple[str, str], Array]:
        """Return coordinates given by drivers or their couplers: joint and freedom -> value."""
        found: dict[tuple[str, str], Array] = {
            (each.joint, each.freedom): self.values[each.name]
            for each in self.mechanism.drivers
            if isinstance(each, JointDriver)
        }
        for _ in self.mechanism.couplers:  # a chain is as long as their number
            for coupler in self.mechanism.couplers:
                if coupler.curve:  # not linear: the rates give the angles of its joints
                    continue
                terms = coupler.terms
                for (one, freedom, a), (other, its, b) in (terms, terms[::-1]):
                    if (one, freedom) in found:
                        found.setdefault((other, its), -a / b * found[one, freedom])
        return found
