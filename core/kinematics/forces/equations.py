"""The equations of forces at one state, over any scalar: J^T lambda = M a + h - Q.

J has all native rows of joints and drivers. On the manifold, the simplified rows of a whole joint
span the same space as its exact rows. The wrench of a joint is therefore independent of the row
style, and all styles take their forces from the native rows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from ...algebra import ZERO, Scalar, Vec3, cross, is_literal_zero, vec
from ...joints.base import Joint
from ...mechanism.drivers import Driver
from ...mechanism.mechanism import Mechanism
from ...primitives.base import GROUND_POSE
from ..formulation.cartesian import COLUMNS, Cartesian
from ..formulation.constraints import Constraint, Relation
from ..formulation.formulation import Configuration, Rows
from .demand import NO_WRENCH, BodyStates, Wrench, inertial
from .elements import Applied


@dataclass(frozen=True, eq=False)
class ForceEquations:
    """The rows of joints and drivers at one state, their demand, and the meaning of multipliers.

    Attributes:
        formulation: native formulation of the whole mechanism.
        at: its configuration.
        states: poses, twists and accelerations of the bodies.
        applied: force elements at work, by name.
        left_out: rows left out within digits, which follow the others; none without self-stress.
    """

    mechanism: Mechanism
    formulation: Cartesian
    at: Configuration
    states: BodyStates
    applied: Mapping[str, Applied]
    left_out: Cartesian

    @cached_property
    def rows(self) -> Rows:
        """Return the Jacobian of all rows, lengths in the unit of the frames."""
        return self.formulation.rows(self.at) + self.left_out.rows(self.at)

    @cached_property
    def demand(self) -> list[Scalar]:
        """Return M a + h - Q by the unknowns [J]; zero for the coordinates of joints."""
        gravity, wrenches = vec(self.mechanism.gravity), dict[str, Wrench]()
        for name in self.formulation.columns:
            body = self.mechanism.body(name)
            wrenches[name] = (
                NO_WRENCH if is_literal_zero(body.mass) else inertial(body, self.states, gravity)
            )
            for each in self.applied.values():
                if name in each.wrenches:
                    wrenches[name] += -each.wrenches[name]
        return self.by_unknowns(wrenches)

    def by_unknowns(self, wrenches: Mapping[str, Wrench]) -> list[Scalar]:
        """Return wrenches on the moving bodies by the unknowns [J]; zero for coordinates."""
        found: list[Scalar] = [0.0] * self.formulation.unknowns
        for name, first in self.formulation.columns.items():
            force = self.states.frame.unit * wrenches[name].force
            found[first : first + COLUMNS] = [*force, *wrenches[name].torque]
        return found

    @cached_property
    def _numbered(self) -> list[tuple[int, Constraint | Relation]]:
        """Return the constraint and number of every row: joints, couplers, drivers, left out."""
        every = (
            c
            for c in (*self.formulation.constraints, *self.left_out.constraints)
            for _ in range(c.primitive.n if isinstance(c, Constraint) else 1)
        )
        return list(enumerate(every))

    @cached_property
    def _of_joints(self) -> Mapping[str, list[tuple[int, Constraint | Relation]]]:
        """Return the rows by given joint; a coupler or driver may have the name of a joint."""
        mechanism, every = self.mechanism, self.formulation.constraints
        last = len(every) - len(mechanism.couplers) - len(mechanism.drivers)
        own = {id(c) for c in (*every[:last], *self.left_out.constraints)}
        found: dict[str, list[tuple[int, Constraint | Relation]]] = {
            joint.name: [] for joint in mechanism.given_joints
        }
        for k, c in self._numbered:
            if id(c) in own:
                found[mechanism.given_name(c.owner)].append((k, c))
        return found

    @cached_property
    def _measuring(self) -> Mapping[str, int]:
        """Return the number of the measuring row by coordinate."""
        return {
            c.coordinate: k for k, c in self._numbered if isinstance(c, Constraint) and c.coordinate
        }

    def _parts(self, joint: Joint, multipliers: Sequence[Scalar]) -> Iterator[tuple[int, Scalar]]:
        """Yield the rows acting on the bodies of a joint, with the joint's part of each multiplier.

        A row can measure a coordinate of a joint. Its multiplier then carries the loads of this
        coordinate's relations, and they count as loads of the relations, not of the joint. A gear's
        torque is thus no reaction of the coupled joints, and a screw's thrust is the screw's.
        """
        for k, c in self._of_joints[joint.name]:
            if isinstance(c, Relation):
                for name, weight in c.weights.items():
                    measuring = self._measuring[name]
                    share = self.rows[measuring][self.formulation.coordinates[name]]
                    yield measuring, -(weight / share) * multipliers[k]
            elif not c.coordinate:
                yield k, multipliers[k]

    def reaction(self, joint: Joint, multipliers: Sequence[Scalar]) -> tuple[Vec3, Vec3]:
        """Return force [J / unit of the frames] and moment [N m] of a joint on its second body.

        The moment is about the joint's point, carried by the second body.
        """
        body, sign = (joint.j, 1.0) if joint.j in self.formulation.columns else (joint.i, -1.0)
        first, force, torque = self.formulation.columns[body], ZERO, ZERO
        for k, part in self._parts(joint, multipliers):
            entries = [self.rows[k].get(first + x, 0.0) for x in range(COLUMNS)]
            force += part * vec(entries[:3])
            torque += part * vec(entries[3:])
        return sign * force, sign * (torque - cross(self._arm(joint, body), force))

    def _arm(self, joint: Joint, body: str) -> Vec3:
        """Return the arm from a body's internal origin to the joint's point, turned [units].

        The second body carries the point.
        """
        held = self.at.poses.get(joint.j, GROUND_POSE)
        frame = self.states.frame
        arm = frame.arm(joint.j, self.mechanism.reaction_point(joint))
        if body == joint.j:
            return held.turn(arm)
        seen = self.at.poses.get(body, GROUND_POSE)
        carried = held.u + held.swing(arm) - seen.u
        return (arm + frame.origins[joint.j] - frame.origins[body]) + carried

    def effort(self, driver: Driver, multipliers: Sequence[Scalar]) -> Scalar:
        """Return the effort of a driver [N or N m]."""
        drivers = self.mechanism.drivers
        c: Any = self.formulation.constraints[drivers.index(driver) - len(drivers)]
        first = next(k for k, each in self._numbered if each is c)
        # nu is linear in the driver's rate: at rate one it is the power per unit multiplier
        at_rate_one = replace(c.primitive, drive=replace(c.primitive.drive, c_t=1.0))
        pair = (self.at.poses.get(b, GROUND_POSE) for b in (c.i, c.j))
        found: Scalar = 0.0
        for k, value in enumerate(at_rate_one.nu(*pair)):
            found = found + value * multipliers[first + k]
        return found if driver.turns else (1.0 / self.states.frame.unit) * found
