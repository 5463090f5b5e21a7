"""Exudyn in projection mode: its absolute rigid-body coordinates, its joints, its constraint
residual and Jacobian.

Every moving body has one node with Euler parameters, so that closed loops and chains are alike.
`rows` creates the objects for joints and drivers; a row may follow a driver's
value or an unknown besides Exudyn's coordinates.

Exudyn computes the mass matrix, the right-hand side with its own loads and connectors, and the
Jacobian of all rows, which are joints. A torsional spring-damper has an additional unknown that
follows any number of turns, and acts by two torques that the adapter sets.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ...core.case.case import Case
from ...core.errors import SolveError
from ...core.joints import Joint
from ...core.joints.base import unit
from ...core.mechanism.loads import (
    Axes,
    Bushing,
    Force,
    SpringDamper,
    Torque,
    TorsionSpringDamper,
)
from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array
from ..shared.constraints import BodyFrame, skew
from ..shared.exudyn_joints import JOINTS
from ..shared.force_solution import Element, elastic_force, left_out_of, places, reacting_joints
from ..shared.projection_engine import ProjectionEngine
from ..shared.projection_model import Dynamics
from .rows import NO_ROTATION, Rows, System, rotation_about_z

COMPUTED_BY = {
    "inverse dynamics": "ComputeMassMatrix, ComputeODE2RHS with LoadMassProportional",
    "reactions of joints": "rows of ComputeNewtonJacobian",
    "force elements": (
        "ObjectConnectorSpringDamper, LoadForceVector, LoadTorqueVector; torques of torsional"
        " springs are set by the adapter; bushings and curves are the adapter's, by Exudyn's bodies"
    ),
}


@dataclass(frozen=True, eq=False)
class Twister:
    """A torsional spring-damper: the index of its angle among the unknowns of the rows, a marker on
    the joint's first body with z along the axis, and its torques on both bodies.
    """

    given: TorsionSpringDamper
    value: int
    marker: int
    torques: Sequence[tuple[int, float]]


class Loads:
    """The loads of a case in an Exudyn system, added before the system is assembled."""

    def __init__(self, rows: Rows, case: Case) -> None:
        self.rows, self.mbs, self.items, self.kinds = rows, rows.mbs, rows.items, rows.kinds
        self.case, self.mechanism = case, case.mechanism
        self.springs: dict[str, int] = {}
        self.twisters: list[Twister] = []
        self.amounts: dict[str, float] = {}
        self.framed: list[Bushing | SpringDamper] = []
        for body in self.mechanism.moving:
            marker = self.items.MarkerBodyMass(bodyNumber=rows.bodies[body.name][0])
            self.mbs.AddLoad(
                self.items.LoadMassProportional(
                    markerNumber=self.mbs.AddMarker(marker), loadVector=[*self.mechanism.gravity]
                )
            )
        for each in self.mechanism.forces:
            self.add(each)

    def add(self, each: Any) -> None:
        """Add a force element."""
        rows, items = self.rows, self.items
        if isinstance(each, Bushing) or (isinstance(each, SpringDamper) and each.curve):
            self.framed.append(each)
        elif isinstance(each, SpringDamper):
            self.springs[each.name] = self.add_spring(each, damping=each.damping)
        elif isinstance(each, TorsionSpringDamper):
            self.twisters.append(self._twister(each))
        else:
            assert isinstance(each, Force | Torque)
            self.amounts[each.name] = float(np.linalg.norm(each.vector))
            if self.mechanism.is_fixed(each.body):
                return
            _, origin = rows.bodies[each.body]
            point, kind = (
                (each.point, items.LoadForceVector)
                if isinstance(each, Force)
                else (origin, items.LoadTorqueVector)
            )
            self.mbs.AddLoad(
                kind(
                    markerNumber=rows.marker(each.body, point),
                    loadVector=[*each.vector],
                    bodyFixed=each.frame is Axes.BODY,
                )
            )

    def add_spring(self, each: SpringDamper, **law: Any) -> int:
        """Add Exudyn's spring between two points; return its number."""
        item = self.items.ObjectConnectorSpringDamper(
            markerNumbers=[self.rows.marker(*end) for end in places(each, self.mechanism)],
            referenceLength=each.free_length,
            stiffness=each.stiffness,
            **law,
        )
        return int(self.mbs.AddObject(item))

    def _twister(self, each: TorsionSpringDamper) -> Twister:
        rows, joint = self.rows, self.mechanism.joint(each.joint)
        place: Any = joint
        value = rows.unknown()
        rows.follow(rows.coordinate(each.joint, "rotation"), value)
        torques = [
            (int(self.mbs.AddLoad(self.items.LoadTorqueVector(markerNumber=marker))), sign)
            for body, marker, sign in zip(
                joint.bodies, rows.markers(joint, place.point), (-1.0, 1.0), strict=True
            )
            if not self.mechanism.is_fixed(body)
        ]
        return Twister(each, value, rows.marker(joint.i, place.point), torques)

    def dynamics(self, model: Any, J: Array, v: Array, a: Array) -> Dynamics:
        """Return the forces; see `ProjectionModel`.

        Args:
            model: the model in Exudyn; see `exudyn.ExudynModel`.
            J: Jacobian of all rows.
        """
        n, solver = model.coordinates, model.solver
        model.state.SetODE2Coordinates_t(v[:n])
        amounts = dict(self.amounts)
        for each in self.twisters:
            amounts[each.given.name] = self._twist(each, model, v)
        solver.ComputeMassMatrix(self.mbs)
        mass = np.array(solver.GetSystemMassMatrix())[:n, :n]
        solver.ComputeODE2RHS(self.mbs)
        demand = np.zeros(len(v))
        demand[:n] = mass @ a[:n] - np.array(solver.GetSystemResidual())[:n]
        for each in self.framed:
            amounts[each.name] = self._by_frames(each, v, demand)
        for name, number in self.springs.items():
            force = self.mbs.GetObjectOutput(number, self.kinds.ForceLocal)
            amounts[name] = float(np.atleast_1d(force)[0])
        rows, owners = [J], [""] * len(J)
        for each in left_out_of(self.mechanism, partial(self._frame, len(v))):
            rows.append(each.rows(len(owners))[0])
            owners += [each.of] * len(rows[-1])
        every = np.vstack(rows)
        reactions = {
            name: (np.zeros(6), self._on_second(self.mechanism.joint(name), every, owners))
            for name in reacting_joints(self.case)
        }
        return Dynamics(demand, reactions, amounts, every[len(J) :])

    def _by_frames(self, each: Bushing | SpringDamper, v: Array, demand: Array) -> float:
        """Take the wrenches of an element out of the demand; return its amount."""
        frames = [self._frame(len(v), *end) for end in places(each, self.mechanism)]
        for frame in frames:
            frame.velocity = frame.jacobian @ v
        amount, wrenches = Element(each, frames, np.zeros(3), lambda: 0.0).at_work()
        for frame, wrench in zip(frames, wrenches, strict=True):
            demand -= frame.jacobian.T @ wrench
        return amount

    def _twist(self, each: Twister, model: Any, v: Array) -> float:
        """Set the torques of a torsional spring-damper; return the torque on the second body."""
        given, place = each.given, model.coordinates + each.value - len(self.mechanism.drivers)
        joint: Any = self.mechanism.joint(given.joint)
        deflection = float(model.x[place]) - given.free_angle
        amount = -(elastic_force(given, deflection) + given.damping * float(v[place]))
        A = np.array(self.mbs.GetMarkerOutput(each.marker, self.kinds.RotationMatrix))
        axis = A.reshape(3, 3) @ np.array([*unit(joint.axis)])
        for load, sign in each.torques:
            self.mbs.SetLoadParameter(load, "loadVector", [*(sign * amount * axis)])
        return amount

    def _on_second(self, joint: Joint, J: Array, owners: Sequence[str]) -> Array:
        """Return the wrenches of unit multipliers of a joint's own rows on its second body, about
        the joint's point, shape (6, rows).

        Args:
            owners: the given joint of each row that is left out, else empty.
        """
        number, origin = self.rows.bodies[joint.j]
        arm = np.array(self.mechanism.reaction_point(joint)) - origin
        point = self._position(number, arm)
        fixed = self.mechanism.is_fixed(joint.j)
        body, sign = (joint.i, -1.0) if fixed else (joint.j, 1.0)
        k = [each.name for each in self.mechanism.moving].index(body)
        found, own = np.zeros((6, len(J))), [k for k, of in enumerate(owners) if of == joint.name]
        for part in self.mechanism.parts_of(joint.name):
            own += range(len(J))[self.rows.owned[part]]
        columns = J[own, 7 * k : 7 * k + 7]
        found[:, own] = sign * (columns @ self._rates(body, point)).T
        return found

    def _frame(self, unknowns: int, body: str, at: Vector) -> BodyFrame:
        """Return a frame of a body, at a point, global at design."""
        number, origin = self.rows.bodies[body]
        moving = [each.name for each in self.mechanism.moving]
        frame = BodyFrame(number, None, self._position(number, np.array(at) - origin))
        frame.jacobian = np.zeros((6, unknowns))
        if body in moving:
            k = 7 * moving.index(body)
            frame.jacobian[:, k : k + 7] = np.linalg.pinv(self._rates(body, frame.position))
            turned = self.mbs.GetObjectOutputBody(number, self.kinds.RotationMatrix)
            frame.rotation = np.array(turned).reshape(3, 3)
        return frame

    def _position(self, number: int, arm: Array) -> Array:
        if number == self.rows.ground:
            return arm
        return np.array(self.mbs.GetObjectOutputBody(number, self.kinds.Position, arm))

    def _rates(self, body: str, point: Array) -> Array:
        """Return the rates of a body's node by its twist at a point, shape (7, 6)."""
        number, _ = self.rows.bodies[body]
        node = self.mbs.GetObject(number)["nodeNumber"]
        x = np.array(self.mbs.GetNodeOutput(node, self.kinds.Coordinates)) + np.array(
            self.mbs.GetNodeParameter(node, "referenceCoordinates")
        )
        e0, e = x[3], x[4:]
        found = np.zeros((7, 6))
        found[:3, :3] = np.eye(3)
        found[:3, 3:] = skew(point - x[:3])  # w x (origin - point)
        found[3, 3:] = -0.5 * e
        found[4:, 3:] = 0.5 * (e0 * np.eye(3) - skew(e))  # w x e
        return found


