"""The branch of a configuration, as signs against the design position.

The sign of the determinant of the rows changes only at singular poses. It is one sign for the whole
mechanism. A triple product at every joint distinguishes further: of the directions to the far
joints of its two bodies and its axis (the two bends of an elbow, the two windings of a rod around
its neighbours).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...algebra import Vec3, cross, vec
from ...joints import Joint
from ...joints.base import unit
from ...mechanism.mechanism import Mechanism
from ...primitives.base import GROUND_POSE, Pose
from ..formulation.cartesian import Cartesian
from ..formulation.constraints import Frames
from ..formulation.state_vectors import jacobian, state_of
from ..structure.redundancy import independent_rows

# A normalised triple product below this at design (half a degree) has no sign that rounding of a
# table would not change.
FLAT = 1e-2
# Below this part of the largest singular value, the sign of the determinant is round-off.
SINGULAR = 1e-12


@dataclass(frozen=True)
class Triple:
    """a x b . n, of vectors on the joint's first body i and second body j, now against design.

    Attributes:
        n: normal on body i; None: the vector from the joint's point on i to its point on j, now.
        ends: arms of the joint's points on i and on j, from their origins.
    """

    i: str
    j: str
    a: Vec3
    b: Vec3
    n: Vec3 | None
    ends: tuple[Vec3, Vec3]
    origins: tuple[Vec3, Vec3]

    def value(self, poses: Mapping[str, Pose]) -> float:
        """The triple product of unit vectors [-]."""
        i, j = poses.get(self.i, GROUND_POSE), poses.get(self.j, GROUND_POSE)
        if self.n is None:
            points = (
                o + pose.u + pose.turn(end)
                for o, pose, end in zip(self.origins, (i, j), self.ends, strict=True)
            )
            first, second = points
            n = second - first
        else:
            n = i.turn(self.n)
        sizes = [float(np.sqrt(v @ v)) for v in (self.a, self.b, n)]
        return float(cross(i.turn(self.a), j.turn(self.b)) @ n) / max(float(np.prod(sizes)), 1e-300)


@dataclass(frozen=True, eq=False)
class Branches:
    """The signs of the branch of a configuration.

    Attributes:
        triples: by joint; a joint in one line or plane with its neighbours at design has none.
    """

    mechanism: Mechanism
    frame: Frames
    formulation: Cartesian
    values: Mapping[str, float]
    kept: Sequence[int]
    orientation: float
    triples: Mapping[str, Triple]

    @staticmethod
    def of(mechanism: Mechanism, frame: Frames, values: Mapping[str, float]) -> Branches:
        """The branches of a mechanism whose drivers have these values, from design."""
        formulation = Cartesian.of(mechanism, frame)
        matrix = jacobian(formulation)
        kept = independent_rows(matrix, len(mechanism.drivers), formulation.conditions)
        triples = {
            joint.name: triple
            for joint in mechanism.joints
            if (triple := _triple(mechanism, frame, joint)) is not None
        }
        return Branches(
            mechanism, frame, formulation, values, kept, _orientation(matrix[kept]), triples
        )

    def at(self, poses: Mapping[str, Pose]) -> tuple[float, int, dict[str, int]]:
        """Smallest singular value of all rows, orientation, and signs by joint; see `Assembly`."""
        state = state_of(self.formulation, self.mechanism, self.frame, poses, self.values)
        matrix = jacobian(self.formulation, self.formulation.configuration(state))
        signs = {
            name: int(np.sign(each.value(poses) * each.value({})))
            for name, each in self.triples.items()
        }
        smallest = float(np.linalg.svd(matrix, compute_uv=False).min())
        return smallest, int(_orientation(matrix[self.kept]) * self.orientation), signs


def _orientation(matrix: np.ndarray) -> float:
    """Return the sign of the determinant; 0 if unknown."""
    values = np.linalg.svd(matrix, compute_uv=False)
    return float(np.linalg.slogdet(matrix)[0]) if values.min() > SINGULAR * values.max() else 0.0


def _triple(mechanism: Mechanism, frame: Frames, joint: Joint) -> Triple | None:
    """Return the triple product at a joint farthest from zero at design."""
    ends = joint.points_on()
    if not ends:
        return None
    first, last = ends[0], ends[-1]
    axis = getattr(joint, "axis", None)
    best: Triple | None = None
    for a in _others(mechanism, joint.i, first):
        for b in _others(mechanism, joint.j, last):
            if len(ends) == 2:
                n = None
            elif axis is not None:
                n = unit(axis)
            else:
                normal = cross(a, b)
                if normal @ normal < FLAT**2 * (a @ a) * (b @ b):
                    continue
                n = unit([*normal])
            arms = frame.arm(joint.i, first), frame.arm(joint.j, last)
            found = Triple(
                joint.i, joint.j, a, b, n, arms, (frame.origins[joint.i], frame.origins[joint.j])
            )
            if abs(found.value({})) > max(FLAT, abs(best.value({})) if best else 0.0):
                best = found
    return best


def _others(mechanism: Mechanism, body: str, P: Sequence[float]) -> Iterator[Vec3]:
    """From a point of a body to its other joints' points, at design [m]."""
    fixed = mechanism.is_fixed(body)
    for joint in mechanism.joints:
        for end, owner in enumerate(joint.bodies):
            if owner == body or (fixed and mechanism.is_fixed(owner)):
                points = joint.points_on()
                if points and (away := vec(points[-1] if end else points[0]) - vec(P)) @ away > 0.0:
                    yield away
