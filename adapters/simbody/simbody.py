"""Simbody in projection mode: its joints as a spanning tree, its own constraints to close loops.

The simulator comes with OpenSim's Python package. A cut joint has its slides and hinges on its
first body (see `tree_plan`); one constraint of Simbody, of a point or of a whole frame, ties
their end to the second body. A rod is a constant distance, and a coordinate coupler relates two
coordinates. Simbody gives residual, Jacobian and bias of these rows; the base adds the drivers.

The axes of every body are global at design. Names are numbers, because OpenSim aborts the process
at a name with a space. Limits of coordinates have no effect: they act on forces and on `setValue`,
and neither is used.

OpenSim disables Simbody's quaternions, and its package cannot enable them. At a second angle of 90
degrees the rates of the other two are infinite (gimbal lock), but the velocities of a ball joint in
Simbody are its angular velocity, which has no lock. So a step rotates Euler parameters by this
velocity, and Simbody gets the angles of the result: no rate of an angle is used.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import cos, hypot, sin
from typing import Any, ClassVar

import numpy as np

from ...core.case.case import Case
from ...core.joints import Distance, Inline, Spherical
from ...core.joints.base import unit
from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array
from ..shared.axis_angles import Parameters, euler_angles, orientation
from ..shared.force_solution import RowWrench
from ..shared.tree_forces import NO_MASS, Mass, mass_properties
from ..shared.tree_model import TreeEngine, TreeModel
from ..shared.tree_plan import Closure, Link, Relation

UNTURNED: Parameters = (1.0, 0.0, 0.0, 0.0)


def turn_parameters(p: Sequence[float], turn: Sequence[float]) -> Parameters:
    """Return Euler parameters p after a further rotation by a rotation vector in the axes of the
    parent [rad].
    """
    e0, e1, e2, e3 = p
    x, y, z = turn
    angle = hypot(x, y, z)
    # sin(angle / 2) / angle; at an angle of 1e-8 its next term is below round-off
    scale = sin(0.5 * angle) / angle if angle > 1e-8 else 0.5
    w, x, y, z = cos(0.5 * angle), scale * x, scale * y, scale * z
    parameters = (
        w * e0 - x * e1 - y * e2 - z * e3,
        w * e1 + x * e0 + y * e3 - z * e2,
        w * e2 - x * e3 + y * e0 + z * e1,
        w * e3 + x * e2 - y * e1 + z * e0,
    )
    size = hypot(*parameters)
    e0, e1, e2, e3 = parameters
    return e0 / size, e1 / size, e2 / size, e3 / size


NO_TURN = (0.0, 0.0, 0.0)


def coordinate_name(body: int) -> str:
    """Return the name in OpenSim of the coordinate of a body's slide or hinge."""
    return f"coordinate_{body}"


class Simbody(TreeEngine):
    """The engine `simbody`."""

    name, title, package = "simbody", "Simbody", "opensim"

    @property
    def described(self) -> Mapping[str, Any]:
        """Return the coordinates of Simbody's tree and the calls that give the rows of its
        constraints.
        """
        return {
            "coordinates": (
                "spanning tree of OpenSim's slider, pin and ball joints; balls keep Euler"
                " parameters here, and Simbody gets their Euler angles"
            ),
            "residual": "getQErr; drivers: coordinates, or points of bodies",
            "jacobian": "calcG; driven points: calcFrameJacobian",
            "acceleration": (
                "calcBiasForAccelerationConstraints; points: calcBiasForFrameJacobian"
            ),
            "cut_joints": (
                "ConstantDistanceConstraint or PointOnLineConstraint; or PointConstraint or"
                " WeldConstraint, to an auxiliary body where the joint has slides or hinges"
            ),
            "relations": "CoordinateCouplerConstraint",
        }

    def model_of(self, case: Case) -> SimbodyModel:
        """Return OpenSim's model of the case."""
        return SimbodyModel(opensim(), case)


def opensim() -> Any:
    """Return OpenSim's package without its messages, imported at the first call."""
    package: Any = importlib.import_module("opensim")
    package.Logger.setLevelString("Off")
    return package


