"""Exudyn in projection mode: its absolute rigid-body coordinates, its joints, its constraint residual and Jacobian.

Every moving body has a node of its own with Euler parameters, so a closed loop is no different from a chain. A driver is a
generic joint of Exudyn with one constrained axis, and the sweep moves the frame of that joint on the first body: an angle is
compared with the driven frame, not with the design, so any number of turns can be driven.

Row conventions, measured on Exudyn 1.13.6 against rotation matrices, markers 0 and 1 being on the first and the second body:
a single constrained translation along x is x0 . (p1 - p0), a constrained rotation about z is x0 . y1. A free axis of a
generic joint leaves an empty row, which is dropped here.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.drivers import Driver, JointAngle, JointDisplacement, PointCoordinate
from ..core.errors import SolveError
from ..core.harness.case import Case
from ..core.joints import Distance, Fixed, Joint, Revolute, Spherical, Translational, Universal
from ..core.joints.base import triad, unit
from ..core.mechanism import GROUND
from ..core.trajectory import Array, Trajectory
from .projection import solve_by_projection

# Largest change of a coordinate per step of the differences of the Jacobian [m or -]. Round-off, 1e-16 / 1e-3, and truncation,
# (1e-3)^6 times the seventh derivative of the rows, are then both below 1e-12 of the speed squared.
DIFFERENCE = 1e-3
# Central differences of sixth order: h f' = sum of weight * f(k h).
WEIGHTS = ((-3, -1 / 60), (-2, 3 / 20), (-1, -3 / 4), (1, 3 / 4), (2, -3 / 20), (3, 1 / 60))
NO_ROTATION = (1.0, 0.0, 0.0, 0.0)


class Exudyn:
    """Exudyn as an engine; see `kincheck.core.harness.engine.Engine`."""

    name = "exudyn"
    mode = "projection"
    loop = "python"
    settings: Mapping[str, Any] = {
        "coordinates": "absolute, NodeRigidBodyEP, 7 per body",
        "residual": "ComputeAlgebraicEquations",
        "jacobian": "ComputeNewtonJacobian, constraint rows",
        "linear solver": "numpy solve, or least squares where rows are redundant",
        "acceleration": f"Jacobian differentiated along the velocity, sixth order, coordinates changed by {DIFFERENCE:g}",
    }

    def version(self) -> str | None:
        """Version of Exudyn, or None where it cannot be imported, for whatever reason."""
        try:
            return str(importlib.import_module("exudyn").__version__)
        except Exception:
            return None

    def unsupported(self, case: Case) -> str | None:
        """None, or the joint or driver that has no counterpart here."""
        for joint in case.mechanism.joints:
            if type(joint) not in _JOINTS:  # a subclass may mean something else
                return f"{joint}: no joint of Exudyn is known for this type"
        for driver in case.mechanism.drivers:
            if type(driver) not in _DRIVERS:
                return f"driver {driver.name!r} ({driver.type}): no way to drive this in Exudyn is known"
        return None

    def build(self, case: Case) -> ExudynModel:
        """Exudyn's system of the case, at the design position."""
        return ExudynModel(case)

    def solve(self, model: ExudynModel, case: Case, tol: float) -> Trajectory:
        """All samples; see `kincheck.core.harness.engine.Engine.solve`."""
        return solve_by_projection(model, case, tol, {"rows": len(model.target)})


@dataclass(frozen=True)
class _Drive:
    marker: int
    row: int
    move: Callable[[float], Array]  # driver value -> what the marker's design frame is multiplied by
    rate: float  # derivative of the row by the driver value, negated


