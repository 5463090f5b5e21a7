"""The equations of a free mechanism in numbers, and its start.

The equations are those of index 1 on the traced rows, [M J^T; J 0] [a; -lambda] = [Q - h; gamma].
A QR factorisation with pivots of J^T gives, at every evaluation, the independent rows and a basis Z
of the motions they leave; a = a_p + Z b, with Z^T M Z b = Z^T (Q - h - M a_p). Redundant rows and
bodies without mass need no special case.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ...algebra import ZERO, quat, vec
from ...errors import SolveError, unknown
from ...kinematics.compiled.request import Layout, slots_of
from ...kinematics.compiled.traced_forces import angles
from ...kinematics.forces.equations import BodyStates, ForceEquations, arm_of_center, inertial
from ...kinematics.formulation.cartesian import COLUMNS, Cartesian
from ...kinematics.formulation.constraints import frames
from ...kinematics.formulation.formulation import (
    GROUND_ACCELERATION,
    Acceleration,
    Configuration,
    motion_of_frame,
    motion_of_point,
)
from ...kinematics.formulation.state_vectors import columns_of, jacobian, moved_most
from ...mechanism.mechanism import Mechanism, coordinates
from ...mechanism.motions import Driver
from ...primitives.base import GROUND_POSE, GROUND_TWIST, Drive
from ...program import Plan, Tape
from ...program.executor import ready
from ...trajectory import Array, BodyMotion, PointMotion, Trajectory

# Singular values below this part of the largest are zero, as for `structure.redundancy`.
RANK = 1e-9
# At a change point the smallest singular value vanishes. Accelerations have round-off over its
# square, so a motion that passes this near to one cannot be told from one through it.
VANISHING = 1e-5
# Directions with less than this part of the largest inertia have none, but for round-off.
MASSLESS = 1e-13
# Rates below it are zero: at rest after a decay the squares of smaller ones underflow in DOP853.
NOTHING = 1e-100


class FreeEquations:
    """The equations of a free mechanism in numbers.

    A state y holds displacements and Euler parameters of all bodies, joint coordinates, the rates
    of the unknowns, and the work of all loads.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = replace(mechanism, drivers=())
        if not any(body.mass for body in mechanism.moving):
            raise SolveError(
                f"mechanism {mechanism.name!r}: no moving body has mass, and without mass loads"
                " determine no motion; give bodies mass, center_of_mass and inertia"
            )
        self.frame = frames(mechanism)
        self.formulation = Cartesian.of(self.mechanism, self.frame, named=angles(mechanism))
        self.unknowns, self.bodies = self.formulation.unknowns, len(self.formulation.bodies)
        self.design = np.concatenate([*self.formulation.design.values()])
        self.evaluations = 0
        self._linear: Any = importlib.import_module("scipy.linalg")
        self._trace()
        at_start = self.evaluate(np.concatenate([self.design, np.zeros(self.unknowns + 1)]))
        sizes = np.linalg.svd(at_start.rows, compute_uv=False) if self.count else np.zeros(0)
        self.rank = int((sizes > RANK * sizes.max(initial=0.0)).sum())
        if self.rank == self.unknowns:
            raise SolveError(
                f"mechanism {mechanism.name!r}: no freedom is left without its drivers, so that"
                " nothing moves; free a joint"
            )
        inertia = np.diag(at_start.mass)
        # unknowns of the size of their inertia: light bodies beside heavy ones keep their digits
        self.scale = 1.0 / np.sqrt(np.where(inertia > 0.0, inertia, inertia.max()))

    def _trace(self) -> None:
        tape, layout, formulation = Tape(), Layout(), self.formulation
        state = {
            name: [tape.input(k) for k in layout.vector(name, len(values))]
            for name, values in formulation.design.items()
        }
        self._vectors = {name: layout.vectors[name] for name in state}
        v = [tape.input(k) for k in layout.vector("v", self.unknowns)]
        self._inputs = range(len(layout.slots))
        at = formulation.configuration(state)
        still = dict.fromkeys(formulation.bodies, GROUND_ACCELERATION)
        states = BodyStates(self.frame, at.poses, formulation.twists(at, v), still)
        equations = ForceEquations.with_angles(self.mechanism, formulation, at, states)
        gravity, power = vec(self.mechanism.gravity), list[Any]()
        mass = dict[tuple[int, int], Any]()
        for body in self.mechanism.moving:
            if body.mass == 0.0:
                continue
            arm, first = arm_of_center(body, states), formulation.columns[body.name]
            velocity = self.frame.unit * states.twists[body.name].of(arm)
            power.append(body.mass * (velocity @ gravity))
            for k in range(COLUMNS):
                unit = [float(k == other) for other in range(COLUMNS)]
                moved = Acceleration(vec(unit[:3]), vec(unit[3:]))
                one = {body.name: GROUND_TWIST}, {body.name: moved}
                wrench = inertial(body, BodyStates(self.frame, at.poses, *one), ZERO)
                column = [*(self.frame.unit * wrench.force), *wrench.torque]
                mass |= {(first + row, first + k): value for row, value in enumerate(column)}
        power += [-(each.stored + each.lost) for each in equations.applied.values()]
        rows = formulation.rows(at)
        self.count = len(rows)
        entries = {(i, k): x for i, row in enumerate(rows) for k, x in row.items()}
        wanted = {
            "rows": [*entries.values()],
            "mass": [*mass.values()],
            "phi": formulation.phi(at),
            "gamma": formulation.gamma(at, v),
            "demand": equations.demand,
            "power": [sum(power, 0.0)],
        }
        plan = Plan({"free": layout.program("free", tape, wanted)}, layout.slots)
        self._executor = ready(plan)(1)
        self._outputs = slots_of(layout.vectors, wanted)
        ends = [0, *np.cumsum([len(values) for values in wanted.values()]).tolist()]
        self._parts = [slice(*each) for each in pairwise(ends)]
        self._at_rows = tuple(np.array([*entries], np.intp).reshape(-1, 2).T)
        self._at_mass = tuple(np.array([*mass], np.intp).reshape(-1, 2).T)

    def evaluate(self, y: Array) -> Evaluated:
        """Return the equations at a state."""
        self.evaluations += 1
        executor = self._executor
        executor.put(self._inputs, y[:-1, None])
        executor.run("free")
        values = executor.get(self._outputs)[:, 0]
        entries, masses, phi, gamma, demand, power = (values[part] for part in self._parts)
        rows, mass = np.zeros((self.count, self.unknowns)), np.zeros((self.unknowns,) * 2)
        rows[self._at_rows], mass[self._at_mass] = entries, masses
        return Evaluated(rows, mass, phi, gamma, demand, float(power[0]))

    def rate(self, _: float, y: Array) -> Array:
        """Return the rate of a state."""
        at = self.evaluate(y)
        found = self.state_rate(y, y[len(self.design) : -1], self.accelerations(at), at.power)
        return np.where(np.abs(found) < NOTHING, 0.0, found)

    def state_rate(self, y: Array, v: Array, a: Array, power: float) -> Array:
        """Return the rate of a state by the rates of the unknowns and their accelerations."""
        n = self.bodies
        e = y[3 * n : 7 * n].reshape(n, 4)
        velocity, w = v[: 6 * n].reshape(n, 2, 3).transpose(1, 0, 2)
        turning = np.empty((n, 4))
        (e0, e1, e2, e3), (wx, wy, wz) = e.T, 0.5 * w.T
        turning[:, 0] = -(wx * e1 + wy * e2 + wz * e3)
        turning[:, 1] = e0 * wx + wy * e3 - wz * e2
        turning[:, 2] = e0 * wy + wz * e1 - wx * e3
        turning[:, 3] = e0 * wz + wx * e2 - wy * e1
        return np.concatenate([velocity.ravel(), turning.ravel(), v[6 * n :], a, [power]])

    def accelerations(self, at: Evaluated) -> Array:
        """Return the accelerations of the unknowns.

        Raises:
            SolveError: a load acts on a freedom without inertia.
        """
        particular, free = self.split(at.rows, at.gamma)
        left = -at.demand - at.mass @ particular
        sizes, ways = np.linalg.eigh(free.T @ at.mass @ free)
        acting = ways.T @ (free.T @ left)
        light = sizes <= MASSLESS * sizes[-1]
        if light.any():
            scaled = self.scale * (np.abs(at.demand) + np.abs(at.mass) @ np.abs(particular))
            if (np.abs(acting[light]) > RANK * np.linalg.norm(scaled)).any():
                name, _ = moved_most(self.formulation.columns, free @ ways[:, 0])
                raise SolveError(
                    f"mechanism {self.mechanism.name!r}: a load acts on a motion of body {name!r}"
                    " that has no inertia, so that its acceleration is infinite; give the body"
                    " mass and inertia"
                )
        motion = np.where(light, 0.0, acting / np.where(light, 1.0, sizes))
        return particular + free @ (ways @ motion)

    def split(self, rows: Array, right: Array) -> tuple[Array, Array]:
        """Return a solution x of rows x = right, and a basis of all others beside it, shape
        (unknowns,) and (unknowns, freedoms).
        """
        if not self.rank:
            return np.zeros(self.unknowns), np.diag(self.scale)
        # LAPACK itself, with room for its blocks of up to 64 columns: scipy's wrappers take as long
        # as the factors
        lapack, rank, n = self._linear.lapack, self.rank, self.unknowns
        room = 64 * (n + self.count)
        factors, order, tau, *_ = lapack.dgeqp3((rows * self.scale).T, lwork=room)
        x, _ = lapack.dtrtrs(factors[:rank, :rank], right[order[:rank] - 1], trans=1)
        square = np.zeros((n, n), order="F")
        square[:, : self.count] = factors[:, :n]
        q, *_ = lapack.dorgqr(square, tau, lwork=room, overwrite_a=1)
        return self.scale * (q[:, :rank] @ x), self.scale[:, None] * q[:, rank:]

    def start(self, v: Array) -> Array:
        """Return the state at the design position, closed, at rates of the unknowns.

        Raises:
            SolveError: the start is open.
        """
        y = np.concatenate([self.design, v, [0.0]])
        closed = y + self.projection(y)
        if self.gap(closed) > RANK:
            raise SolveError(
                f"mechanism {self.mechanism.name!r}: the design position is open by"
                f" {self.frame.unit * self.gap(closed):.2g} m; close it by kincheck run --closure,"
                " or correct the points"
            )
        return closed

    def projection(self, y: Array) -> Array:
        """Return the change of a state that projects its pose and then its velocities onto the
        rows.
        """
        n, position, v = self.bodies, slice(len(self.design)), slice(len(self.design), -1)
        total = np.zeros_like(y)
        for _ in range(2):
            e = (y + total)[3 * n : 7 * n].reshape(n, 4)
            excess = 0.5 * (1.0 - (e * e).sum(axis=1, keepdims=True))  # of a length of nearly one
            total[3 * n : 7 * n] += (excess * e).ravel()
            at = self.evaluate(y + total)
            step, _ = self.split(at.rows, -at.phi)
            total[position] += self.state_rate(y + total, step, step, 0.0)[position]
        rows = self.evaluate(y + total).rows
        total[v] = -self.split(rows, rows @ y[v])[0]
        return total

    def gap(self, y: Array) -> float:
        """Return the largest residual of all rows."""
        return float(np.abs(self.evaluate(y).phi).max(initial=0.0))

    def regular(self, y: Array) -> float:
        """Return the smallest singular value of the independent rows, by the largest."""
        if not self.rank:
            return 1.0
        sizes = np.linalg.svd(self.evaluate(y).rows, compute_uv=False)
        if sizes[self.rank : self.rank + 1].max(initial=0.0) > VANISHING * sizes[0]:
            raise SolveError(
                f"mechanism {self.mechanism.name!r}: its design position is a change point, where"
                " rows are redundant that are not so beside it; give the design in another pose,"
                " some degrees on"
            )
        return float(sizes[self.rank - 1] / sizes[0])

    def energy(self, y: Array) -> float:
        """Return the kinetic energy less the work of the loads since the start [J]."""
        v = y[len(self.design) : -1]
        return float(0.5 * v @ self.evaluate(y).mass @ v - y[-1])

    def fastest(self, y: Array) -> float:
        """Return the largest rate at which deviations from a state decay or swing [1/s]."""
        steps = np.sqrt(np.finfo(np.float64).eps) * np.maximum(np.abs(y), 1.0)
        at = self.rate(0.0, y)
        columns = [
            (self.rate(0.0, y + way) - at) / step
            for way, step in zip(np.diag(steps).copy(), steps, strict=True)
        ]
        return float(np.abs(np.linalg.eigvals(np.array(columns, np.float64))).max())

    def _at(self, states: Array) -> Configuration:
        return self.formulation.configuration(
            {name: [*states.T[slots]] for name, slots in self._vectors.items()}
        )

    def trajectory(self, states: Array) -> Trajectory:
        """Return the motion of points and bodies over states, shape (m, numbers)."""
        at, frame, count = self._at(states), self.frame, len(states)
        v = [*states.T[len(self.design) : -1]]
        a = [*np.array([self.accelerations(self.evaluate(y)) for y in states]).T]
        twists = self.formulation.twists(at, v)
        accelerations = self.formulation.accelerations(at, v, a)

        def moving(body: str, position: Sequence[float]) -> list[Array]:
            found = motion_of_point(
                position,
                frame.arm(body, position),
                frame.unit,
                at.poses.get(body, GROUND_POSE),
                twists.get(body, GROUND_TWIST),
                accelerations.get(body, GROUND_ACCELERATION),
            )
            return [columns_of(each, count) for each in found]

        points = {
            point.name: PointMotion(*moving(point.body, point.position))
            for point in self.mechanism.points
        }
        bodies = dict[str, BodyMotion]()
        for body in self.mechanism.moving:
            r, v, r_tt = moving(name := body.name, body.origin)
            own = motion_of_frame(
                quat(body.euler_parameters), at.poses[name], twists[name], accelerations[name]
            )
            p, w, w_t = (columns_of(each, count) for each in own)
            bodies[name] = BodyMotion(r, p, np.hstack([v, w]), np.hstack([r_tt, w_t]))
        solved = np.ones(count, np.bool_)
        return Trajectory(points, solved, np.zeros(count, np.int64), 0.0, bodies=bodies)

    def differences(self, one: Array, other: Array) -> tuple[float, float]:
        """Return the largest difference of a point of two series of states [m], and that of Euler
        parameters, doubled [rad].
        """
        mechanism, found = self.mechanism, [0.0]
        every = [self._at(states).poses for states in (one, other)]
        places = [(point.body, point.position) for point in mechanism.points]
        for joint in mechanism.joints:
            places += [(body, at) for body in joint.bodies for at in joint.points_on(body)]
        for body, position in places:
            if body not in every[0]:
                continue
            arm = self.frame.arm(body, position)
            a, b = (each[body].u + each[body].swing(arm) for each in every)
            d = b - a
            found.append(self.frame.unit * float(np.sqrt(d @ d).max()))
        n = self.bodies
        turned = np.abs(other[:, 3 * n : 7 * n] - one[:, 3 * n : 7 * n]).max(initial=0.0)
        return max(found), 2.0 * float(turned)


