"""Sparse equations of a large mechanism: rows, factors and rates at a pose.

Lengths are measured near the size of the bodies, not of the whole mechanism: the entries of the
matrix and the round-off of the rows depend on that size.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ...errors import SolveError
from ...failures import FailureKind, PoseFailure
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...trajectory import Array
from ..compiled.compiled_model import CLOSED
from ..formulation.constraints import constraints, measured
from ..formulation.driver_inputs import drive_numbers
from ..structure.degrees_of_freedom import counted
from ..structure.driver_count import locked_drivers, require_driven
from ..structure.redundancy import RANK_TOLERANCE
from ..structure.sparse_lu import Factors, Indices, SingularError
from .determinant_signs import Blocks
from .elements import Elements
from .rotation_update import Turn
from .row_selection import Jacobian
from .step_state import Stand

# Rows are chosen anew where that makes the determinant, and so the least of what it is a product


class PoseError(ArithmeticError):
    """A pose out of reach."""

    def __init__(self, failure: PoseFailure) -> None:
        super().__init__(str(failure))
        self.failure = failure


class SparseEquations:
    """The rows of a mechanism, and their solution at one pose.

    Attributes:
        extent: a power of two near the mechanism's size [m].
        frame: unit and origins of the lengths.
        kept, dropped: solved rows, and redundant rows.
        solved: entries of the solved rows.
        blocks, factors: of the matrix of these entries.
        scale: see `distance`.
        design: design position, all drivers at rest.

    Raises:
        SolveError: the mechanism cannot move, has more degrees of freedom than drivers, or does not
            close at the design position.
    """

    def __init__(self, mechanism: Mechanism, *, compiled: bool = True) -> None:
        if not mechanism.moving:
            require_driven(mechanism)
        self.mechanism = mechanism
        self.extent, self.frame = measured(mechanism)
        self.elements = Elements(
            constraints(mechanism, self.frame, {}),
            self.frame.moving,
            len(mechanism.drivers),
            compiled=compiled,
        )
        numbering = self.elements.numbering
        n = self.bodies = len(self.frame.moving)
        # what a change of the state is measured by: lengths by the mechanism's size
        length = self.frame.unit / self.extent
        coordinates = [
            length if name.endswith(".translation") else 1.0 for name in numbering.coordinates
        ]
        self.scale = np.concatenate([np.full(3 * n, length), np.ones(4 * n), coordinates])
        state = np.zeros(numbering.state)
        state[3 * n : 4 * n] = 1.0
        self._turn = Turn(n, compiled=compiled)
        # among the numbers of all drives
        self.angles = [5 * k for k, driver in enumerate(mechanism.drivers) if driver.turns]
        self._rest = self.drives(Path({}, np.zeros(1)), np.zeros(1))[:, 0]
        self.elements.evaluate(state, self._rest)
        self._select()
        self.design = self._closed(state)

    def _select(self) -> None:
        """Find the rows to solve for, and the order in which."""
        jacobian, drivers = Jacobian.of(self.elements), len(self.mechanism.drivers)
        rows, unknowns = jacobian.shape
        if rows < unknowns:
            require_driven(self.mechanism)
        kept = jacobian.independent(drivers)
        try:
            self._keep(kept, jacobian)
            pivot = abs(self.factors.signed_pivot)
        except SingularError:
            pivot = 0.0
        if not pivot > RANK_TOLERANCE or (self.dropped >= rows - drivers).any():
            require_driven(self.mechanism)
            raise SolveError(
                f"mechanism {self.mechanism.name!r}: driven by {locked_drivers(self.mechanism)} it"
                " does not move at the design position (lock-up or dead centre); give the design"
                " in another pose, some degrees on, and sweep from there, or drive another"
                " coordinate",
                FailureKind.LOCKED,
            )

    def _keep(self, kept: Indices, jacobian: Jacobian) -> None:
        """Solve these rows. Raises SingularError."""
        self.kept, self.dropped = kept, np.setdiff1d(np.arange(jacobian.shape[0]), kept)
        among = jacobian.among(kept)
        self.solved = np.flatnonzero(among >= 0)
        pattern = among[self.solved], jacobian.columns[self.solved]
        self.factors = Factors(*pattern, jacobian.values[self.solved], len(kept))
        self.blocks = Blocks(*pattern, len(kept), well_chosen=jacobian.well_chosen)

    @property
    def redundant(self) -> list[str]:
        """The rows left out, as "joint: primitive"."""
        rows: list[int] = self.dropped.tolist()
        return [": ".join(self.elements.owners[row]) for row in rows]

    def drives(self, path: Path, times: Array) -> Array:
        """Return the inputs of `Elements.evaluate` for all drivers at the times, shape (5 *
        drivers, n).
        """
        drivers = self.mechanism.drivers
        drive = (
            path.drive([driver.name for driver in drivers], times)
            if drivers
            else np.empty((3, 0, len(times)))
        )
        return drive_numbers(drivers, drive, self.frame.unit)

    def moved(self, state: Array, step: Array) -> Array:
        """The state after a step of the unknowns; the Euler parameters have length one again."""
        n = self.bodies
        q = self._turn(state[3 * n : 7 * n], step[3 * n : 6 * n])
        return np.concatenate([state[: 3 * n] + step[: 3 * n], q, state[7 * n :] + step[6 * n :]])

    def evaluate(self, state: Array, drives: Array) -> float:
        """Evaluate all rows, and return the largest residual of the solved ones."""
        self.elements.evaluate(state, drives)
        self.factors.update(self.elements.entries[self.solved])
        return float(np.abs(self.elements.phi[self.kept]).max())

    def _closed(self, state: Array) -> Stand:
        """The design position; a rod given longer or shorter than its design distance is taken up
        here.
        """
        residual = math.inf
        for _ in range(50):
            residual = self.evaluate(state, self._rest)
            if residual <= CLOSED or not math.isfinite(residual):
                break
            try:
                self.factors.factor()
            except SingularError:
                break
            state = self.moved(state, -self.factors.solve(self.elements.phi[self.kept]))
        if not residual <= CLOSED or not self.elements.branch.min(initial=1.0) > 0.0:
            raise SolveError(
                f"mechanism {self.mechanism.name!r} does not close at the design position: residual"
                f" {residual * self.frame.unit:.3g} m after Newton's iteration, expected 0; check"
                " points, axes and lengths",
                FailureKind.NOT_CLOSED,
            )
        zero = np.zeros(self.elements.numbering.unknowns)
        return Stand(0.0, 0.0, state, state, zero, zero)

    def moving(self, at: Stand, time: float, drives: Array) -> Stand:
        """Return a pose with rates by the drives there, and no step behind it. Raises PoseError."""
        self.evaluate(at.state, drives)
        rates, accelerations = self.motion()
        now = replace(
            at,
            time=time,
            earlier=time,
            predicted=at.state,
            rates=rates,
            accelerations=accelerations,
        )
        pivot, orientation = self._pivots()
        sigmas = self._sigmas(pivot)
        slopes, high = (
            each if len(each) else np.zeros(len(sigmas)) for each in (at.slopes, at.high)
        )
        now = replace(
            now,
            turns=drives[self.angles],
            sigmas=sigmas,
            slopes=slopes,
            high=np.maximum(high, sigmas),
        )
        return replace(
            now, pivot=pivot, largest_pivot=max(at.largest_pivot, pivot), orientation=orientation
        )

    def _pivots(self) -> tuple[float, bytes]:
        """Return the smallest pivot, and the orientation, by the last factors."""
        pivot, entries = self.factors.signed_pivot, self.elements.entries[self.solved]
        return abs(pivot), self.blocks.orientation(entries[:, None], np.array([pivot]))[0]

    def _sigmas(self, pivot: float) -> Array:
        """Return the sigmas of the blocks by the last factors; their smallest pivot instead if all
        rows are solved.
        """
        if not len(self.dropped):
            return np.array([pivot])
        factors, entries = self.factors, self.elements.entries[self.solved]
        return self.blocks.sigmas(entries[:, None], factors.solve, factors.solve_transposed)[0]

    def _factor(self) -> None:
        try:
            self.factors.factor()
        except SingularError as error:
            raise PoseError(PoseFailure(FailureKind.SINGULAR_ROWS)) from error

    def motion(self) -> tuple[Array, Array]:
        """Return rates and accelerations of the unknowns at the last evaluated pose: one
        factorisation for both.
        """
        self._factor()
        rates = self.factors.solve(self.elements.nu[self.kept])
        self.elements.accelerate(rates)
        return rates, self.factors.solve(self.elements.gamma[self.kept])

    @property
    def details(self) -> dict[str, Any]:
        """Details of the model for the record of a solution."""
        rows = len(self.elements.owners) - len(self.mechanism.drivers)
        return {
            **counted(self.mechanism, len(self.kept), rows, self.redundant).details,
            "unknowns": len(self.kept),
            "program": self.elements.sizes,
            "factor_entries": self.factors.entries,
        }