@dataclass(frozen=True, eq=False)
class Constraints:
    """All rows of Simbody's constraints; see `constraints.Condition`."""

    of: SimbodyModel
    n: int

    def rows(self) -> tuple[Any, Array]:
        state, G = self.of.state, self.of.matrix
        self.of.matter.calcG(state, G)
        return state.getQErr().to_numpy(), G.to_numpy()

    def bias(self) -> Any:
        self.of.matter.calcBiasForAccelerationConstraints(self.of.state, self.of.column)
        return self.of.column.to_numpy()


class SimbodyModel(TreeModel):
    """The OpenSim model of a case: a body with its joint for each link, a constraint for each cut
    joint and each relation.

    The configuration q has the coordinates of slides and hinges at Simbody's indices, and Euler
    parameters at the four indices of a ball.

    Attributes:
        o: OpenSim's package.
        model: OpenSim's model, which owns all other objects.
        bodies: OpenSim's bodies by their numbers; the first is the ground.
        moves: OpenSim's joint of each body after the ground.
        slots: number of Simbody's coordinates.
        balls: indices of each ball's coordinates in q and v.
    """

    whole = (Distance, Inline)
    recursion = False
    computed_by: ClassVar[Mapping[str, str]] = {
        "inverse dynamics": "calcResidualForceIgnoringConstraints, getGravityBodyForces",
        "reactions of tree joints": (
            "Newton and Euler, of the adapter, by velocities and accelerations of Simbody's bodies"
        ),
        "reactions of cut joints": "calcConstraintForcesFromMultipliers",
        "force elements": "of the adapter, by stations of Simbody",
    }

    def __init__(self, o: Any, case: Case) -> None:
        self.o, self.model = o, o.Model()
        self.bodies = [self.model.getGround()]
        self.moves: list[Any] = []
        super().__init__(case)

    def add_link(self, parent: int, link: Link, offset: Array) -> None:
        o, number = self.o, len(self.bodies)
        joint = {"slide": o.SliderJoint, "hinge": o.PinJoint, "ball": o.BallJoint}[link.move]
        axes = self.vector(orientation(link.move, link.axis))
        # kinematics does not depend on masses, but OpenSim requires them
        mass = NO_MASS if self.loaded else 1.0
        body = o.Body(f"body_{number}", mass, o.Vec3(0.0), o.Inertia(mass, mass, mass))
        move = joint(
            f"joint_{number}",
            self.bodies[parent],
            self.vector(offset),
            axes,
            body,
            o.Vec3(0.0),
            axes,
        )
        if link.move != "ball":
            move.upd_coordinates(0).setName(coordinate_name(number))
        self.model.addBody(body)
        self.model.addJoint(move)
        self.bodies.append(body)
        self.moves.append(move)

    def close(self, closure: Closure) -> None:
        i, j = self.bodies_of(closure)
        if i == j:
            # OpenSim aborts the process at a constraint of a body with itself
            super().close(closure)
            return
        o, joint = self.o, closure.joint
        at_i, at_j = (
            (self.bodies[body], self.vector(np.array(P) - self.origin[body]))
            for body, P in zip((i, j), closure.points, strict=True)
        )
        none = self.vector(NO_TURN)
        if isinstance(joint, Distance):
            rows, constraint = 1, o.ConstantDistanceConstraint(*at_i, *at_j, joint.rod_length)
        elif isinstance(joint, Inline):
            body, P = at_i
            along = self.vector(unit(joint.axis))
            rows, constraint = 2, o.PointOnLineConstraint(body, along, P, *at_j)
        elif closure.by is Spherical:
            rows, constraint = 3, o.PointConstraint(*at_i, *at_j)
        else:
            rows, constraint = 6, o.WeldConstraint("weld", *at_i, none, *at_j, none)
        self.constrain(constraint, rows, joint.name)
        moved = f", on a body that {' and '.join(closure.links)} move on {joint.i!r}"
        name = constraint.getConcreteClassName()
        self.closures[joint.name] = name + (moved if closure.links else "")

    def relate(self, relation: Relation) -> None:
        if relation.curve or len(relation.terms) > 2:
            super().relate(relation)
            return
        o, coupler = self.o, self.o.CoordinateCouplerConstraint()
        one, other, function = relation.follower(signed=True)
        names = o.ArrayStr()
        names.append(coordinate_name(self.coordinates[other][0]))
        coupler.setIndependentCoordinateNames(names)
        coupler.setDependentCoordinateName(coordinate_name(self.coordinates[one][0]))
        coupler.setFunction(o.LinearFunction(function.at(0.0)[1], 0.0))
        self.constrain(coupler, 1, relation)

    def constrain(self, constraint: Any, rows: int, keeps: str | Relation) -> None:
        """Add a constraint with a number of rows under a unique name."""
        self.own.append((rows, keeps))
        constraint.setName(f"constraint_{self.model.getNumConstraints()}")
        self.model.addConstraint(constraint)

    def vector(self, a: Iterable[float]) -> Any:
        """Return a vector as OpenSim's type."""
        return self.o.Vec3(*map(float, a))

    def finish(self) -> None:
        o = self.o
        self.model.finalizeConnections()
        self.state = self.model.initSystem()
        self.matter = self.model.getMatterSubsystem()
        self.slots, n = self.state.getNQ(), self.state.getNU()
        # each value is its index, so that every coordinate reports its index
        self.state.setQ(o.Vector.createFromMat(np.arange(float(self.slots))))
        self.state.setU(o.Vector.createFromMat(np.arange(float(n))))
        first = [move.get_coordinates(0) for move in self.moves]
        self.places = [
            (int(each.getValue(self.state)), int(each.getSpeedValue(self.state))) for each in first
        ]
        turns = [move.numCoordinates() == 3 for move in self.moves]
        self.balls = [at for at, ball in zip(self.places, turns, strict=True) if ball]
        self.single = np.array(
            [at for at, ball in zip(self.places, turns, strict=True) if not ball], dtype=np.intp
        ).reshape(-1, 2)
        self.matrix, self.column = o.Matrix(), o.Vector()
        rows = self.state.getNQErr()
        if rows:
            self.conditions.insert(0, Constraints(self, rows))

    @property
    def unknowns(self) -> int:
        return self.state.getNU()

    def coordinate(self, body: Any) -> tuple[int, int]:
        return self.places[int(body) - 1]

    def design(self) -> Array:
        q = np.zeros(self.slots)
        for at, _ in self.balls:
            q[at : at + 4] = UNTURNED
        return q

    def configuration_after(self, dx: Array) -> Array:
        q, (at_q, at_v) = self.q.copy(), self.single.T
        q[at_q] += dx[at_v]
        for k, n in self.balls:
            q[k : k + 4] = turn_parameters(q[k : k + 4].tolist(), dx[n : n + 3].tolist())
        return q

    def place(self) -> None:
        q = self.q.copy()
        for k, _ in self.balls:
            q[k : k + 4] = *euler_angles(q[k : k + 4].tolist()), 0.0
        self.state.setQ(self.o.Vector.createFromMat(q))
        self.model.realizePosition(self.state)

    def rate(self, v: Array, a: Array) -> None:
        self.a = a
        self.state.setU(self.o.Vector.createFromMat(v))
        self.model.realizeVelocity(self.state)

    def make_frame(self, body: int, offset: Array) -> tuple[Any, Any]:
        return self.bodies[body], self.vector(offset)

    def _place(self, handle: tuple[Any, Any]) -> tuple[Any, Any, Any]:
        body, point = handle
        return self.state, body.getMobilizedBodyIndex(), point

    def position(self, handle: tuple[Any, Any]) -> Array:
        """Return the position of a frame's point."""
        body, point = handle
        return body.findStationLocationInGround(self.state, point).to_numpy()

    def placement(self, handle: tuple[Any, Any]) -> tuple[Array, Array]:
        R = handle[0].getTransformInGround(self.state).R()
        return self.position(handle), np.array([[R.get(i, j) for j in range(3)] for i in range(3)])

    def slope(self, handle: tuple[Any, Any]) -> Array:
        self.matter.calcFrameJacobian(*self._place(handle), self.matrix)
        J = self.matrix.to_numpy()
        return np.concatenate((J[3:], J[:3]))  # Simbody has the rotation first

    def motion(self, handle: tuple[Any, Any]) -> tuple[Array, Array]:
        body, point = handle
        speed = body.findStationVelocityInGround(self.state, point).to_numpy()
        turn = body.getAngularVelocityInGround(self.state).to_numpy()
        bias = self._bias(handle)
        acceleration = bias + self.slope(handle) @ self.a if self.a.any() else bias
        return np.concatenate((speed, turn)), acceleration

    def _bias(self, handle: tuple[Any, Any]) -> Array:
        bias = self.matter.calcBiasForFrameJacobian(*self._place(handle))
        return np.concatenate((bias.get(1).to_numpy(), bias.get(0).to_numpy()))

    # driven points need no rotation, which takes much of the time of a pose

    def observe(self) -> None:
        if self.tied:
            super().observe()
            return
        self.place()
        for frame in self.moving:
            frame.position, frame.jacobian = self.position(frame.handle), self.slope(frame.handle)

    def observe_rates(self, v: Array) -> None:
        if self.tied:
            super().observe_rates(v)
            return
        self.v = v
        self.rate(v, np.zeros_like(v))
        for frame in self.moving:
            frame.acceleration = self._bias(frame.handle)

    def points(self, v: Array, a: Array) -> list[tuple[Array, Array, Array]]:
        self.rate(v, a)
        found: list[tuple[Array, Array, Array]] = []
        for frame in self.wanted:
            if frame.handle is None:
                found.append((frame.position, np.zeros(3), np.zeros(3)))
                continue
            self.matter.calcStationJacobian(*self._place(frame.handle), self.matrix)
            J = self.matrix.to_numpy()
            bias = self.matter.calcBiasForStationJacobian(*self._place(frame.handle)).to_numpy()
            found.append((self.position(frame.handle), J @ v, bias + J @ a))
        return found

    def set_loads(self, gravity: Vector, masses: Sequence[Mass]) -> None:
        self.model.setGravity(self.vector(gravity))
        for each in masses:
            link: int = each.frame.body
            mass, center, I = mass_properties(each.body, self.origin[link])  # noqa: E741
            entries = I[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()
            body = self.bodies[link]
            body.setMass(mass)
            body.setMassCenter(self.vector(center))
            body.setInertia(self.o.Inertia(*entries))

    def inverse_dynamics(self, v: Array, a: Array) -> Array:
        o, state, n = self.o, self.state, self.unknowns
        self.rate(v, a)
        self.model.realizeDynamics(state)
        none, found = o.Vector(n, 0.0), o.Vector(n, 0.0)
        gravity = self.model.getGravityBodyForces(state)
        self.matter.calcResidualForceIgnoringConstraints(
            state, none, gravity, o.Vector.createFromMat(np.ascontiguousarray(a)), found
        )
        return np.array(found.to_numpy())

    def row_wrenches(self) -> list[RowWrench]:
        found = super().row_wrenches()
        origins = [self.position_of(number) for number in range(len(self.bodies))]
        for rows, keeps in self.own_rows:
            if not isinstance(keeps, str):
                continue
            wrenches = np.array([self._on_bodies(row) for row in range(rows.start, rows.stop)])
            found += [
                RowWrench(rows, number, origins[number], wrenches[:, number])
                for number in range(len(self.bodies))
                if wrenches[:, number].any()
            ]
        return found

    def position_of(self, number: int) -> Array:
        """Return the position of a body's origin."""
        body = self.bodies[number]
        return body.findStationLocationInGround(self.state, self.o.Vec3(0.0)).to_numpy()

    def _on_bodies(self, row: int) -> Array:
        """Return the wrench of a unit multiplier on each body, shape (bodies, 6): force over moment
        about its origin.
        """
        o, unit = self.o, np.zeros(self.own_count)
        unit[row] = 1.0
        on_bodies, on_coordinates = o.VectorOfSpatialVec(), o.Vector()
        self.matter.calcConstraintForcesFromMultipliers(
            self.state, o.Vector.createFromMat(unit), on_bodies, on_coordinates
        )
        each = [on_bodies.get(int(body.getMobilizedBodyIndex())) for body in self.bodies]
        return np.array([[*w.get(1).to_numpy(), *w.get(0).to_numpy()] for w in each])
