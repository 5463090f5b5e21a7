"""The Cartesian formulation: six unknowns (dr, dpi) of every moving body, and all joints as rows.

dpi is in global axes, or in body axes where the row style is; the poses are the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..algebra import Quat, Scalar, Vec3, turned_by, vec
from ..primitives.base import GROUND_MOTION, GROUND_POSE, Motion, Pose, Row
from ..program import sqrt
from .equations import Constraint
from .formulation import Acceleration, Configuration, Rows, State

COLUMNS = 6
"""Unknowns of a moving body: dr and dpi."""


@dataclass(frozen=True, eq=False)
class Cartesian:
    """The constraints over the named moving bodies; implements `Formulation`."""

    constraints: Sequence[Constraint]
    bodies: Sequence[str]

    @property
    def columns(self) -> Mapping[str, int]:
        """First column of every moving body."""
        return {name: COLUMNS * k for k, name in enumerate(self.bodies)}

    @property
    def unknowns(self) -> int:
        return COLUMNS * len(self.bodies)

    @property
    def design(self) -> Mapping[str, Sequence[float]]:
        still = {f"u {name}": (0.0, 0.0, 0.0) for name in self.bodies}
        return still | {f"q {name}": (1.0, 0.0, 0.0, 0.0) for name in self.bodies}

    @property
    def owners(self) -> Sequence[tuple[str, str]]:
        return [(c.owner, type(c.primitive).__name__) for c in self.constraints for _ in range(c.primitive.n)]

    @property
    def _body_axes(self) -> bool:
        return any(c.primitive.body_axes for c in self.constraints)

    def configuration(self, state: State) -> Configuration:
        poses: dict[str, Pose] = {}
        for name in self.bodies:
            e0, *e = state[f"q {name}"]
            poses[name] = Pose.of(vec(state[f"u {name}"]), Quat(e0, vec(e)))
        return Configuration(state, poses)

    def retract(self, at: Configuration, step: Sequence[Scalar]) -> State:
        state: dict[str, Sequence[Scalar]] = {}
        for name, k in self.columns.items():
            dr, dpi = vec(step[k : k + 3]), self._global(at.poses[name], vec(step[k + 3 : k + COLUMNS]))
            state[f"u {name}"] = tuple(at.poses[name].u + dr)
            state[f"q {name}"] = tuple(turned_by(at.poses[name].q, 0.5 * dpi, sqrt))
        return state

    def phi(self, at: Configuration) -> list[Scalar]:
        return [value for c in self.constraints for value in c.primitive.phi(*_pair(c, at))]

    def branch(self, at: Configuration) -> list[Scalar]:
        return [value for c in self.constraints for value in c.primitive.branch(*_pair(c, at))]

    def rows(self, at: Configuration) -> Rows:
        return [self._sparse(row, c) for c in self.constraints for row in c.primitive.rows(*_pair(c, at))]

    def nu(self) -> list[Scalar]:
        return [value for c in self.constraints for value in c.primitive.nu()]

    def gamma(self, at: Configuration, v: Sequence[Scalar]) -> list[Scalar]:
        motions = self._own(v)
        found: list[Scalar] = []
        for c in self.constraints:
            vi, vj = motions.get(c.i, GROUND_MOTION), motions.get(c.j, GROUND_MOTION)
            found += c.primitive.gamma(*_pair(c, at), vi, vj)
        return found

    def motions(self, at: Configuration, v: Sequence[Scalar]) -> Mapping[str, Motion]:
        return {name: Motion(motion.v, self._global(at.poses[name], motion.w)) for name, motion in self._own(v).items()}

    def accelerations(self, at: Configuration, v: Sequence[Scalar], a: Sequence[Scalar]) -> Mapping[str, Acceleration]:
        # A w' differentiated is A w'dot + w x w, and the last is zero
        return {name: Acceleration(motion.v, self._global(at.poses[name], motion.w)) for name, motion in self._own(a).items()}

    def _own(self, v: Sequence[Scalar]) -> dict[str, Motion]:
        """The unknowns by body, in the axes of the rows."""
        return {name: Motion(vec(v[k : k + 3]), vec(v[k + 3 : k + COLUMNS])) for name, k in self.columns.items()}

    def _global(self, pose: Pose, w: Vec3) -> Vec3:
        return pose.turn(w) if self._body_axes else w

    def _sparse(self, row: Row, c: Constraint) -> dict[int, Scalar]:
        entries: dict[int, Scalar] = {}
        for body, blocks in ((c.i, (row.ri, row.pi)), (c.j, (row.rj, row.pj))):
            if body in self.columns:
                first = self.columns[body]
                values = [value for block in blocks for value in block]
                entries |= {first + k: x for k, x in enumerate(values) if not (isinstance(x, int | float) and x == 0)}
        return entries


def _pair(c: Constraint, at: Configuration) -> tuple[Pose, Pose]:
    return at.poses.get(c.i, GROUND_POSE), at.poses.get(c.j, GROUND_POSE)
