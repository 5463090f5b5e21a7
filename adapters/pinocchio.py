"""Pinocchio, projection mode: its joints as a spanning tree, its frames to close the loops; one code for Pinocchio 3.9 and 4.

Pinocchio's own constraint models are left alone: their signatures and the moment their data is fresh changed between 3 and 4,
the axes of their rows depend on the kind, and none is a distance. What is used means the same in both: placement, Jacobian,
velocity and classical acceleration of a frame, of which `closures` makes the rows of any joint.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.drivers import JointAngle, JointDisplacement, JointDriver, PointCoordinate
from ..core.harness.case import Case
from ..core.joints import Fixed, Joint, Revolute, Spherical, Translational, Universal
from ..core.joints.base import unit
from ..core.mechanism import GROUND, Vector
from ..core.topology import spanning_tree
from ..core.trajectory import Array, Trajectory
from .closures import CLOSURES, Condition
from .projection import solve_by_projection


class Pinocchio:
    """Engine "pinocchio"; see `Engine`."""

    name = "pinocchio"
    mode = "projection"
    loop = "python"
    settings: Mapping[str, Any] = {
        "coordinates": "spanning tree of Pinocchio joints; a body that no joint carries is a free flyer",
        "closures": "conditions on frame placements, Jacobians and classical accelerations",
        "linear solve": "numpy LU where the rows are square and independent, else least squares",
    }

    def version(self) -> str | None:
        """Version of Pinocchio, or None where it cannot be imported."""
        try:
            pin: Any = importlib.import_module("pinocchio")
            # PyPI's package "pinocchio" is something else and has no Model; the simulator's is "pin"
            return str(pin.__version__) if hasattr(pin, "Model") else None
        except Exception:  # a broken installation fails in many ways: a missing shared library, another numpy ABI
            return None

    def unsupported(self, case: Case) -> str | None:
        """None, or which joint or driver has no counterpart here."""
        for joint in case.mechanism.joints:
            if type(joint) not in CLOSURES:
                known = ", ".join(each.type for each in CLOSURES)
                return f"{joint}: the pinocchio adapter cannot express this type; it knows {known}"
        cut = {joint.name: joint for joint in spanning_tree(case.mechanism).cut}
        for driver in case.mechanism.drivers:
            who = f"driver {driver.name!r} ({driver.type})"
            if type(driver) not in (PointCoordinate, JointAngle, JointDisplacement):
                return f"{who}: the pinocchio adapter drives point coordinates, joint angles and joint displacements only"
            if isinstance(driver, JointDriver) and driver.joint in cut:
                return f"{who}: {cut[driver.joint]} closes a loop of driven joints and is no coordinate of a tree; drive a point"
        return None

    def build(self, case: Case) -> _Model:
        """Tree, frames and conditions of the case, at the design position."""
        return _Model(importlib.import_module("pinocchio"), case)

    def solve(self, model: _Model, case: Case, tol: float) -> Trajectory:
        """Solve all samples; see `Engine.solve`."""
        return solve_by_projection(model, case, tol, {"closures": model.closures})


# Axes are normalised, because Pinocchio takes others without a word and then shears the body. A universal joint is two
# revolutes, which keep the design angle of the cross where a table has rounded its right angle.
_TREE: dict[type[Joint], Callable[[Any, Any], list[Any]]] = {
    Spherical: lambda pin, joint: [pin.JointModelSpherical()],
    Revolute: lambda pin, joint: [pin.JointModelRevoluteUnaligned(_unit(joint.axis))],
    Translational: lambda pin, joint: [pin.JointModelPrismaticUnaligned(_unit(joint.axis))],
    Universal: lambda pin, joint: [pin.JointModelRevoluteUnaligned(_unit(axis)) for axis in joint.axes],
    Fixed: lambda pin, joint: [],
}
"""The joints of the tree that make a joint, from its first body to its second; a distance carries nothing."""


class _Model:
    """The mechanism in Pinocchio; a `ProjectionModel`. Rows: those of the cut joints, then one a driver."""

    def __init__(self, pin: Any, case: Case) -> None:
        mechanism, tree = case.mechanism, spanning_tree(case.mechanism)
        self.pin, self.model, self.axes = pin, pin.Model(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        self.carrier = {name: 0 for name in (GROUND, *(body.name for body in mechanism.bodies)) if mechanism.is_fixed(name)}
        self.origin = [np.zeros(3)]
        moved: dict[str, tuple[int, int]] = {}
        for branch in tree.branches:
            joint, at = branch.joint, self.carrier[branch.parent]
            if joint is None:
                at = self._add_joint(at, pin.JointModelFreeFlyer(), mechanism.body(branch.child).origin)
            else:
                sign = 1 if joint.j == branch.child else -1
                for each in _TREE[type(joint)](pin, joint)[::sign]:
                    at = self._add_joint(at, each, vars(joint)["point"])
                moved[joint.name] = at, sign
            self.carrier[branch.child] = at

        self.conditions: list[Condition] = []
        self.closures: dict[str, str] = {}
        for joint in tree.cut:
            # a fixed joint may come without a point: any serves, the origin of a moving body is near
            P = vars(joint).get("point") or next(body.origin for body in mechanism.moving if body.name in joint.bodies)
            i, j = map(self._add_frame, joint.bodies, vars(joint).get("points", (P, P)))
            closure = CLOSURES[type(joint)]
            self.closures[joint.name] = closure.text
            self.conditions += closure.conditions(joint, i, j)
        for driver in mechanism.drivers:
            if isinstance(driver, PointCoordinate):
                point = mechanism.point(driver.point)
                frame = self._add_frame(point.body, point.position)
                self.conditions.append(_DrivenPoint(frame, _unit(driver.direction), np.array(point.position)))
            elif isinstance(driver, JointDriver):
                self.conditions.append(_DrivenJoint(self, *moved[driver.joint]))
        self.wanted = [self._add_frame(point.body, point.position) for point in map(mechanism.point, case.points)]

        ends = np.cumsum([each.n for each in self.conditions])
        self.slices = [slice(end - each.n, end) for end, each in zip(ends, self.conditions, strict=True)]
        self.J = np.zeros((ends[-1], self.model.nv))
        self.columns = np.eye(ends[-1])[:, ends[-1] - len(mechanism.drivers) :]  # the rows of the drivers are the last
        self.data = self.model.createData()
        self.reset()

    def _add_joint(self, parent: int, joint: Any, at: Vector) -> int:
        """The number of a new joint at that point, global at design."""
        placement = self.pin.SE3(np.eye(3), np.array(at) - self.origin[parent])
        self.origin.append(np.array(at))
        return self.model.addJoint(parent, joint, placement, f"joint {self.model.njoints}")

    def _add_frame(self, body: str, at: Vector) -> _Frame:
        """A new frame on the body at that point, global at design."""
        joint = self.carrier[body]
        placement = self.pin.SE3(np.eye(3), np.array(at) - self.origin[joint])
        # numbered, because a second frame of one name would silently be the first one
        name = f"frame {self.model.nframes}"
        return _Frame(self, self.model.addFrame(self.pin.Frame(name, joint, 0, placement, self.pin.FrameType.OP_FRAME)))

    def reset(self) -> None:
        self.q: Array = self.pin.neutral(self.model)

    def save(self) -> Array:
        return self.q  # never changed in place

    def restore(self, saved: Array) -> None:
        self.q = saved

    def move(self, dx: Array) -> None:
        self.q = self.pin.integrate(self.model, self.q, dx)

    def residual(self, c: Array) -> Array:
        self.pin.computeJointJacobians(self.model, self.data, self.q)
        self.pin.updateFramePlacements(self.model, self.data)
        r = -(self.columns @ c)
        for rows, condition in zip(self.slices, self.conditions, strict=True):
            phi, self.J[rows] = condition.rows()
            r[rows] += phi
        return r

    def jacobian(self) -> Array:
        return self.J

    def driver_columns(self) -> Array:
        return self.columns

    def bias(self, v: Array) -> Array:
        # with no acceleration of the coordinates, a frame's acceleration is its Jdot v
        self.pin.forwardKinematics(self.model, self.data, self.q, v, np.zeros_like(v))
        bias = np.empty(len(self.J))
        for rows, condition in zip(self.slices, self.conditions, strict=True):
            bias[rows] = condition.bias()
        return bias

    def points(self, v: Array, a: Array) -> list[tuple[Array, Array, Array]]:
        self.pin.forwardKinematics(self.model, self.data, self.q, v, a)
        return [(frame.position, frame.velocity[:3], frame.acceleration[:3]) for frame in self.wanted]


@dataclass(frozen=True, eq=False)
class _Frame:
    """A frame of the model, which it reads as last computed; see `closures.Frame`."""

    of: _Model
    index: int

    @property
    def position(self) -> Array:
        return self.of.data.oMf[self.index].translation

    @property
    def rotation(self) -> Array:
        return self.of.data.oMf[self.index].rotation

    @property
    def jacobian(self) -> Array:
        return self.of.pin.getFrameJacobian(self.of.model, self.of.data, self.index, self.of.axes)

    @property
    def velocity(self) -> Array:
        return self.of.pin.getFrameVelocity(self.of.model, self.of.data, self.index, self.of.axes).vector

    @property
    def acceleration(self) -> Array:
        return self.of.pin.getFrameClassicalAcceleration(self.of.model, self.of.data, self.index, self.of.axes).vector


@dataclass(frozen=True, eq=False)
class _DrivenPoint:
    """The displacement since design of a point along the fixed direction k [m]."""

    frame: _Frame
    k: Array
    design: Array
    n = 1

    def rows(self) -> tuple[Any, Array]:
        return self.k @ (self.frame.position - self.design), self.k @ self.frame.jacobian[:3]

    def bias(self) -> Any:
        return self.k @ self.frame.acceleration[:3]


@dataclass(frozen=True, eq=False)
class _DrivenJoint:
    """A joint's coordinate, with the sign that makes it second body relative to first [rad or m]."""

    of: _Model
    joint: int
    sign: int
    n = 1

    def rows(self) -> tuple[Any, Array]:
        moved, row = self.of.model.joints[self.joint], np.zeros(self.of.model.nv)
        row[moved.idx_v] = self.sign
        return self.sign * self.of.q[moved.idx_q], row

    def bias(self) -> Any:
        return 0.0


def _unit(a: Vector) -> Array:
    return np.array([*unit(a)])