# Steps of the finite differences of the rows' rates at unit speed [units of length or -]. Round-off
# is 1e-16 over the step. Truncation is the sixth power of the step times the seventh derivative of
# the rows; it matters where the path curves within a hundred steps, as near a fold.
DIFFERENCES = tuple(1e-3 * 0.5**k for k in range(8))
# If the estimates of fourth and sixth order agree to this fraction, the truncation of the latter is
# below round-off: the ratio of the two truncations is about the square of the step times the
# curvature, 1e-4 here.
AGREE = 1e-9
# Central differences at k: h f' = sum of weight * f(k h), of sixth order and of fourth.
STEPS = np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
WEIGHTS = np.array(
    [
        [-1 / 60, 3 / 20, -3 / 4, 3 / 4, -3 / 20, 1 / 60],
        [0.0, 1 / 12, -2 / 3, 2 / 3, -1 / 12, 0.0],
    ]
)


class Exudyn(ProjectionEngine):
    """The engine `exudyn`."""

    name, title, joints = "exudyn", "Exudyn", JOINTS

    @property
    def described(self) -> Mapping[str, Any]:
        """Return Exudyn's coordinates and the solver calls that give the rows."""
        return {
            "coordinates": "absolute, NodeRigidBodyEP, 7 per body",
            "residual": "ComputeAlgebraicEquations",
            "jacobian": "ComputeNewtonJacobian, constraint rows",
            "acceleration": (
                "ComputeAlgebraicEquations of rates, differentiated along the motion, sixth order,"
                f" coordinates changed by {DIFFERENCES[0]:g} or less"
            ),
        }

    def model_of(self, case: Case) -> ExudynModel:
        """Return Exudyn's system of the case."""
        return ExudynModel(case)


