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
from ....mechanism.mechanism import Mechanism, Vector
from ....trajectory import Array
from .evaluation import cross
from .long_double import Real, extended, unit
from .newton_kantorovich import System
from .reference_motion import ROUND_OFF, Truth
from .solutions import Solved

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
    n = len(case.sweep.values)
    found = {
        output.name: KnownForce(
            np.full(n, np.nan), np.full(n, np.inf), np.zeros(n, np.bool_), np.zeros(n, np.bool_)
        )
        for output in case.outputs
        if isinstance(output, ForceMeasure)
    }
    for samples, solved in truth.parts:
        at = _Loaded(truth.system, solved, truth.system.sampled(samples))
        for output in case.outputs:
            if isinstance(output, ForceMeasure):
                known = found[output.name]
                values, loose, size = at.output(output)
                known.values[samples] = values
                known.bounds[samples] = ROUND_OFF * (1.0 + solved.condition) ** 3 * size
                known.determined[samples] = loose <= ZERO
                known.undetermined[samples] = loose >= REAL
    return found


class _Loaded:
    """Solved samples with their loads.

    Attributes:
        force, torque: force and torque that motion and loads require of joints and drivers, about
            the centre of each body [N, N m], shape (bodies + 1, 3, n); body 0 is the ground.
        largest: largest of these forces (torques over the size) and of spring forces [N], shape
            (n,).
    """

    def __init__(self, system: System, solved: Solved, drives: Real) -> None:
        self.system, self.solved, self.drives = system, solved, drives
        self.mechanism: Mechanism = system.mechanism
        self.stated, self.poses = system.rows.stated, solved.poses
        n, bodies = self.poses.samples, len(self.stated.bodies)
        self.size = self.stated.unit
        still = np.zeros((1, 6, n), dtype=np.longdouble)
        self.v, self.a = (np.concatenate([still, each]) for each in (solved.v, solved.a))
        self.force, self.torque = (
            np.zeros((bodies + 1, 3, n), dtype=np.longdouble) for _ in range(2)
        )
        self.largest = np.zeros(n)
        self.amounts: dict[str, Real] = {}
        for body in self.mechanism.moving:
            if body.mass:
                self._inertial(body)
        for each in self.mechanism.forces:
            self.amounts[each.name] = self._element(each)
        demand = np.concatenate([self.force[1:] * self.size, self.torque[1:]], axis=1)
        inverse = solved.inverse
        flat = demand.reshape(-1, n).T.astype(np.float64)
        self.multipliers: Array = np.einsum("nur,nu->nr", inverse, flat)
        # combinations of multipliers that balance themselves, in the null space of J^T
        self.balanced = np.eye(solved.jacobian.shape[1]) - solved.jacobian @ inverse

    def output(self, output: ForceMeasure) -> tuple[Array, Array, Array]:
        """Return an output's values, their undetermined part, and the size of its errors, each of
        shape (n,).
        """
        if isinstance(output, ElementForce):
            values = self.amounts[output.force].astype(np.float64)
            return values, np.zeros(len(values)), self._sizes(turns=output.turns)
        if isinstance(output, DriverEffort):
            place = [driver.name for driver in self.mechanism.drivers].index(output.driver)
            row, scale = self.stated.driven[place]
            map_ = np.zeros((len(self.multipliers), self.stated.rows))
            map_[:, row] = float(scale)
        elif isinstance(output, JointForce | JointMoment):
            force, moment = self._wrench(output.joint)
            wrench = moment if isinstance(output, JointMoment) else force
            map_ = np.einsum("i,nir->nr", np.array(output.along), wrench)
        else:
            raise TypeError(f"{output}: the stress truth has no such force")
        loose = np.abs(np.einsum("nr,nrk->nk", map_, self.balanced)).max(axis=1, initial=0.0)
        scale = self.size if isinstance(output, JointForce) or not output.turns else 1.0
        values = np.einsum("nr,nr->n", map_, self.multipliers)
        return values, loose * scale, self._sizes(turns=output.turns)

    def _sizes(self, *, turns: bool) -> Array:
        return self.largest * (self.size if turns else 1.0)

    def _wrench(self, name: str) -> tuple[Array, Array]:
        """Return force and moment on a joint's second body per unit multiplier, shape (n, 3, rows).

        The moment is about the joint's point on this body.
        """
        joint = self.mechanism.joint(name)
        i, j = (self._index(body) for body in joint.bodies)
        on, sign = (j, 1.0) if j else (i, -1.0)
        own = np.array([owner == name for owner in self.stated.owners])
        first = 6 * (on - 1)
        part = sign * np.where(own[:, None], self.solved.jacobian[:, :, first : first + 6], 0.0)
        force, torque = part[:, :, :3] / self.size, part[:, :, 3:]
        point = self.mechanism.reaction_point(joint)
        lever = self._place(j, point) - self._centre(on)  # [m]
        about = torque - np.cross(lever.T.astype(np.float64)[:, None], force)
        return np.moveaxis(force, 1, 2), np.moveaxis(about, 1, 2)

    # Places and rates, SI

    def _index(self, body: str) -> int:
        return 0 if self.mechanism.is_fixed(body) else self.stated.bodies.index(body) + 1

    def _turned(self, body: int, vector: Any) -> Real:
        """Return a vector fixed in a body, in its current direction, shape (3, n)."""
        a = extended(vector)
        return a[:, None] + np.einsum("abn,b->an", self.poses.turned[body], a)

    def _arm(self, body: int, point: Vector) -> Real:
        """Return the arm from a body's centre to a point of it [m], shape (3, n)."""
        centre = self.stated.centres[body - 1] if body else extended([0.0, 0.0, 0.0])
        return self._turned(body, extended(point) - self.stated.origin - self.size * centre)

    def _centre(self, body: int) -> Real:
        """Return the place of a body's centre from the origin of the conditions [m]."""
        centre = self.stated.centres[body - 1] if body else extended([0.0, 0.0, 0.0])
        return self.size * (centre[:, None] + self.poses.u[body])

    def _place(self, body: int, point: Vector) -> Real:
        return self._centre(body) + self._arm(body, point)

    def _velocity(self, body: int, point: Vector) -> Real:
        v, w = self.size * self.v[body, :3], self.v[body, 3:]
        return v + _cross(w, self._arm(body, point))

    # Loads

    def _push(self, body: int, force: Real, at: Real) -> None:
        """Apply a force to a body at the end of an arm, which reduces the required force."""
        self.force[body] -= force
        self.torque[body] -= _cross(at, force)
        self._grow(force)

    def _grow(self, force: Real) -> None:
        self.largest = np.maximum(self.largest, np.abs(force).max(axis=0).astype(np.float64))

    def _inertial(self, body: Any) -> None:
        k = self._index(body.name)
        w, w_t = self.v[k, 3:], self.a[k, 3:]
        arm = self._arm(k, body.center_of_mass)
        a = self.size * self.a[k, :3] + _cross(w_t, arm) + _cross(w, _cross(w, arm))
        gravity = extended(self.mechanism.gravity)[:, None]
        self._push(k, -body.mass * (a - gravity), arm)
        self._grow(body.mass * np.abs(a) + body.mass * np.abs(gravity))
        if body.inertia is None:
            return
        xx, yy, zz, xy, yz, xz = map(extended, body.inertia)
        at_design = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        turn = np.eye(3, dtype=np.longdouble)[..., None] + self.poses.turned[k]
        now = np.einsum("abn,bc,dcn->adn", turn, at_design, turn)
        momentum = np.einsum("abn,bn->an", now, w)
        change = np.einsum("abn,bn->an", now, w_t) + _cross(w, momentum)
        self.torque[k] += change
        self._grow(np.abs(change) / self.size)

    def _element(self, each: Any) -> Real:
        """Apply a force element, and return its force."""
        if isinstance(each, SpringDamper):
            return self._spring(each)
        if isinstance(each, TorsionSpringDamper):
            return self._torsion(each)
        k = self._index(each.body)
        vector = extended(each.vector)
        turned = self._turned(k if each.frame == "body" else 0, vector)
        if isinstance(each, Torque):
            self.torque[k] -= turned
            self._grow(turned / self.size)
        else:
            assert isinstance(each, Force)
            self._push(k, turned, self._arm(k, each.point))
        return np.sqrt(vector @ vector) + 0.0 * turned[0]

    def _spring(self, each: SpringDamper) -> Real:
        i, j = map(self._index, each.bodies)
        first, second = each.points
        d = self._place(j, second) - self._place(i, first)
        length = np.sqrt((d * d).sum(axis=0))
        rate = (d * (self._velocity(j, second) - self._velocity(i, first))).sum(axis=0) / length
        tension = each.stiffness * (length - extended(each.free_length)) + each.damping * rate
        pull = tension / length * d
        self._push(i, pull, self._arm(i, first))
        self._push(j, -pull, self._arm(j, second))
        stiff = each.stiffness * self.size + each.damping * np.abs(self.v).max(axis=(0, 1))
        self._grow(np.broadcast_to(stiff * max(1.0, self.size), d.shape))
        return tension

    def _torsion(self, each: TorsionSpringDamper) -> Real:
        joint: Any = self.mechanism.joint(each.joint)
        i, j = (self._index(body) for body in joint.bodies)
        axis = self._turned(i, unit(extended(joint.axis)))
        rate = (axis * (self.v[j, 3:] - self.v[i, 3:])).sum(axis=0)
        angle = self._angle(each.joint, i, j)
        amount = -(each.stiffness * (angle - extended(each.free_angle)) + each.damping * rate)
        self.torque[j] -= amount * axis
        self.torque[i] += amount * axis
        self._grow(np.abs(amount * axis) / self.size + each.stiffness / self.size)
        return amount

    def _angle(self, name: str, i: int, j: int) -> Real:
        """Return the angle of a joint: its driver's, or one within a turn; else NaN."""
        if name in self.system.driving:
            return self.drives[0, self.system.driving[name]]
        joint: Any = self.mechanism.joint(name)
        h = unit(extended(joint.axis))
        across = np.cross(h, np.eye(3)[int(np.abs(h).argmin())])
        f_i, g_i, f_j = (
            self._turned(i, across),
            self._turned(i, np.cross(h, across)),
            self._turned(j, across),
        )
        angle = np.arctan2((g_i * f_j).sum(axis=0), (f_i * f_j).sum(axis=0))
        return np.where(np.abs(angle) < SAME_TURN, angle, np.nan)


def _cross(a: Real, b: Real) -> Real:
    return cross(a[None], b[None])[0]