class ExudynModel:
    """A `ProjectionModel`; the unknowns are Exudyn's displacements of the node coordinates (position, Euler parameters)."""

    def __init__(self, case: Case) -> None:
        self.mechanism = case.mechanism
        exu: Any = importlib.import_module("exudyn")
        exu.config.printToConsole = False  # results are reported by the harness; Exudyn's own banners would mix with them
        self.items: Any = importlib.import_module("exudyn.itemInterface")
        self.container: Any = exu.SystemContainer()  # owns the system and must live as long
        self.mbs: Any = self.container.AddSystem()
        self.rows: list[tuple[int, int, float]] = []  # object, its row, the value that row keeps
        self._add_bodies()
        for joint in self.mechanism.joints:
            _JOINTS[type(joint)](self, joint)
        self.drives = [_DRIVERS[type(driver)](self, driver) for driver in self.mechanism.drivers]
        self.mbs.Assemble()

        self.settings: Any = exu.SimulationSettings()
        self.settings.solution.file.write = False
        self.solver: Any = exu.MainSolverStatic()
        if not self.solver.InitializeSolver(self.mbs, self.settings):
            raise SolveError(f"case {case.name!r}: Exudyn does not initialise its solver: {self.solver.GetErrorString()}")
        self.state: Any = self.mbs.systemData
        self.unknowns = int(self.solver.GetODE2size())
        normalisation = [self.mbs.GetNodeAEIndex(node) for node in self.nodes]
        constraints = [self.state.GetObjectLTGAE(item)[row] for item, row, _ in self.rows]
        # in Exudyn's vector and matrix of the whole system the algebraic rows come after those of the coordinates
        self.kept = self.unknowns + np.array(constraints + normalisation)
        self.target = np.array([value for *_, value in self.rows] + [0.0] * len(normalisation))

        self.drive_frames = [np.array(self.mbs.GetMarkerParameter(drive.marker, "localHT")) for drive in self.drives]
        self.columns = np.zeros((len(self.kept), len(self.drives)))
        for k, drive in enumerate(self.drives):
            self.columns[drive.row, k] = drive.rate
        points = [(self.bodies[point.body], np.array(point.position)) for point in map(self.mechanism.point, case.points)]
        self.wanted = [(number, position - origin) for (number, origin), position in points]
        kinds = exu.OutputVariableType
        self.output_types = kinds.Position, kinds.Velocity, kinds.Acceleration
        self.reset()

    def _add_bodies(self) -> None:
        self.ground = int(self.mbs.AddObject(self.items.ObjectGround()))
        self.bodies = {GROUND: (self.ground, np.zeros(3))}  # Exudyn's number of the body, its origin
        self.nodes: list[int] = []
        for body in self.mechanism.bodies:
            if body.fixed:
                self.bodies[body.name] = self.bodies[GROUND]
                continue
            # Points and axes are given in global coordinates, so every node starts parallel to the global axes.
            node = self.mbs.AddNode(self.items.NodeRigidBodyEP(referenceCoordinates=[*body.origin, *NO_ROTATION]))
            # Exudyn asks for a mass and inertias; kinematics does not depend on them.
            rigid = self.items.ObjectRigidBody(mass=1.0, inertia=[1.0, 1.0, 1.0, 0.0, 0.0, 0.0], nodeNumber=node)
            self.bodies[body.name] = int(self.mbs.AddObject(rigid)), np.array(body.origin)
            self.nodes.append(node)

    def marker(self, body: str, position: Sequence[float], rotation: Array | None = None) -> int:
        """A frame on a body: its origin [m] and rotation matrix (aligned if None), both global at design."""
        number, origin = self.bodies[body]
        frame = np.eye(4)
        frame[:3, 3] = np.array(position) - origin
        if rotation is not None:
            frame[:3, :3] = rotation
        return self.mbs.AddMarker(self.items.MarkerBodyRigid(bodyNumber=number, localHT=frame))

    def markers(self, joint: Joint, position: Sequence[float], rotation: Array | None = None) -> list[int]:
        """The same frame on both bodies of a joint."""
        return [self.marker(body, position, rotation) for body in joint.bodies]

    def connect(self, item: Any, rows: Sequence[int], keeps: float = 0.0) -> int:
        """Add a joint object of which these rows are equations; the last keeps a value. Returns the place of the last row."""
        number = self.mbs.AddObject(item)
        self.rows += [(number, row, keeps if row == rows[-1] else 0.0) for row in rows]
        return len(self.rows) - 1

    def connect_generic(self, markers: Sequence[int], axes: Sequence[int], keeps: float = 0.0) -> int:
        """A generic joint that constrains these of the axes x, y, z, rotation x, y, z (0 to 5)."""
        constrained = [int(axis in axes) for axis in range(6)]
        item = self.items.ObjectJointGeneric(markerNumbers=list(markers), constrainedAxes=constrained)
        return self.connect(item, axes, keeps)

    def reset(self) -> None:
        self.restore(np.zeros(self.unknowns))

    def save(self) -> Array:
        return self.q

    def restore(self, saved: Array) -> None:
        self.q = saved
        self.state.SetODE2Coordinates(saved)

    def move(self, dx: Array) -> None:
        # Exudyn's Jacobian is exact along the unit sphere of the Euler parameters only: off it, Newton is no longer quadratic.
        q = (self.q + dx).reshape(-1, 7)
        parameters = q[:, 3:] + NO_ROTATION
        q[:, 3:] = parameters / np.linalg.norm(parameters, axis=1, keepdims=True) - NO_ROTATION
        self.restore(q.ravel())

    def residual(self, c: Array) -> Array:
        for drive, frame, value in zip(self.drives, self.drive_frames, c, strict=True):
            self.mbs.SetMarkerParameter(drive.marker, "localHT", frame @ drive.move(value))
        self.solver.ComputeAlgebraicEquations(self.mbs)
        return self.solver.GetSystemResidual()[self.kept] - self.target

    def jacobian(self) -> Array:
        # ComputeJacobianAE would add to what is there; this call clears it first
        self.solver.ComputeNewtonJacobian(self.mbs, self.settings)
        return self.solver.GetSystemJacobian()[self.kept, : self.unknowns]

    def driver_columns(self) -> Array:
        return self.columns

    def bias(self, v: Array) -> Array:
        # The driven frame rests meanwhile: where the rows are met, the terms that its motion would add are all zero.
        # The step follows the speed, so the accuracy does not depend on the rate of the sweep.
        h, q, total = DIFFERENCE / (np.abs(v).max() or 1.0), self.q, np.zeros(len(self.kept))
        for k, weight in WEIGHTS:
            self.state.SetODE2Coordinates(q + k * h * v)
            total += weight * (self.jacobian() @ v)
        self.state.SetODE2Coordinates(q)
        return total / h

    def points(self, v: Array, a: Array) -> list[tuple[Array, Array, Array]]:
        self.state.SetODE2Coordinates_t(v)
        self.state.SetODE2Coordinates_tt(a)
        return [self._motion(body, arm) for body, arm in self.wanted]

    def _motion(self, body: int, arm: Array) -> tuple[Array, Array, Array]:
        if body == self.ground:  # Exudyn has no acceleration output there
            return arm, np.zeros(3), np.zeros(3)
        position, velocity, acceleration = (self.mbs.GetObjectOutputBody(body, kind, arm) for kind in self.output_types)
        return position, velocity, acceleration


