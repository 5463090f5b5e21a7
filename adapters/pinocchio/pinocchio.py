"""Pinocchio, projection mode: its joints as a spanning tree, its frames to close the loops; one
code for Pinocchio 3.9 and 4.

Pinocchio's own constraint models are left alone: their signatures and the moment their data is
fresh changed between 3 and 4, the axes of their rows depend on the kind, and none is a distance.
The adapter uses quantities with the same meaning in both: placement, Jacobian, velocity and
classical acceleration of a frame. `loop_closures` makes the rows of any joint of them.
"""

from __future__ import annotations

import importlib
from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.harness.engine import Floor
from ...core.joints import AxialJoint, ConstantVelocity, Fixed, Joint
from ...core.joints.base import unit
from ...core.mechanism.drivers import JointDriver, PointCoordinate
from ...core.mechanism.mechanism import GROUND, Mechanism, Vector
from ...core.mechanism.topology import Branch, SpanningTree, spanning_tree
from ...core.trajectory import Array
from ..shared.compiled_floor import floor_of
from ..shared.frame_constraints import Condition
from ..shared.length_scaling import in_own_frame
from ..shared.loop_closures import CLOSURES, ends_of, twistless
from ..shared.projection_engine import ProjectionEngine
from .rows import DrivenPoint, Frame, Linear
from .tree_joints import TREE_JOINTS


class Pinocchio(ProjectionEngine):
    """The engine `pinocchio`."""

    name, title, joints = "pinocchio", "Pinocchio", CLOSURES

    @property
    def described(self) -> Mapping[str, Any]:
        """Coordinates of Pinocchio's tree and the equations of its loops."""
        return {
            "coordinates": (
                "spanning tree of Pinocchio joints; a body that no joint carries is a free flyer"
            ),
            "closures": "conditions on frame placements, Jacobians and classical accelerations",
        }

    def version_of(self, simulator: Any) -> str | None:
        """Return the version; None for PyPI's unrelated "pinocchio", which has no Model.

        The simulator's package on PyPI is "pin".
        """
        return super().version_of(simulator) if hasattr(simulator, "Model") else None

    def build(self, case: Case) -> PinocchioModel:
        """Return tree, frames and conditions of the case, at the design position."""
        return PinocchioModel(importlib.import_module("pinocchio"), in_own_frame(case))

    def floor(self, case: Case) -> Floor:
        """Return the floor from the Jacobians and placements of joints and frames."""
        model = self.build(case)
        solved = self.solve(model, case, 1e-12)
        pin, least = model.pin, model.pin.Model()
        # Pinocchio ends the process where it is asked for the Jacobian of a frame that no joint
        # carries
        joint = least.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "joint")
        frame = least.addFrame(
            pin.Frame("frame", joint, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME)
        )
        own, empty = (model.model, model.data), (least, least.createData())
        zero = np.zeros(model.model.nv)

        def calls(
            function: Any, *given: Any, none: tuple[Any, ...] | None = None, times: int = 1
        ) -> tuple[Any, Any, int]:
            return (
                partial(function, *own, *given),
                partial(function, *empty, *(none or (np.zeros(1),) * len(given))),
                times,
            )

        frames = model.model.nframes - 1 - len(model.wanted)
        pose = {
            "computeJointJacobians": calls(pin.computeJointJacobians, model.q),
            "updateFramePlacements": calls(pin.updateFramePlacements),
            "getFrameJacobian": calls(
                pin.getFrameJacobian, 1, model.axes, none=(frame, model.axes), times=frames
            ),
        }
        rates = {"forwardKinematics": calls(pin.forwardKinematics, model.q, zero, zero, times=2)}
        return floor_of(self, solved, model.model.nv, pose, rates)


