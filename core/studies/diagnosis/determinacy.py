"""Which directions of the joints' reactions redundant rows leave undetermined."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np

from ...case.case import Case
from ...forces import Reaction
from ...kinematics import forces_of
from ...trajectory import Array, Trajectory

# Samples to look at: the count of determined directions changes at special poses only.
SAMPLES = 9


class JointDeterminacy(msgspec.Struct, frozen=True):
    """What rigid bodies determine of a joint's reaction on its second body.

    Attributes:
        force, moment, wrench: determined directions of 3, 3 and 6, the fewest over the samples.
        force_along, moment_along: those of force and moment at the first sample, orthonormal global
            axes.
    """

    joint: str
    force: int
    moment: int
    wrench: int
    force_along: list[list[float]]
    moment_along: list[list[float]]


class Determinacy(msgspec.Struct, frozen=True):
    """What redundant rows leave undetermined, with masses or without.

    Attributes:
        joints: how many were looked at: those of the outputs, or all.
        partly: joints not wholly determined.
        efforts: drivers whose efforts are undetermined.
    """

    joints: int
    partly: list[JointDeterminacy]
    efforts: list[str]

    def __str__(self) -> str:
        if not self.partly and not self.efforts:
            return "all reactions and efforts are determined"
        efforts = f"not those of {', '.join(self.efforts)}" if self.efforts else "all"
        return (
            f"redundant rows leave {len(self.partly)} of {self.joints} reactions not wholly"
            f" determined; of the efforts {efforts} are determined"
        )


def determinacy(case: Case, motion: Trajectory) -> Determinacy:
    """Return the determinacy of the forces that outputs read, or of all without such outputs.

    Args:
        motion: poses of all moving bodies along the sweep.
    """
    mechanism, path = case.mechanism, case.sweep.path
    solved = np.flatnonzero(motion.solved)
    few = solved[np.unique(np.linspace(0, len(solved) - 1, SAMPLES).round().astype(int))]
    # what is determined depends on the pose alone: any rates serve
    still = {
        name: replace(
            each, r=each.r[few], p=each.p[few], v=np.zeros((len(few), 6)), a=np.zeros((len(few), 6))
        )
        for name, each in motion.bodies.items()
    }
    known = np.ones(len(few), np.bool_)
    poses = Trajectory({}, known, motion.iterations[few], 0.0, bodies=still)
    names = {joint.name for joint in mechanism.given_joints}
    asked = [name for name in case.forces if name in names]
    found = forces_of(mechanism, replace(path, times=path.times[few]), poses)
    joints = {name: found.joints[name] for name in asked or found.joints}
    every = [_joint(name, each) for name, each in joints.items()]
    return Determinacy(
        len(every),
        [each for each in every if each.wrench < 6],
        [name for name, effort in found.drivers.items() if not np.isfinite(effort).any()],
    )


def _joint(name: str, found: Reaction) -> JointDeterminacy:
    force, moment, wrench = found.determined()
    known = float(np.ravel(found.known)[0])
    along = [_along(part, known) for part in np.split(found.free[0], 2)]
    return JointDeterminacy(name, force, moment, wrench, *along)


def _along(free: Array, known: float) -> list[list[float]]:
    """Return the directions across all that are undetermined, shape (3, redundant rows)."""
    if not np.isfinite(free).all():
        return []
    axes, sizes, _ = np.linalg.svd(np.hstack([free, np.zeros((3, 3))]))
    return np.where(np.abs(axes) <= known, 0.0, axes)[:, sizes <= known].T.tolist()
