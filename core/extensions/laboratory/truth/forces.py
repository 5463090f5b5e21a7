"""The reference forces of a case: multipliers of the full rows, and their round-off bounds.

They share only the meaning of a description with the tested equations of forces. The unknowns of a
body are the translation of its centre and its rotation. Its motion therefore requires generalised
forces about the centre, which J^T lambda balances. A joint's rows give its wrench. A driver's row
is its coordinate, so the multiplier is its effort.

The error of a correct force is at most 1e-14 (1 + K)^3 S, of a correct moment L times as much. The
multipliers give one factor 1 + K and the accelerations two; S is the largest force required by
masses and loads. Let B map the multipliers to a joint's force or moment, and let P project onto the
self-balancing multipliers. A component along w is undetermined if w B P is not zero. The component
is not judged if w B P is too near to zero for a decision.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....case.case import Case
from ....case.measures import DriverEffort, ElementForce, ForceMeasure, JointForce, JointMoment
from ....mechanism.loads import Force, SpringDamper, Torque, TorsionSpringDamper
from ....trajectory import Array
from .motion import ROUND_OFF, Solved, System, Truth, point_motion
from .rows import Real, cross, extended, inner, triad

# Fractions of a unit multiplier: values below the first are round-off, values above the second are
# real.
ZERO, REAL = 1e-10, 1e-6
# Largest angle that is known without a count of turns [rad].
SAME_TURN = 3.0


@dataclass(frozen=True, eq=False)
class KnownForce:
    """A force output at n samples; a sample that is neither determined nor undetermined is not
    judged.

    Attributes:
        values: NaN if unknown, shape (n,).
        bounds: largest errors due to round-off, shape (n,).
        determined, undetermined: whether the force certainly is, shape (n,).
    """

    values: Array
    bounds: Array
    determined: Any
    undetermined: Any


def known_forces(case: Case, truth: Truth) -> Mapping[str, KnownForce]:
    """Return the reference of every force output at the samples of the truth."""
    outputs = [output for output in case.outputs if isinstance(output, ForceMeasure)]
    n = len(case.sweep.values)
    found = {
        output.name: KnownForce(
            np.full(n, np.nan), np.full(n, np.inf), np.zeros(n, np.bool_), np.zeros(n, np.bool_)
        )
        for output in outputs
    }
    for samples, solved in truth.parts:
        loaded = _Loaded(truth.system, solved, truth.system.sampled(samples)[0])
        for output in outputs:
            known, (values, loose) = found[output.name], loaded.output(output)
            size = loaded.largest * (loaded.size if output.turns else 1.0)
            known.values[samples] = values
            known.bounds[samples] = ROUND_OFF * (1.0 + solved.condition) ** 3 * size
            known.determined[samples] = loose <= ZERO
            known.undetermined[samples] = loose >= REAL
    return found


class _Loaded:
    """Solved samples with their loads.

    Attributes:
        demand: force and torque that motion and loads require of joints and drivers, about the
            centre of each body [N, N m], shape (bodies + 1, 2, 3, n); body 0 is the ground.
        largest: largest of these forces (torques over the size) and of spring forces [N], shape
            (n,).
        amounts: of the force elements, by name.
        balanced: combinations of multipliers that balance themselves, in the null space of J^T.
    """

    def __init__(self, system: System, solved: Solved, drives: Real) -> None:
        self.system, self.solved, self.drives = system, solved, drives
        self.rows, self.mechanism, self.size = system.rows, system.mechanism, system.rows.unit
        n = solved.poses.samples
        self.demand = np.zeros((len(self.rows.centres), 2, 3, n), dtype=np.longdouble)
        self.largest = np.zeros(n)
        for body in self.mechanism.moving:
            if body.mass:
                self._inertial(body)
        self.amounts = {each.name: self._element(each) for each in self.mechanism.forces}
        demand = self.demand * extended([self.size, 1.0])[:, None, None]
        flat = demand[1:].reshape(-1, n).T.astype(np.float64)
        self.multipliers: Array = np.einsum("nur,nu->nr", solved.inverse, flat)
        self.balanced = np.eye(len(self.rows.owners)) - solved.jacobian @ solved.inverse

    def output(self, output: ForceMeasure) -> tuple[Array, Array]:
        """Return an output's values and their undetermined part, each of shape (n,)."""
        if isinstance(output, ElementForce):
            values = self.amounts[output.force].astype(np.float64)
            return values, np.zeros(len(values))
        if isinstance(output, DriverEffort):
            row, scale = self.rows.driven[self.system.names.index(output.driver)]
            map_ = np.zeros(self.multipliers.shape)
            map_[:, row] = scale
        elif isinstance(output, JointForce | JointMoment):
            wrench = self._wrench(output.joint)[isinstance(output, JointMoment)]
            map_ = np.einsum("i,nir->nr", np.array(output.unit_direction), wrench)
        else:
            raise TypeError(f"{output}: the stress truth has no such force")
        loose = np.abs(np.einsum("nr,nrk->nk", map_, self.balanced)).max(axis=1, initial=0.0)
        scale = self.size if isinstance(output, JointForce) or not output.turns else 1.0
        return np.einsum("nr,nr->n", map_, self.multipliers), loose * scale

    def _wrench(self, name: str) -> tuple[Array, Array]:
        """Return force and moment on a joint's second body per unit multiplier, shape (n, 3, rows).

        The moment is about the joint's point on this body.
        """
        joint = self.mechanism.joint(name)
        i, j = map(self.rows.index, joint.bodies)
        on, sign = (j, 1.0) if j else (i, -1.0)
        own = np.array([owner == name for owner in self.rows.owners])
        columns = self.solved.jacobian[:, :, 6 * (on - 1) : 6 * on]
        wrench = sign * np.moveaxis(np.where(own[:, None], columns, 0.0), 1, 2)
        force, torque = wrench[:, :3] / self.size, wrench[:, 3:]
        centre = self.size * (self.rows.centres[on][:, None] + self.solved.poses.u[on])
        lever = self._place(j, self.mechanism.reaction_point(joint))[1] - centre
        return force, torque - cross(lever.T[..., None].astype(np.float64), force)

    def _place(self, body: int, point: Any) -> tuple[Real, Real, Real, Real]:
        """Return the arm of a body's point, its place from the origin, velocity and acceleration
        [SI], each of shape (3, n).
        """
        arm, (moved, v, a) = point_motion(self.rows, self.solved, body, point)
        return arm, (extended(point) - self.rows.origin)[:, None] + moved, v, a

    def _current_vector(self, body: int, a: Any) -> Real:
        """Return a vector of a body in its current direction, shape (3, n)."""
        return extended(a)[:, None] + self.solved.poses.swing(body, extended(a))

    # Loads

    def _push(self, body: int, force: Real, arm: Real) -> None:
        """Apply a force to a body at the end of an arm, which reduces the required force."""
        self.demand[body] -= np.stack([force, cross(arm, force)])
        self._grow(force)

    def _grow(self, force: Real) -> None:
        self.largest = np.maximum(self.largest, np.abs(force).max(axis=0).astype(np.float64))

    def _inertial(self, body: Any) -> None:
        k = self.rows.index(body.name)
        arm, _, _, a = self._place(k, body.center_of_mass)
        gravity = extended(self.mechanism.gravity)[:, None]
        self._push(k, -body.mass * (a - gravity), arm)
        self._grow(body.mass * np.abs(a) + body.mass * np.abs(gravity))
        if body.inertia is None:
            return
        xx, yy, zz, xy, yz, xz = body.inertia
        at_design = extended([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        turn = np.eye(3)[..., None] + self.solved.poses.turned[k]
        now = np.einsum("abn,bc,dcn->adn", turn, at_design, turn)
        w, w_t = (each[k, 3:] for each in (self.solved.v, self.solved.a))
        momentum, change = (np.einsum("abn,bn->an", now, each) for each in (w, w_t))
        change = change + cross(w, momentum)
        self.demand[k, 1] += change
        self._grow(change / self.size)

    def _element(self, each: Any) -> Real:
        """Apply a force element, and return its force."""
        if isinstance(each, SpringDamper):
            return self._spring(each)
        if isinstance(each, TorsionSpringDamper):
            return self._torsion(each)
        k = self.rows.index(each.body)
        vector = self._current_vector(k if each.frame == "body" else 0, each.vector)
        if isinstance(each, Torque):
            self.demand[k, 1] -= vector
            self._grow(vector / self.size)
        else:
            assert isinstance(each, Force)
            self._push(k, vector, self._place(k, each.point)[0])
        given = extended(each.vector)
        return np.sqrt(given @ given) + 0.0 * vector[0]

    def _spring(self, each: SpringDamper) -> Real:
        i, j = map(self.rows.index, each.bodies)
        (arm_i, first, v_i, _), (arm_j, second, v_j, _) = map(self._place, (i, j), each.points)
        d = second - first
        length = np.sqrt(inner(d, d))
        rate = inner(d, v_j - v_i) / length
        tension = each.stiffness * (length - extended(each.free_length)) + each.damping * rate
        pull = tension / length * d
        self._push(i, pull, arm_i)
        self._push(j, -pull, arm_j)
        stiff = each.stiffness * self.size + each.damping * np.abs(self.solved.v).max(axis=(0, 1))
        self._grow(np.broadcast_to(stiff * max(1.0, self.size), d.shape))
        return tension

    def _torsion(self, each: TorsionSpringDamper) -> Real:
        joint: Any = self.mechanism.joint(each.joint)
        i, j = map(self.rows.index, joint.bodies)
        f, g, h = triad(joint.axis)
        axis, w = self._current_vector(i, h), self.solved.v[:, 3:]
        if joint.name in self.system.driving:
            angle = self.drives[self.system.driving[joint.name]]
        else:  # known within a turn
            f_i, g_i, f_j = (
                self._current_vector(i, f),
                self._current_vector(i, g),
                self._current_vector(j, f),
            )
            angle = np.arctan2(inner(g_i, f_j), inner(f_i, f_j))
            angle = np.where(np.abs(angle) < SAME_TURN, angle, np.nan)
        rate = inner(axis, w[j] - w[i])
        amount = -(each.stiffness * (angle - extended(each.free_angle)) + each.damping * rate)
        self.demand[j, 1] -= amount * axis
        self.demand[i, 1] += amount * axis
        self._grow((np.abs(amount * axis) + each.stiffness) / self.size)
        return amount