def _way(q: Array, v: Array, lengths: Array) -> tuple[Array, Array]:
    """Return coordinates and rates of all nodes at n lengths of a motion at constant rates, shape
    (n, coordinates) each.

    The motion is along lines and along great circles of the Euler parameters, since Exudyn's rates
    are those of the rows only on the unit sphere.
    """
    q, v, s = q.reshape(-1, 7), v.reshape(-1, 7), lengths[:, None, None]
    turn = _sizes(v[:, 3:])
    p, d = q[:, 3:] + NO_ROTATION, v[:, 3:] / np.where(turn, turn, 1.0)
    # real part: cosine p + sine d; imaginary part: sine p - cosine d
    turned = np.exp(1j * (s * turn)) * (p - 1j * d)
    coordinates, rates = q + s * v, np.empty((len(s), *v.shape))
    coordinates[..., 3:] = turned.real - NO_ROTATION
    rates[..., :3], rates[..., 3:] = v[:, :3], -turn * turned.imag
    return coordinates.reshape(len(s), -1), rates.reshape(len(s), -1)


def _sizes(p: Array) -> Array:
    """Return the lengths of rows, shape (n, 1)."""
    return np.sqrt(np.einsum("ij,ij->i", p, p))[:, None]


class ExudynModel:
    """A `ProjectionModel` of Exudyn's equations.

    Unknowns: displacements of the node coordinates (position, Euler parameters), then the further
    unknowns of the rows (see `rows`).
    """

    def __init__(self, case: Case) -> None:
        self.case = case
        system = self.system = System()
        self.mbs = system.mbs
        rows = Rows(system, case.mechanism, loaded=bool(case.forces))
        self.loads = Loads(rows, case) if case.forces else None
        self.mbs.Assemble()
        self.settings = system.settings()
        self.solver: Any = system.exu.MainSolverStatic()
        if not self.solver.InitializeSolver(self.mbs, self.settings):
            raise SolveError(
                f"case {case.name!r}: Exudyn does not initialise its solver:"
                f" {self.solver.GetErrorString()}"
            )
        self.state: Any = self.mbs.systemData
        self.coordinates = int(self.solver.GetODE2size())
        normalisation = [self.mbs.GetNodeAEIndex(node) for node in rows.nodes]
        constraints = [self.state.GetObjectLTGAE(row.item)[row.index] for row in rows.rows]
        # in Exudyn's system vector and matrix, the algebraic rows come after the rows of the
        # coordinates
        self.kept = self.coordinates + np.array(constraints + normalisation)
        self.target = np.array([row.keeps for row in rows.rows] + [0.0] * len(normalisation))

        # rows by values: drivers, then shared unknowns
        self.followed = np.zeros((len(self.kept), rows.values))
        for row, value, weight in rows.following:
            self.followed[row, value] = weight
        self.driven, self.shared = np.split(self.followed, [len(case.mechanism.drivers)], axis=1)
        # rows that follow a function: row, index of its unknown, minus the function
        drivers = len(case.mechanism.drivers)
        self.bent = [(row, value - drivers, curve) for row, value, curve in rows.bent]
        self.unknowns = self.coordinates + rows.values - drivers
        self.turning = [
            (row, pair, np.array(self.mbs.GetMarkerParameter(pair[0], "localHT")))
            for row, pair in rows.turning.items()
        ]
        points = [
            (rows.bodies[point.body], np.array(point.position))
            for point in map(case.mechanism.point, case.points)
        ]
        self.wanted = [(number, position - origin) for (number, origin), position in points]
        self.ground = rows.ground
        kinds = system.kinds
        self.rotation = kinds.RotationMatrix
        self.output_types = kinds.Position, kinds.Velocity, kinds.Acceleration
        self.details = {"rows": len(self.target)}
        self.reset()

    def reset(self) -> None:
        self.restore(np.zeros(self.unknowns))

    def save(self) -> Array:
        return self.x

    def restore(self, saved: Array) -> None:
        self.x = saved
        self.state.SetODE2Coordinates(self.q)

    @property
    def q(self) -> Array:
        """Exudyn's coordinates among the unknowns."""
        return self.x[: self.coordinates]

    def move(self, dx: Array) -> None:
        # Exudyn's Jacobian is exact only on the unit sphere of the Euler parameters: off the
        # sphere, Newton's convergence is not quadratic.
        x = self.x + dx
        q = x[: self.coordinates].reshape(-1, 7)
        p = q[:, 3:] + NO_ROTATION
        q[:, 3:] = p / _sizes(p) - NO_ROTATION
        self.restore(x)

    def residual(self, c: Array) -> Array:
        values = self.followed @ np.concatenate([c, self.x[self.coordinates :]])
        for row, place, curve in self.bent:
            values[row] = -curve.at(float(self.x[self.coordinates + place]))[0]
        for row, (first, second), frame in self.turning:
            self.mbs.SetMarkerParameter(first, "localHT", frame @ rotation_about_z(values[row]))
            # The frame has turned by the value: the row is the sine of the remaining angle. From
            # beyond a quarter turn, Newton would converge to the other zero of the sine; a
            # non-finite residual makes the walk take a shorter step.
            values[row] = 0.0 if self._x_axis(first) @ self._x_axis(second) > 0.0 else np.nan
        try:
            self.solver.ComputeAlgebraicEquations(self.mbs)
        except RuntimeError:
            # Exudyn raises an error at a pose that it cannot evaluate, such as a rod without length
            # in a diverged iteration: the walk takes a shorter step. At the design position it is a
            # fault of the model.
            if not self.x.any():
                raise
            return np.full(len(self.kept), np.nan)
        return self.solver.GetSystemResidual()[self.kept] - self.target - values

    def _x_axis(self, marker: int) -> Array:
        return self.mbs.GetMarkerOutput(marker, self.rotation)[::3]

    def jacobian(self) -> Array:
        # ComputeJacobianAE adds to the matrix; this call clears it first
        self.solver.ComputeNewtonJacobian(self.mbs, self.settings)
        found = self.solver.GetSystemJacobian().take(self.kept, axis=0)[:, : self.coordinates]
        if not self.shared.size:
            return found
        for row, place, curve in self.bent:
            self.shared[row, place] = -curve.at(float(self.x[self.coordinates + place]))[1]
        return np.hstack([found, -self.shared])

    def driver_columns(self) -> Array:
        return self.driven

    def bias(self, v: Array) -> Array:
        # The turned frames stay at rest here: if the rows are satisfied, their motion would only
        # add terms that are zero. The step depends on the speed, so the accuracy does not depend on
        # the rate of the sweep.
        v, rates = v[: self.coordinates], v[self.coordinates :]
        speed = np.abs(v).max() or 1.0
        unit_rates, bias = v / speed, np.zeros(len(self.kept))
        for h in DIFFERENCES:
            way = zip(*_way(self.q, unit_rates, h * STEPS), strict=True)
            bias, low = WEIGHTS / h @ [self._rates(*each) for each in way]
            if np.abs(bias - low).max() <= AGREE * max(np.abs(bias).max(), 1.0):
                break
        # the rows of the normalisation, |p|^2 = 1, stay satisfied on the way by its curvature alone
        turns = unit_rates.reshape(-1, 7)[:, 3:]
        bias[len(bias) - len(turns) :] = 2.0 * (turns**2).sum(axis=1)
        self.state.SetODE2Coordinates(self.q)
        bias *= speed**2
        for row, place, curve in self.bent:
            bias[row] += curve.at(float(self.x[self.coordinates + place]))[2] * rates[place] ** 2
        return bias

    def _rates(self, q: Array, q_t: Array) -> Array:
        """Return the rates of the rows. What Exudyn has not computed, the other rows of its system,
        may hold any number, also NaN.
        """
        self.state.SetODE2Coordinates(q)
        self.state.SetODE2Coordinates_t(q_t)
        self.solver.ComputeAlgebraicEquations(self.mbs, True)
        return self.solver.GetSystemResidual()[self.kept]

    def points(self, v: Array, a: Array) -> list[tuple[Array, Array, Array]]:
        self.state.SetODE2Coordinates_t(v[: self.coordinates])
        self.state.SetODE2Coordinates_tt(a[: self.coordinates])
        return [self._motion(body, arm) for body, arm in self.wanted]

    def _motion(self, body: int, arm: Array) -> tuple[Array, Array, Array]:
        if body == self.ground:  # Exudyn has no acceleration output for it
            return arm, np.zeros(3), np.zeros(3)
        position, velocity, acceleration = (
            self.mbs.GetObjectOutputBody(body, kind, arm) for kind in self.output_types
        )
        return position, velocity, acceleration

    computed_by: ClassVar[Mapping[str, str]] = COMPUTED_BY

    def dynamics(self, v: Array, a: Array) -> Dynamics:
        assert self.loads is not None
        return self.loads.dynamics(self, self.jacobian(), v, a)
