"""The rows of joints and drivers over a solved motion, and what their multipliers mean."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...algebra import vec
from ...forces import DETERMINED
from ...joints.base import Joint
from ...mechanism.drivers import Driver
from ...primitives.base import GROUND_POSE, Drive
from ...trajectory import Array
from ..formulation.cartesian import COLUMNS, Cartesian
from ..formulation.constraints import Constraint, Relation
from ..formulation.driver_inputs import drive_numbers
from ..formulation.formulation import Configuration
from ..formulation.state_vectors import state_of
from .demand import NO_WRENCH, inertial
from .motion_lanes import MotionLanes

# Below this part of the largest singular value of the rows, the pose is singular: the effort that
# holds it is not finite, or not unique.
SINGULAR = 1e-9


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Multipliers of the rows [J], shape (n, rows), a basis of their undetermined combinations,
    shape (n, rows, redundant rows), and whether the pose is singular, shape (n,).
    """

    multipliers: Array
    null: Array
    singular: NDArray[np.bool_]


class ForceRows:
    """The rows of joints and drivers at all samples, and what their multipliers mean."""

    def __init__(self, lanes: MotionLanes) -> None:
        self.lanes, mechanism, frame = lanes, lanes.mechanism, lanes.frame
        numbers = drive_numbers(mechanism.drivers, lanes.drive, frame.unit)
        drives = {
            driver.name: Drive(*numbers[5 * k : 5 * k + 5])
            for k, driver in enumerate(mechanism.drivers)
        }
        self.formulation = Cartesian.of(mechanism, frame, drives)
        self.at = self._configuration()
        self.count = len(self.formulation.owners)

    def _configuration(self) -> Configuration:
        lanes = self.lanes
        state = state_of(self.formulation, lanes.mechanism, lanes.frame, lanes.poses, lanes.values)
        return self.formulation.configuration(state)

    @cached_property
    def matrix(self) -> Array:
        """The Jacobian of all rows, lengths in the unit of the frames, (n, rows, unknowns)."""
        found = np.zeros((self.lanes.n, self.count, self.formulation.unknowns))
        for k, row in enumerate(self.formulation.rows(self.at)):
            for column, value in row.items():
                found[:, k, column] = value
        return found

    @cached_property
    def demand(self) -> Array:
        """M a + h - Q by the unknowns [J], shape (n, unknowns)."""
        lanes, mechanism = self.lanes, self.lanes.mechanism
        found = np.zeros((lanes.n, self.formulation.unknowns))
        gravity = vec(mechanism.gravity)
        for name, first in self.formulation.columns.items():
            body = mechanism.body(name)
            total = inertial(body, lanes.at, gravity) if body.mass > 0.0 else NO_WRENCH
            for each in lanes.applied.values():
                total += -each.wrenches.get(name, NO_WRENCH)
            for k, value in enumerate((*total.force, *total.torque)):
                found[:, first + k] = value * (lanes.frame.unit if k < 3 else 1.0)
        return found

    def solve(self, part: slice) -> Multipliers:
        """Return the multipliers of a part of the samples: of all solutions the shortest."""
        rows, demand = self.matrix[part], self.demand[part]
        rank = min(rows.shape[1:])  # of a driven mechanism at a regular pose
        u, sizes, vh = np.linalg.svd(rows, full_matrices=True)
        singular: NDArray[np.bool_] = sizes[:, rank - 1] <= SINGULAR * sizes[:, 0]
        inverse = 1.0 / np.where(singular[:, None], np.inf, sizes)
        along = inverse * np.einsum("nuk,nk->nu", vh[:, :rank], demand)
        return Multipliers(np.einsum("nru,nu->nr", u[:, :, :rank], along), u[:, :, rank:], singular)

    @cached_property
    def _of_owner(self) -> Mapping[str, list[int]]:
        found: dict[str, list[int]] = {}
        for k, (owner, _) in enumerate(self.formulation.owners):
            found.setdefault(owner, []).append(k)
        return found

    @cached_property
    def _on_bodies(self) -> Array:
        """What each row's multiplier does to the bodies, shape (n, rows, 6 * bodies).

        A row that measures a joint's coordinate carries what the relations of this coordinate ask
        for: it counts as theirs. So a gear's torque is not the reaction of the joints that it
        couples, and a screw's thrust is the screw's.
        """
        bodies = COLUMNS * len(self.formulation.bodies)
        found = self.matrix[:, :, :bodies].copy()
        for k, c in enumerate(self._constraint_of_row):
            if isinstance(c, Constraint) and c.coordinate:
                column = self.formulation.coordinates[c.coordinate]
                share = -self.matrix[:, :, column] / self.matrix[:, k, column][:, None]
                share[:, k] = 0.0
                found += share[:, :, None] * found[:, k][:, None]
                found[:, k] = 0.0
        return found

    @cached_property
    def _constraint_of_row(self) -> list[Constraint | Relation]:
        return [
            c
            for c in self.formulation.constraints
            for _ in range(c.primitive.n if isinstance(c, Constraint) else 1)
        ]

    def reaction(self, joint: Joint, multipliers: Array, null: Array) -> tuple[Array, Array, Array]:
        """Return force [N], moment [N m] and undetermined directions of a joint's wrench on its
        second body, about the joint's point as carried by that body.
        """
        lanes, columns = self.lanes, self.formulation.columns
        rows, second = self._of_owner[joint.name], joint.j
        body, sign = (second, 1.0) if second in columns else (joint.i, -1.0)
        first = columns[body]
        on_body = sign * self._on_bodies[:, rows, first : first + COLUMNS]
        wrench = np.einsum("nrc,nr->nc", on_body, multipliers[:, rows])
        loose = np.einsum("nrc,nrk->nck", on_body, null[:, rows])
        arm = self._arm(joint, body)
        unit_length = lanes.frame.unit
        force, moment = wrench[:, :3] / unit_length, wrench[:, 3:]
        free = np.concatenate(
            [loose[:, :3], loose[:, 3:] - np.cross(arm[:, :, None], loose[:, :3], axis=1)], axis=1
        )
        return force, moment - np.cross(unit_length * arm, force), free

    def _arm(self, joint: Joint, body: str) -> Array:
        """Return the arm from a body's internal origin to the joint's point [units], (n, 3).

        The point is the one that the second body carries.
        """
        lanes = self.lanes
        position = lanes.mechanism.reaction_point(joint)
        held = lanes.poses.get(joint.j, GROUND_POSE)
        origins, seen = lanes.frame.origins, lanes.poses.get(body, GROUND_POSE)
        carried = held.u + held.swing(lanes.frame.arm(joint.j, position)) - seen.u
        arm = (lanes.frame.arm(joint.j, position) + origins[joint.j] - origins[body]) + carried
        return np.stack([x + np.zeros(lanes.n) for x in arm], axis=1)

    def effort(self, driver: Driver, multipliers: Array, null: Array) -> Array:
        """Return the effort of a driver [N or N m], shape (n,); NaN where redundant rows leave it
        undetermined.
        """
        rows = self._of_owner[driver.name]
        weights = np.zeros((self.lanes.n, len(rows)))
        for c in self.formulation.constraints:
            if isinstance(c, Constraint) and c.owner == driver.name:
                primitive: Any = c.primitive
                # nu is linear in the driver's rate: at rate one it is the power of a multiplier
                at_rate_one = replace(primitive, drive=replace(primitive.drive, c_t=1.0))
                pair = (self.at.poses.get(b, GROUND_POSE) for b in (c.i, c.j))
                for k, value in enumerate(at_rate_one.nu(*pair)):
                    weights[:, k] = value
        effort = np.einsum("nr,nr->n", weights, multipliers[:, rows])
        loose = np.abs(np.einsum("nr,nrk->nk", weights, null[:, rows])).max(axis=1, initial=0.0)
        effort = effort if driver.turns else effort / self.lanes.frame.unit
        return np.where(loose <= DETERMINED, effort, np.nan)
