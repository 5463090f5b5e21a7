"""Multipliers of the rows over a solved motion by singular values, and forces from them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...algebra import Scalar, Vec3
from ...forces import DETERMINED
from ...joints.base import Joint
from ...mechanism.drivers import Driver
from ...primitives.base import Drive
from ...trajectory import Array
from ..formulation.cartesian import Cartesian
from ..formulation.driver_inputs import drive_numbers
from ..formulation.formulation import Configuration
from ..formulation.state_vectors import state_of
from .equations import ForceEquations
from .motion_lanes import MotionLanes

# The pose is singular if a singular value of the rows is below this part of the largest: the
# balancing effort is then infinite or not unique.
SINGULAR = 1e-9


@dataclass(frozen=True, eq=False)
class Multipliers:
    """Multipliers of the rows at n samples.

    Attributes:
        multipliers: [J], shape (n, rows).
        null: basis of their undetermined combinations, shape (n, rows, redundant rows).
        singular: whether the pose is singular, shape (n,).
    """

    multipliers: Array
    null: Array
    singular: NDArray[np.bool_]


class ForceRows:
    """The equations of forces at all samples as lanes, solved by singular values."""

    def __init__(self, lanes: MotionLanes) -> None:
        self.lanes, mechanism, frame = lanes, lanes.mechanism, lanes.frame
        numbers = drive_numbers(mechanism.drivers, lanes.drive, frame.unit)
        drives = {
            driver.name: Drive(*numbers[5 * k : 5 * k + 5])
            for k, driver in enumerate(mechanism.drivers)
        }
        self.formulation = Cartesian.of(mechanism, frame, drives)
        self.equations = ForceEquations(
            mechanism, self.formulation, self._configuration(), lanes.at, lanes.applied
        )
        self.count = len(self.formulation.owners)

    def _configuration(self) -> Configuration:
        lanes = self.lanes
        state = state_of(self.formulation, lanes.mechanism, lanes.frame, lanes.poses, lanes.values)
        return self.formulation.configuration(state)

    @cached_property
    def matrix(self) -> Array:
        """Return the Jacobian of all rows, lengths in the unit of the frames.

        Shape (n, rows, unknowns).
        """
        found = np.zeros((self.lanes.n, self.count, self.formulation.unknowns))
        for k, row in enumerate(self.equations.rows):
            for column, value in row.items():
                found[:, k, column] = value
        return found

    @cached_property
    def demand(self) -> Array:
        """Return M a + h - Q by the unknowns [J], shape (n, unknowns)."""
        return self.stacked(self.equations.demand)

    def solve(self, part: slice) -> Multipliers:
        """Return the multipliers at a part of the samples: the shortest of all solutions."""
        rows, demand = self.matrix[part], self.demand[part]
        inverse = _inverse(rows)
        if inverse is not None:
            n = len(rows)
            found = np.einsum("nur,nu->nr", inverse, demand)
            return Multipliers(found, np.empty((n, self.count, 0)), np.zeros(n, np.bool_))
        rank = min(rows.shape[1:])  # of a driven mechanism at a regular pose
        u, sizes, vh = np.linalg.svd(rows, full_matrices=True)
        singular: NDArray[np.bool_] = sizes[:, rank - 1] <= SINGULAR * sizes[:, 0]
        inverse = 1.0 / np.where(singular[:, None], np.inf, sizes)
        along = inverse * np.einsum("nuk,nk->nu", vh[:, :rank], demand)
        return Multipliers(np.einsum("nru,nu->nr", u[:, :, :rank], along), u[:, :, rank:], singular)

    def reaction(self, joint: Joint, multipliers: Array, null: Array) -> tuple[Array, Array, Array]:
        """Return force [N], moment [N m] and undetermined directions of a joint's wrench.

        The wrench acts on the joint's second body, about the joint's point carried by this body.
        """
        force, moment = self._wrench(joint, multipliers)
        free = np.empty((self.lanes.n, 6, null.shape[2]))
        for k in range(null.shape[2]):
            free[:, :3, k], free[:, 3:, k] = self._wrench(joint, null[:, :, k])
        return force / self.lanes.frame.unit, moment, free

    def _wrench(self, joint: Joint, multipliers: Array) -> tuple[Array, Array]:
        pair: tuple[Vec3, Vec3] = self.equations.reaction(joint, [*multipliers.T])
        return self.stacked(pair[0]), self.stacked(pair[1])

    def effort(self, driver: Driver, multipliers: Array, null: Array) -> Array:
        """Return the effort of a driver [N or N m], shape (n,); NaN if redundant rows leave it
        undetermined.
        """
        effort: Array = self.equations.effort(driver, [*multipliers.T]) + np.zeros(self.lanes.n)
        unit = 1.0 if driver.turns else self.lanes.frame.unit
        for k in range(null.shape[2]):
            loose = unit * np.abs(self.equations.effort(driver, [*null[:, :, k].T]))
            effort = np.where(loose <= DETERMINED, effort, np.nan)
        return effort

    def stacked(self, values: Iterable[Scalar]) -> Array:
        """Return scalars over the samples as columns, shape (n, len(values))."""
        return np.stack([x + np.zeros(self.lanes.n) for x in values], axis=1)


def _inverse(rows: Array) -> Array | None:
    """Return the inverses of square matrices, shape (n, size, size).

    Return None if they are not square or one may be singular: singular values must decide then.
    Inversion takes a tenth of their time.
    """
    if rows.shape[1] != rows.shape[2]:
        return None
    try:
        found: Array = np.asarray(np.linalg.inv(rows), np.float64)
    except np.linalg.LinAlgError:
        return None
    # the ratio of singular values is at most the size times this condition
    condition = np.abs(rows).sum(axis=1).max(axis=1) * np.abs(found).sum(axis=1).max(axis=1)
    return found if (rows.shape[1] * condition < 1.0 / SINGULAR).all() else None
