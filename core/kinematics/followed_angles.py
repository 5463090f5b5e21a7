"""The angle of a joint with its turns, followed along the way of the drivers from the design."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..algebra import IDENTITY, ZERO, angle_about, quat, vec
from ..joints.base import unit
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from ..primitives.base import Pose
from ..trajectory import Array, Trajectory
from .followed_way import DOUBT, Prepare, followed, near_design
from .forces.motion_lanes import Follow

TURN = 2.0 * math.pi


def in_doubt(x: Array, v: Array, times: Array) -> bool:
    """Return whether a change from sample to sample contradicts the rates by its turns.

    Args:
        x, v: angle with its turns [rad] and its rate, samples along the first axis; NaN if unknown.
    """
    known = np.isfinite(x).any(axis=tuple(range(1, x.ndim)))
    order = np.flatnonzero(known)[np.argsort(times[known], kind="stable")]
    t, x, v = times[order].reshape(-1, *(1,) * (x.ndim - 1)), x[order], v[order]
    # nothing contradicts what is unknown
    return bool((np.abs(_expected_change(v, t) - np.diff(x, axis=0)) > DOUBT).any())


def followed_angle(prepare: Prepare, mechanism: Mechanism, path: Path, joint: str) -> Array | None:
    """Return a joint's angle [rad] at the samples of a path, zero at design, turns counted on the
    way from there; shape (n,). See `followed`.
    """
    return followed(prepare, mechanism, path, _OfJoint(joint))


def follower(
    prepare: Prepare, mechanism: Mechanism, path: Path, solved: NDArray[np.bool_]
) -> Follow:
    """Return the function that corrects the turns of angles at the solved samples of a path."""

    def follow(joint: str, angle: Array, rate: Array) -> Array:
        if near_design(mechanism, path) and not in_doubt(angle, rate, path.times[solved]):
            return angle
        if (found := followed_angle(prepare, mechanism, path, joint)) is None:
            return angle
        return angle + TURN * np.round((found[solved] - angle) / TURN)

    return follow


@dataclass(frozen=True)
class _OfJoint:
    """The angle of a joint, shape ()."""

    joint: str

    @property
    def at_design(self) -> Array:
        """Zero."""
        return np.zeros(())

    def bodies(self, mechanism: Mechanism) -> tuple[str, ...]:
        """Return its two, or the one that moves."""
        moving = {body.name for body in mechanism.moving}
        return tuple(name for name in mechanism.joint(self.joint).bodies if name in moving)

    def counted(
        self, mechanism: Mechanism, times: Array, motion: Trajectory, start: float, at: Array
    ) -> tuple[Array, bool]:
        """Return the angle with its turns; see `Followed`."""
        found = np.full(len(times), np.nan)
        reached = np.flatnonzero(motion.solved)
        order = reached[np.argsort(times[reached], kind="stable")]
        if not len(order):
            return found, True
        angle, rate = _angle(mechanism, self.joint, motion)
        t, x = times[order], angle[order]
        change, expected = np.diff(x), _expected_change(rate[order], t)
        change += TURN * np.rint((expected - change) / TURN)
        smallest = change - TURN * np.rint(change / TURN)
        doubtful = np.abs(expected - change) > DOUBT
        # rates have no bound towards a fold, but short steps change little
        change[doubtful] = np.where(np.abs(smallest) > DOUBT, np.nan, smallest)[doubtful]
        first = int(np.argmin(np.abs(t - start)))
        counted = np.full(len(order), x[first] + TURN * np.rint((at - x[first]) / TURN))
        counted[first + 1 :] += np.cumsum(change[first:])
        counted[:first] -= np.cumsum(change[:first][::-1])[::-1]
        found[order] = counted
        return found, not doubtful.any()


def _angle(mechanism: Mechanism, joint: str, motion: Trajectory) -> tuple[Array, Array]:
    """Return the angle of a joint but for whole turns [rad], and its rate, shape (n,)."""
    bodies: Any = mechanism.joint(joint)
    axis = vec([*unit(bodies.axis)])
    turns, spins = [IDENTITY] * 2, [ZERO] * 2
    for k, name in enumerate(bodies.bodies):
        if (moved := motion.bodies.get(name)) is None:
            continue
        assert moved.v is not None
        pose = quat(moved.p.T)
        turns[k] = pose * quat(mechanism.body(name).euler_parameters).conjugate()
        spins[k] = Pose.of(ZERO, pose).turn(vec([*moved.v.T[3:]]))
    i, j = turns
    rate = Pose.of(ZERO, i).turn(axis) @ (spins[1] - spins[0])
    still = np.zeros(len(motion.solved))
    return angle_about(axis, i.conjugate() * j) + still, rate + still


def _expected_change(rate: Array, times: Array) -> Array:
    """Return the changes between samples that the rates tell [rad]."""
    return 0.5 * (rate[1:] + rate[:-1]) * np.diff(times, axis=0)