class PinocchioModel:
    """The mechanism in Pinocchio; a `ProjectionModel`. Rows: those of joints, then of couplers,
    then one a driver.
    """

    def __init__(self, pin: Any, case: Case) -> None:
        self.case = case
        mechanism, tree = case.mechanism, spanning_tree(case.mechanism)
        self.pin, self.model, self.axes = pin, pin.Model(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        self.carrier = {
            name: 0
            for name in (GROUND, *(body.name for body in mechanism.bodies))
            if mechanism.is_fixed(name)
        }
        self.origin = [np.zeros(3)]
        self.coordinates: dict[tuple[str, str], tuple[int, int]] = {}
        self.conditions: list[Condition] = []
        self.closures: dict[str, str] = {}
        for branch in self._branches(mechanism, tree):
            joint, at = branch.joint, self.carrier[branch.parent]
            if joint is None:
                self.carrier[branch.child] = self._add_joint(
                    at, pin.JointModelFreeFlyer(), mechanism.body(branch.child).origin
                )
                continue
            P = ends_of(mechanism, joint)[0]
            self.carrier[branch.child] = self._add_chain(
                at, joint, P, 1 if joint.j == branch.child else -1
            )
            if isinstance(joint, ConstantVelocity):
                self.closures[joint.name] = "ball joint of the tree, shafts turn alike (1 row)"
                self.conditions += twistless(
                    joint, *(self._add_frame(self.carrier[body], P) for body in joint.bodies)
                )

        named = {name for coupler in mechanism.couplers for name in coupler.joints}
        named |= {driver.joint for driver in mechanism.drivers if isinstance(driver, JointDriver)}
        for joint in tree.cut:
            i, j = (self.carrier[body] for body in joint.bodies)
            self._close(joint, i, j, ends_of(mechanism, joint), joint.name in named)
        for each in mechanism.couplers:
            self.conditions.append(self._linear(*each.terms))
        for driver in mechanism.drivers:
            if isinstance(driver, PointCoordinate):
                point = mechanism.point(driver.point)
                frame = self._add_frame(self.carrier[point.body], point.position)
                self.conditions.append(
                    DrivenPoint(
                        frame, np.array([*unit(driver.direction)]), np.array(point.position)
                    )
                )
            elif isinstance(driver, JointDriver):
                self.conditions.append(self._linear((driver.joint, driver.freedom, 1.0)))
        self.wanted = [
            self._add_frame(self.carrier[point.body], point.position)
            for point in map(mechanism.point, case.points)
        ]

        ends = np.cumsum([each.n for each in self.conditions])
        self.slices = [
            slice(end - each.n, end) for end, each in zip(ends, self.conditions, strict=True)
        ]
        self.J = np.zeros((ends[-1], self.model.nv))
        # the rows of the drivers are the last
        self.columns = np.eye(ends[-1])[:, ends[-1] - len(mechanism.drivers) :]
        self.data = self.model.createData()
        self.reset()

    def _branches(self, mechanism: Mechanism, tree: SpanningTree) -> Iterable[Branch]:
        """The branches in an order where every parent comes before its children; kinematics needs
        no other.
        """
        return tree.branches

    def _close(
        self, joint: Joint, i: int, j: int, ends: tuple[Vector, Vector], named: bool
    ) -> None:
        """Add the rows of a cut joint, between the bodies of Pinocchio's joints i and j."""
        closure, copied = CLOSURES[type(joint)], ""
        if named:
            # what is driven or coupled must be a coordinate, which counts the turns: it moves a
            # copy of the second body
            i, closure, copied = (
                self._add_chain(i, joint, ends[0], 1),
                CLOSURES[Fixed],
                f"on a copy of {joint.j!r}: ",
            )
        self.closures[joint.name] = copied + closure.text
        self.conditions += closure.conditions(joint, *map(self._add_frame, (i, j), ends))

    def _add_chain(self, at: int, joint: Joint, P: Vector, sign: int) -> int:
        """Add the joints that make a joint; return the number of the last.

        The chain begins at the first body, or with sign -1 at the second.
        """
        chain = list(enumerate(TREE_JOINTS[type(joint)](self.pin, joint)))
        for k, each in chain[::sign]:
            at = self._add_joint(at, each, P)
            if isinstance(joint, AxialJoint):
                self.coordinates[joint.name, joint.freedoms[k]] = at, sign
        for relation in joint.relations if isinstance(joint, AxialJoint) else ():
            self.conditions.append(
                self._linear(*((joint.name, *term) for term in relation.items()))
            )
        return at

    def _linear(self, *terms: tuple[str, str, float]) -> Linear:
        """Return the weighted sum of coordinates, each given by joint, freedom and weight."""
        moved = [(*self.coordinates[joint, freedom], weight) for joint, freedom, weight in terms]
        joints = [self.model.joints[at] for at, _, _ in moved]
        weights = np.array([sign * weight for _, sign, weight in moved])
        return Linear(
            self, [each.idx_q for each in joints], [each.idx_v for each in joints], weights
        )

    def _add_joint(self, parent: int, joint: Any, at: Vector) -> int:
        """Add a joint at a point, global at design [m]; return its number."""
        placement = self.pin.SE3(np.eye(3), np.array(at) - self.origin[parent])
        self.origin.append(np.array(at))
        return self.model.addJoint(parent, joint, placement, f"joint {self.model.njoints}")

    def _add_frame(self, joint: int, at: Vector) -> Frame:
        """Add a frame to the body of a joint, at a point, global at design [m]."""
        placement = self.pin.SE3(np.eye(3), np.array(at) - self.origin[joint])
        # numbered, because a second frame of one name would silently be the first one
        name = f"frame {self.model.nframes}"
        return Frame(
            self,
            self.model.addFrame(
                self.pin.Frame(name, joint, 0, placement, self.pin.FrameType.OP_FRAME)
            ),
        )

    @property
    def details(self) -> Mapping[str, Any]:
        return {"closures": self.closures}

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
        return [
            (frame.position, frame.velocity[:3], frame.acceleration[:3]) for frame in self.wanted
        ]