@dataclass(frozen=True, slots=True)
class Evaluated:
    """The equations at one state.

    Attributes:
        rows: J, shape (rows, unknowns).
        mass: M [J], shape (unknowns, unknowns).
        phi, gamma: residuals, and right-hand sides of the accelerations, shape (rows,).
        demand: h - Q [J], shape (unknowns,).
        power: of all loads [W].
    """

    rows: Array
    mass: Array
    phi: Array
    gamma: Array
    demand: Array
    power: float


def start_velocities(
    mechanism: Mechanism, equations: FreeEquations, rates: Mapping[str, float]
) -> Array:
    """Return the rates of the unknowns at the start.

    Raises:
        SolveError: a name is unknown, or rates contradict each other or the joints.
    """
    if not rates:
        return np.zeros(equations.unknowns)
    known = coordinates(mechanism)
    for name, rate in rates.items():
        what = ""
        if name not in known:
            what = unknown("driver or joint with a rotation or translation", name, known)
        elif isinstance(rate, str) or not np.isfinite(rate):
            what = f"{name}: found {rate!r}, expected a number"
        if what:
            raise SolveError(f"rates of mechanism {mechanism.name!r}: {what}")
    named = [known[name] for name in rates]
    held = [each for each in (*mechanism.drivers, *known.values()) if each not in named]
    still = np.concatenate([equations.design, np.zeros(equations.unknowns + 1)])
    rows, right = equations.evaluate(still).rows, np.zeros(equations.count)
    for driver, rate in zip(named, rates.values(), strict=True):
        row, value = _driven_row(mechanism, equations, driver, rate)
        rows, right = np.vstack([rows, row]), np.append(right, value)
    v = np.linalg.lstsq(rows, right, rcond=RANK)[0]
    if np.abs(rows @ v - right).max() > RANK * np.abs(right).max():
        raise SolveError(
            f"mechanism {mechanism.name!r}: the rates {dict(rates)} contradict each other or the"
            " joints at the start; leave some out"
        )
    rank = np.linalg.matrix_rank(rows, tol=RANK * np.linalg.norm(rows, 2))
    for driver in held:
        row, _ = _driven_row(mechanism, equations, driver, 0.0)
        more = np.vstack([rows, row])
        size = np.linalg.matrix_rank(more, tol=RANK * np.linalg.norm(more, 2))
        if size > rank:
            rows, right, rank = more, np.append(right, 0.0), size
    # the least kinetic energy: what an impulse at the named coordinates gives
    scaled = np.linalg.lstsq(rows * equations.scale, right, rcond=RANK)[0]
    return equations.scale * scaled


def _driven_row(
    mechanism: Mechanism, equations: FreeEquations, driver: Driver, rate: float
) -> tuple[Array, float]:
    """Return the row of a driver at the design position, and its right-hand side at a rate."""
    frame = equations.frame
    drive = Drive(0.0, rate if driver.turns else rate / frame.unit, 0.0, 1.0, 0.0)
    driven = replace(mechanism, drivers=(driver,))
    formulation = Cartesian.of(driven, frame, {driver.name: drive}, named=angles(mechanism))
    right = formulation.nu(formulation.configuration(formulation.design))
    return jacobian(formulation)[-1], float(right[-1])
