"""The truth of a case for steppers: points and energy over time, from the free motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from ...algebra import quat, rotation_less_identity
from ...case.case import TIME, Case
from ...errors import KincheckError
from ...forces import Reaction
from ...mechanism.body import inertia_matrix
from ...mechanism.loads import SpringDamper
from ...mechanism.mechanism import Mechanism
from ...trajectory import Array
from ..free.free_dynamics import free_motion
from ..free.section import free_in
from .results import TruthFacts


@dataclass(frozen=True, eq=False)
class Frames:
    """The frame of a body that is the global one at design, over n samples, global axes.

    Attributes:
        x: origin [m], shape (n, 3).
        R: rotation, shape (n, 3, 3).
        w: angular velocity [rad/s], shape (n, 3).
        v: velocity of the origin [m/s], shape (n, 3).
    """

    x: Array
    R: Array
    w: Array
    v: Array

    def at(self, point: Sequence[float]) -> tuple[Array, Array]:
        """Return positions and velocities of a point given at design, shape (n, 3) each."""
        arm = self.R @ np.array(point)
        return self.x + arm, self.v + np.cross(self.w, arm)


@dataclass(frozen=True, eq=False)
class Truth:
    """The free motion of a case at its samples.

    Attributes:
        frames: by moving body.
        energy: of motion, weight and springs [J], shape (n,).
        reactions: of the joints: force of the first body on the second [N], and the direction left
            open by redundant rows, zero without one; shape (n, joints, 6). NaN if more are open.
    """

    case: Case
    times: Array
    frames: Mapping[str, Frames]
    energy: Array
    reactions: Array
    facts: TruthFacts

    @property
    def twists(self) -> dict[str, Array]:
        """Angular velocities and velocities of the origin at the start, by body, shape (6,)."""
        return {name: np.concatenate([at.w[0], at.v[0]]) for name, at in self.frames.items()}

    def tables(self, points: Sequence[Mapping[str, Any]], samples: int) -> dict[str, str]:
        """Return the first samples as CSV by file, SI units: time, energy and the positions of
        points; reactions.
        """
        heads = [TIME, "energy", *(f"{each['name']}.{axis}" for each in points for axis in "xyz")]
        places = [self.frames[each["body"]].at(each["position"])[0] for each in points]
        rows = np.hstack([self.times[:, None], self.energy[:, None], *places])
        parts = [*(f"force {axis}" for axis in "xyz"), *(f"open {axis}" for axis in "xyz")]
        joints = [f"{joint.name} {part}" for joint in self.case.mechanism.joints for part in parts]
        return {
            "truth.csv": _csv(heads, rows[:samples]),
            "reactions.csv": _csv(joints, self.reactions.reshape(len(rows), -1)[:samples]),
        }


def truth_of(case: Case) -> Truth:
    """Return the truth of a case with [free].

    Raises:
        KincheckError: it has no [free], or no free motion.
    """
    free = free_in(case)
    if free is None:
        raise KincheckError(
            f"case {case.name!r} says no duration and samples of its free motion; add [free] with"
            " duration and samples"
        )
    begin, mechanism = perf_counter(), case.mechanism
    found = free_motion(mechanism, np.linspace(0.0, free.duration, free.samples), free.rates)
    frames = dict[str, Frames]()
    for name, body in found.motion.bodies.items():
        assert body.v is not None
        r, p, v = (each[found.samples] for each in (body.r, body.p, body.v))
        rows = np.array([[*row] for row in rotation_less_identity(quat(p.T))])
        rotation = np.eye(3) + np.moveaxis(rows, 2, 0)
        turned = rotation @ rotation[0].T
        w = np.einsum("nij,nj->ni", rotation, v[:, 3:])
        arm = turned @ r[0]
        frames[name] = Frames(r - arm, turned, w, v[:, :3] - np.cross(w, arm))
    points = len(mechanism.points) + sum(
        not mechanism.is_fixed(body) for joint in mechanism.joints for body in joint.bodies
    )
    forces = found.forces([joint.name for joint in mechanism.joints]).joints
    reactions = np.stack(
        [_determined(forces[joint.name], found.samples) for joint in mechanism.joints], axis=1
    )
    facts = TruthFacts(
        case=case.name,
        source=case.source,
        duration=float(found.times[-1]),
        samples=len(found.times),
        error=found.error,
        energy=found.energy_error,
        freedoms=found.freedoms,
        redundant=found.redundant,
        method=found.method,
        points=points,
        forces=bool(np.isfinite(reactions).any()),
        seconds=perf_counter() - begin,
        message=found.message,
    )
    energy = _energy(mechanism, frames)
    return Truth(case, found.times, frames, energy, reactions, facts)


def _determined(reaction: Reaction, samples: Any) -> Array:
    """Return the force at samples, and its open direction; see `Truth.reactions`."""
    u, sizes, _ = np.linalg.svd(np.pad(reaction.free[samples, :3], ((0, 0), (0, 0), (0, 1))))
    count = (sizes > np.broadcast_to(reaction.known, reaction.force.shape[:1])[samples, None]).sum(
        1
    )
    found = np.hstack([reaction.force[samples], u[:, :, 0]])
    found[count == 0, 3:] = 0.0
    found[count > 1] = np.nan
    return found


def _csv(heads: Sequence[str], rows: Array) -> str:
    quoted = ",".join(f'"{name}"' for name in heads)
    return "\n".join([quoted, *(",".join(map(repr, row)) for row in rows.tolist())]) + "\n"


def _energy(mechanism: Mechanism, frames: Mapping[str, Frames]) -> Array:
    total: Any = 0.0
    for body in mechanism.moving:
        if body.mass == 0.0:
            continue
        at = frames[body.name]
        place, speed = at.at(body.center)
        total = total + body.mass * (0.5 * (speed**2).sum(axis=1) - place @ [*mechanism.gravity])
        if body.inertia is not None:
            own = np.einsum("nji,nj->ni", at.R, at.w)
            total = total + 0.5 * np.einsum("ni,ij,nj->n", own, inertia_matrix(body.inertia), own)
    for each in mechanism.forces:
        if isinstance(each, SpringDamper):
            first, second = (
                frames[name].at(point)[0] if name in frames else np.array(point)
                for name, point in zip(each.bodies, each.points, strict=True)
            )
            assert each.free_length is not None
            stretch = np.linalg.norm(second - first, axis=-1) - each.free_length
            total = total + 0.5 * each.stiffness * stretch**2
    return np.asarray(total, dtype=np.float64)
