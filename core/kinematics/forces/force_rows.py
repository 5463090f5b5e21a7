"""Multipliers of the rows over a solved motion by singular values, and forces from them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from functools import cached_property

import numpy as np

from ...algebra import Scalar, Vec3
from ...forces import AMPLIFIED, Multipliers
from ...joints.base import Joint
from ...mechanism.motions import Driver
from ...primitives.base import Drive
from ...trajectory import Array
from ..formulation.cartesian import Cartesian
from ..formulation.constraints import constraints_left_out
from ..formulation.driver_inputs import drive_numbers
from ..formulation.formulation import Configuration
from ..formulation.state_vectors import state_of
from .equations import ForceEquations
from .motion_lanes import MotionLanes

# Size limit of the matrices solved at once, in numbers over all samples: some 64 MB.
AT_ONCE = 8_000_000


class ForceRows:
    """The equations of forces at all samples as lanes, solved by singular values.

    Rows left out within digits come last: they carry nothing, and count in the self-stress.
    """

    def __init__(self, lanes: MotionLanes) -> None:
        self.lanes, mechanism, frame = lanes, lanes.mechanism, lanes.frame
        numbers = drive_numbers(mechanism.drivers, lanes.drive, frame.unit)
        drives = {
            driver.name: Drive(*numbers[5 * k : 5 * k + 5])
            for k, driver in enumerate(mechanism.drivers)
        }
        self.formulation = Cartesian.of(mechanism, frame, drives)
        left_out = Cartesian(constraints_left_out(mechanism, frame), frame.moving)
        self.equations = ForceEquations(
            mechanism, self.formulation, self._configuration(), lanes.at, lanes.applied, left_out
        )

    def _configuration(self) -> Configuration:
        lanes = self.lanes
        state = state_of(self.formulation, lanes.mechanism, lanes.frame, lanes.poses, lanes.values)
        return self.formulation.configuration(state)

    @cached_property
    def matrix(self) -> Array:
        """Return the Jacobian of all rows, lengths in the unit of the frames.

        Shape (n, rows, unknowns).
        """
        rows = self.equations.rows
        found = np.zeros((self.lanes.n, len(rows), self.formulation.unknowns))
        for k, row in enumerate(rows):
            for column, value in row.items():
                found[:, k, column] = value
        return found

    @cached_property
    def demand(self) -> Array:
        """Return M a + h - Q by the unknowns [J], shape (n, unknowns)."""
        return self.stacked(self.equations.demand)

    def solve(self) -> Multipliers:
        """Return the multipliers at all samples [J]."""
        n, rows, unknowns = self.matrix.shape
        step = max(1, AT_ONCE // max(1, rows * unknowns))
        parts = [self._solve(slice(k, k + step)) for k in range(0, max(1, n), step)]
        columns = [[getattr(part, each.name) for part in parts] for each in fields(Multipliers)]
        return Multipliers(*map(np.concatenate, columns))

    def _solve(self, part: slice) -> Multipliers:
        rows, demand = self.matrix[part], self.demand[part]
        inverse = _inverse(rows)
        if inverse is not None:
            values, n = np.einsum("nur,nu->nr", inverse, demand), len(rows)
            one = np.ones(n)
            return Multipliers(values, np.empty((*values.shape, 0)), np.zeros(n), one, one, one)
        last = len(self.formulation.owners)
        drivers = range(last - len(self.lanes.mechanism.drivers), last)
        return Multipliers.of(rows, demand, drivers, rows.shape[1] - last)

    def wrench(self, joint: Joint, multipliers: Array) -> tuple[Array, Array]:
        """Return force [J / unit of the frames] and moment [N m] of a joint, shape (n, 3) each.

        They act on the joint's second body, about the joint's point carried by this body.
        """
        pair: tuple[Vec3, Vec3] = self.equations.reaction(joint, [*multipliers.T])
        return self.stacked(pair[0]), self.stacked(pair[1])

    def free(self, joint: Joint, found: Multipliers) -> Array:
        """Return the undetermined directions of a joint's wrench, shape (n, 6, redundant rows)."""
        columns = np.moveaxis(found.free, 2, 0)
        each = [np.hstack(self.wrench(joint, multipliers)) for multipliers in columns]
        return np.stack(each, axis=2) if each else np.empty((self.lanes.n, 6, 0))

    def effort(self, driver: Driver, found: Multipliers) -> Array:
        """Return the effort of a driver [N or N m], shape (n,)."""
        effort: Array = self.equations.effort(driver, [*found.values.T])
        return effort + np.zeros(self.lanes.n)

    def stacked(self, values: Iterable[Scalar]) -> Array:
        """Return scalars over the samples as columns, shape (n, len(values))."""
        return np.stack([x + np.zeros(self.lanes.n) for x in values], axis=1)


def _inverse(rows: Array) -> Array | None:
    """Return the inverses of square matrices, shape (n, size, size).

    Return None if they are not square or one may be nearly singular: singular values must decide
    then. Inversion takes a tenth of their time.
    """
    if rows.shape[1] != rows.shape[2]:
        return None
    try:
        found: Array = np.asarray(np.linalg.inv(rows), np.float64)
    except np.linalg.LinAlgError:
        return None
    # the ratio of singular values is at most the size times this condition
    condition = np.abs(rows).sum(axis=1).max(axis=1) * np.abs(found).sum(axis=1).max(axis=1)
    return found if (rows.shape[1] * condition < AMPLIFIED).all() else None
