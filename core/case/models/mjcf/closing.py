"""Equalities of a model as rows of the unknowns of its joints: residuals and slopes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ....algebra import Quat, Vec3
from ....trajectory import Array
from .digits import Digits
from .equalities import Connect, Equality, Relation
from .pose import Pose

# Gaps of several joints add up, and arms lengthen them; see kinematics.structure.redundancy.
ADDED_UP = 10.0
# Rows are of size one: a smaller singular value is round-off of a redundant row.
ROUND_OFF = 1e-9


@dataclass(frozen=True, eq=False)
class Closing:
    """Equalities as rows, lengths over the model's size [m]."""

    equalities: Sequence[Equality]
    size: float
    digits: Digits

    @property
    def weak(self) -> float:
        """Singular values below this belong to rows redundant within the digits."""
        return max(ROUND_OFF, ADDED_UP * self.digits.tolerance / self.size)

    def gap(self, pose: Pose) -> float:
        """Return the largest residual [m or rad]."""
        return float(np.abs(self._gaps(pose)).max(initial=0.0))

    def gap_of(self, each: Equality, pose: Pose) -> float:
        """Return the largest residual of an equality [m or rad]."""
        return float(np.abs(self._residual(each, pose)).max(initial=0.0))

    def apart(self, pose: Pose) -> float:
        """Return the largest gap of connects, welds and rods [m], angles at arms of the size;
        offsets of coupled coordinates are meant, and do not count.
        """
        found = 0.0
        for each in self.equalities:
            if not isinstance(each, Relation):
                residual = np.abs(self._residual(each, pose))
                found = max(found, *residual[:3], *(self.size * residual[3:]))
        return found

    def widest(self, pose: Pose) -> Equality:
        """Return the equality with the largest residual."""
        return max(self.equalities, key=lambda each: self.gap_of(each, pose))

    def _gaps(self, pose: Pose) -> Array:
        found = [self._residual(each, pose) for each in self.equalities]
        return np.concatenate([np.zeros(0), *found])

    def _residual(self, each: Equality, pose: Pose) -> Array:
        """Return the residuals of an equality [m or rad]."""
        if isinstance(each, Relation):
            return np.array([_off(each, pose)])
        (p, q), carried = each.points, pose.carried
        apart = carried[each.j].point(q) - carried[each.i].point(p)
        if not isinstance(each, Connect):
            return np.array([math.sqrt(apart @ apart) - each.length])
        turned: list[float] = []
        if each.turns is not None:
            one, two = (
                carried[body].turn * turn
                for body, turn in zip((each.i, each.j), each.turns, strict=True)
            )
            turned = [*rotation_vector(two * one.conjugate())]
        return np.array([*apart, *turned], dtype=np.float64)

    def rows(self, pose: Pose) -> tuple[Array, Array]:
        """Return residuals and their derivatives, lengths over the size: (rows,), (rows, n)."""
        metres = self.metres(pose)
        residuals, slopes = [np.zeros(0)], [np.zeros((0, pose.unknowns))]
        for each in self.equalities:
            residual, slope = self._residual(each, pose), self._slope(each, pose) * metres
            units = np.ones(len(residual))
            # lengths, then angles; of relations the largest slope is one
            units[:3] = self.size
            if isinstance(each, Relation):
                units[:] = float(np.abs(slope).max()) or 1.0
            residuals.append(residual / units)
            slopes.append(slope / units[:, None])
        return np.concatenate(residuals), np.concatenate(slopes)

    def metres(self, pose: Pose) -> Array:
        """Return the size for lengths among the unknowns, else one, shape (n,)."""
        found = np.ones(pose.unknowns)
        for joint in pose.tree.chain:
            columns = pose.columns[joint.name]
            if joint.type in ("slide", "free"):
                found[columns[:3] if joint.type == "free" else columns[0]] = self.size
        return found

    def _slope(self, each: Equality, pose: Pose) -> Array:
        if isinstance(each, Relation):
            return _slope_of(each, pose)
        ends = [
            (body, pose.carried[body].point(point))
            for body, point in zip((each.i, each.j), each.points, strict=True)
        ]
        (along_i, about_i), (along_j, about_j) = (pose.slopes(*end) for end in ends)
        if isinstance(each, Connect):
            moved = along_j - along_i
            return moved if each.turns is None else np.vstack([moved, about_j - about_i])
        apart = np.array([*(ends[1][1] - ends[0][1])])
        return (apart / np.linalg.norm(apart) @ (along_j - along_i))[None]

    def null(self, rows: Array) -> Array:
        """Return an orthonormal basis of the motions left by rows, shape (freedoms, n)."""
        if len(rows) > rows.shape[1]:  # no matrix of rows by rows, of which a file may have many
            rows = np.linalg.qr(rows).R
        _, sizes, right = np.linalg.svd(rows, full_matrices=True)
        return right[int((sizes > self.weak).sum()) :]


def _off(relation: Relation, pose: Pose) -> float:
    """Return the residual of a relation [rad or m]."""
    driven, driving = (_changed(weights, pose) for weights in (relation.driven, relation.driving))
    return driven - float(np.polynomial.Polynomial(relation.coefficients)(driving))


def _changed(weights: Mapping[str, float], pose: Pose) -> float:
    """Return a weighted sum of changes since qpos0 [rad or m]."""
    joints = pose.tree.joints
    return sum((k * (joints[name].moved + pose.value(name)) for name, k in weights.items()), 0.0)


def _slope_of(relation: Relation, pose: Pose) -> Array:
    found = np.zeros((1, pose.unknowns))
    for name, k in relation.driven.items():
        found[0, pose.columns[name][0]] += k
    if relation.driving:
        curve = np.polynomial.Polynomial(relation.coefficients).deriv()
        slope = float(curve(_changed(relation.driving, pose)))
        for name, k in relation.driving.items():
            found[0, pose.columns[name][0]] -= slope * k
    return found


def rotation_vector(turn: Quat) -> Vec3:
    """Return the rotation vector of a quaternion, at most half a turn [rad]."""
    sine = math.sqrt(turn.e @ turn.e)
    cosine = turn.e0 if turn.e0 >= 0.0 else -turn.e0
    sign = 1.0 if turn.e0 >= 0.0 else -1.0
    return (sign * (2.0 * math.atan2(sine, cosine) / sine if sine > 0.0 else 2.0)) * turn.e