def _frame(axis: Sequence[float], column: int) -> Array:
    """A rotation matrix that has the axis, made a unit vector, in this column."""
    return np.roll(np.column_stack([tuple(e) for e in triad(axis)]), column - 2, axis=1)


def _spherical(model: ExudynModel, joint: Spherical) -> None:
    model.connect(model.items.ObjectJointSpherical(markerNumbers=model.markers(joint, joint.point)), range(3))


def _revolute(model: ExudynModel, joint: Revolute) -> None:
    markers = model.markers(joint, joint.point, _frame(joint.axis, 2))
    model.connect(model.items.ObjectJointRevoluteZ(markerNumbers=markers), range(5))


def _translational(model: ExudynModel, joint: Translational) -> None:
    markers = model.markers(joint, joint.point, _frame(joint.axis, 0))
    model.connect(model.items.ObjectJointPrismaticX(markerNumbers=markers), range(5))


def _universal(model: ExudynModel, joint: Universal) -> None:
    # The last row is x0 . y1, the cosine of the cross: an angle the table has rounded stays as it is.
    first, second = joint.axes
    markers = [model.marker(joint.i, joint.point, _frame(first, 0)), model.marker(joint.j, joint.point, _frame(second, 1))]
    model.connect_generic(markers, (0, 1, 2, 5), keeps=unit(first) @ unit(second))


def _distance(model: ExudynModel, joint: Distance) -> None:
    markers = [model.marker(body, point) for body, point in zip(joint.bodies, joint.points, strict=True)]
    model.connect(model.items.ObjectConnectorDistance(markerNumbers=markers, distance=joint.rod_length), range(1))


def _fixed(model: ExudynModel, joint: Fixed) -> None:
    point = model.bodies[joint.j][1] if joint.point is None else joint.point
    model.connect_generic(model.markers(joint, [*point]), range(6))


def _slid(c: float) -> Array:
    """Along x: the row is x0 . (p1 - p0) - c."""
    frame = np.eye(4)
    frame[0, 3] = c
    return frame


def _turned(c: float) -> Array:
    """About z: the row is sin(c - angle)."""
    frame = np.eye(4)
    frame[:2, :2] = [[np.cos(c), -np.sin(c)], [np.sin(c), np.cos(c)]]
    return frame


def _point_coordinate(model: ExudynModel, driver: PointCoordinate) -> _Drive:
    point, frame = model.mechanism.point(driver.point), _frame(driver.direction, 0)
    markers = [model.marker(body, point.position, frame) for body in (GROUND, point.body)]
    return _Drive(markers[0], model.connect_generic(markers, (0,)), _slid, rate=1.0)


def _joint_displacement(model: ExudynModel, driver: JointDisplacement) -> _Drive:
    joint: Any = model.mechanism.joint(driver.joint)
    markers = model.markers(joint, joint.point, _frame(joint.axis, 0))
    return _Drive(markers[0], model.connect_generic(markers, (0,)), _slid, rate=1.0)


def _joint_angle(model: ExudynModel, driver: JointAngle) -> _Drive:
    joint: Any = model.mechanism.joint(driver.joint)
    markers = model.markers(joint, joint.point, _frame(joint.axis, 2))
    return _Drive(markers[0], model.connect_generic(markers, (5,)), _turned, rate=-1.0)


_JOINTS: Mapping[type[Joint], Callable[[ExudynModel, Any], None]] = {
    Spherical: _spherical,
    Revolute: _revolute,
    Translational: _translational,
    Universal: _universal,
    Distance: _distance,
    Fixed: _fixed,
}
_DRIVERS: Mapping[type[Driver], Callable[[ExudynModel, Any], _Drive]] = {
    PointCoordinate: _point_coordinate,
    JointAngle: _joint_angle,
    JointDisplacement: _joint_displacement,
}
