"""Pinocchio in projection mode: its joints as a spanning tree, its frames to close the loops; the
same code for Pinocchio 3.9 and 4.

Pinocchio's own constraint models are not used: their signatures and the update of their data
changed between 3 and 4, the axes of their rows depend on the kind, and none is a distance. The
adapter uses quantities with the same meaning in both versions: placement, Jacobian, velocity and
classical acceleration of a frame. `constraints` makes the rows of any joint from them.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from ...core.case.case import Case
from ...core.mechanism.mechanism import Vector
from ...core.trajectory import Array
from ..shared.tree_forces import Mass, mass_properties
from ..shared.tree_model import TreeEngine, TreeModel
from ..shared.tree_plan import Link


class Pinocchio(TreeEngine):
    """The engine `pinocchio`."""

    name, title = "pinocchio", "Pinocchio"

    def version_of(self, simulator: Any) -> str | None:
        """Return the version; None for PyPI's unrelated "pinocchio", which has no Model.

        The simulator's package on PyPI is "pin".
        """
        return super().version_of(simulator) if hasattr(simulator, "Model") else None

    def model_of(self, case: Case) -> PinocchioModel:
        """Return tree, frames and conditions of the case."""
        return PinocchioModel(importlib.import_module("pinocchio"), case)


class PinocchioModel(TreeModel):
    """The tree in Pinocchio: a joint for each link, an operational frame for each frame."""

    computed_by: ClassVar[Mapping[str, str]] = {
        "inverse dynamics": "rnea",
        "reactions of tree joints": "rnea: data.f",
        "reactions of cut joints": "rows by getFrameJacobian",
        "force elements": "of the adapter, by frames of Pinocchio",
    }

    def __init__(self, pin: Any, case: Case) -> None:
        self.pin, self.model, self.axes = pin, pin.Model(), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        super().__init__(case)

    def add_link(self, parent: int, link: Link, offset: Array) -> None:
        pin, axis = self.pin, np.array(link.axis)
        match link.move:
            case "slide":
                joint = pin.JointModelPrismaticUnaligned(axis)
            case "hinge":
                joint = pin.JointModelRevoluteUnaligned(axis)
            case "ball":
                joint = pin.JointModelSpherical()
        name = f"joint {self.model.njoints}"
        self.model.addJoint(parent, joint, pin.SE3(np.eye(3), offset), name)

    def make_frame(self, body: int, offset: Array) -> int:
        pin = self.pin
        # numbered, because a second frame with the same name would silently be the first
        name = f"frame {self.model.nframes}"
        placement = pin.SE3(np.eye(3), offset)
        return self.model.addFrame(pin.Frame(name, body, 0, placement, pin.FrameType.OP_FRAME))

    def finish(self) -> None:
        self.data = self.model.createData()

    @property
    def unknowns(self) -> int:
        return self.model.nv

    def coordinate(self, body: Any) -> tuple[int, int]:
        joint = self.model.joints[body]
        return joint.idx_q, joint.idx_v

    def design(self) -> Array:
        return self.pin.neutral(self.model)

    def configuration_after(self, dx: Array) -> Array:
        return self.pin.integrate(self.model, self.q, dx)

    def place(self) -> None:
        self.pin.computeJointJacobians(self.model, self.data, self.q)
        self.pin.updateFramePlacements(self.model, self.data)

    def rate(self, v: Array, a: Array) -> None:
        self.pin.forwardKinematics(self.model, self.data, self.q, v, a)

    def placement(self, handle: int) -> tuple[Array, Array]:
        frame = self.data.oMf[handle]
        return frame.translation, frame.rotation

    def slope(self, handle: int) -> Array:
        # Pinocchio returns a matrix of one column as a vector
        return self.pin.getFrameJacobian(self.model, self.data, handle, self.axes).reshape(6, -1)

    def motion(self, handle: int) -> tuple[Array, Array]:
        given = self.model, self.data, handle, self.axes
        return (
            self.pin.getFrameVelocity(*given).vector,
            self.pin.getFrameClassicalAcceleration(*given).vector,
        )

    def set_loads(self, gravity: Vector, masses: Sequence[Mass]) -> None:
        pin, at_origin = self.pin, self.pin.SE3.Identity()
        for each in masses:
            link: int = each.frame.body
            inertia = pin.Inertia(*mass_properties(each.body, self.origin[link]))
            self.model.appendBodyToJoint(link, inertia, at_origin)
        self.model.gravity.linear = np.array(gravity)

    def inverse_dynamics(self, v: Array, a: Array) -> Array:
        self.rate(v, a)
        return np.array(self.pin.rnea(self.model, self.data, self.q, v, a))

    def passed_on(self, body: int, point: Array) -> Array:
        wrench = self.data.oMi[body].act(self.data.f[body])
        return np.concatenate([wrench.linear, wrench.angular - np.cross(point, wrench.linear)])
