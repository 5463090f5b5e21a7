"""Masses, gravity and force elements as objects of Exudyn, and their forces; private to its
adapter.

Exudyn computes the mass matrix, the right-hand side with its own loads and connectors, and the
Jacobian of all rows, which are joints. A torsional spring-damper has an additional unknown that
follows any number of turns, and acts by two torques that the adapter sets.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ...core.case.case import Case
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
from ..shared.force_elements import Element, curve_force, places
from ..shared.force_solution import Dynamics, reacting
from ..shared.frame_constraints import skew
from ..shared.rows_left_out import left_out_of
from ..shared.tree_rows import BodyFrame
from .rows import Rows

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

    def __init__(self, rows: Rows, case: Case, kinds: Any) -> None:
        self.rows, self.mbs, self.items, self.kinds = rows, rows.mbs, rows.items, kinds
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
            self._add(each)

    def _add(self, each: Any) -> None:
        rows, items = self.rows, self.items
        if isinstance(each, Bushing) or (isinstance(each, SpringDamper) and each.curve):
            self.framed.append(each)
        elif isinstance(each, SpringDamper):
            ends = [rows.marker(*end) for end in zip(each.bodies, each.points, strict=True)]
            spring = items.ObjectConnectorSpringDamper(
                markerNumbers=ends,
                referenceLength=each.free_length,
                stiffness=each.stiffness,
                damping=each.damping,
            )
            self.springs[each.name] = int(self.mbs.AddObject(spring))
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
        """Return the forces; see `force_solution.ForceModel`.

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
            for name in reacting(self.case)
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
        elastic = given.stiffness * deflection + curve_force(given.curve, deflection)
        amount = -(elastic + given.damping * float(v[place]))
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
