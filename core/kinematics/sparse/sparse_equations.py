"""A large mechanism as one sparse system, for mechanisms of which no component can be solved alone
and one compiled program would be too large: its rows, their factors, and rates at poses.

Constraints are evaluated in bulk (see `elements`), at several poses at once; each pose has factors
of its own (SuperLU in a fixed order, see `sparse_lu`). Lengths are measured near the size of the
bodies, not of the whole mechanism: the entries of the matrix and the round-off of the rows depend
on that size.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import SolveError
from ...failures import FailureKind
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...trajectory import Array
from ..compiled.compiled_model import CLOSED
from ..formulation.constraints import constraints, measured
from ..formulation.driver_inputs import drive_numbers
from ..structure.degrees_of_freedom import counted
from ..structure.driver_count import locked_drivers, require_driven
from ..structure.redundancy import RANK_TOLERANCE
from ..structure.sparse_lu import Factors, Indices, Order, SingularError
from .determinant_signs import Blocks
from .elements import Elements
from .rotation_update import Turn
from .row_selection import Jacobian

# Poses evaluated together: so many share the calls of numpy, and the samples that are so far from
# the last one are still predicted well.
POSES = 8


@dataclass(frozen=True, eq=False)
class Rows:
    """A choice of the rows to solve.

    Attributes:
        kept, dropped: solved rows, and redundant rows.
        solved: entries of the solved rows, among those of all.
        order, blocks: of the matrix of these entries.
    """

    kept: Indices
    dropped: Indices
    solved: Indices
    order: Order
    blocks: Blocks

    @staticmethod
    def of(kept: Indices, jacobian: Jacobian) -> Rows:
        """Return the choice of these rows. Raises SingularError."""
        among = jacobian.among(kept)
        solved = np.flatnonzero(among >= 0)
        pattern = among[solved], jacobian.columns[solved]
        order = Order(*pattern, jacobian.values[solved], len(kept))
        blocks = Blocks(*pattern, len(kept), well_chosen=jacobian.well_chosen)
        return Rows(kept, np.setdiff1d(np.arange(jacobian.shape[0]), kept), solved, order, blocks)


@dataclass(frozen=True, eq=False)
class Stand:
    """A pose of the motion with its rates and tests.

    Attributes:
        rows: the solved ones.
        time: of the pose; earlier: of the previous pose, the same without one.
        state, predicted: the pose, and the Taylor step to it from the previous pose; see
            `Numbering`.
        rates, accelerations: of the unknowns.
        drives: see `Elements.evaluate`.
        pivot, largest_pivot: smallest pivot, and its largest value so far.
        orientation, sigmas: of the blocks (see `Blocks`); slopes: change of the sigmas by the pose,
            zero if unknown; largest: of each so far; high: since other rows were looked for.
        past: times and states of the last samples, this one the last, as far as they are known.
    """

    rows: Rows
    time: float
    earlier: float
    state: Array
    predicted: Array
    rates: Array
    accelerations: Array
    drives: Array = field(default_factory=lambda: np.zeros(0))
    pivot: float = 0.0
    largest_pivot: float = 0.0
    orientation: bytes = b""
    sigmas: Array = field(default_factory=lambda: np.zeros(0))
    slopes: Array = field(default_factory=lambda: np.zeros(0))
    largest: Array = field(default_factory=lambda: np.zeros(0))
    high: Array = field(default_factory=lambda: np.zeros(0))
    past: Sequence[tuple[float, Array]] = ()


class SparseEquations:
    """The rows of a mechanism at several poses, and their solution.

    Attributes:
        mechanism: the mechanism.
        unit: the length unit of residuals [m].
        frame: unit and origins of the lengths.
        elements: the values of the rows.
        scale: see `distance`.
        angles: of turning drivers, among the numbers of all drives.
        design: design position, all drivers at rest.

    Raises:
        SolveError: the mechanism cannot move, has more degrees of freedom than drivers, or does not
            close at the design position.
    """

    def __init__(self, mechanism: Mechanism, *, compiled: bool = True) -> None:
        if not mechanism.moving:
            require_driven(mechanism)
        self.mechanism = mechanism
        extent, self.frame = measured(mechanism)
        self.unit = self.frame.unit
        self.elements = Elements(
            constraints(mechanism, self.frame, {}),
            self.frame.moving,
            len(mechanism.drivers),
            POSES,
            compiled=compiled,
        )
        numbering = self.elements.numbering
        n = self.bodies = len(self.frame.moving)
        # what a change of the state is measured by: lengths by the mechanism's size
        length = self.unit / extent
        coordinates = [
            length if name.endswith(".translation") else 1.0 for name in numbering.coordinates
        ]
        self.scale = np.concatenate([np.full(3 * n, length), np.ones(4 * n), coordinates])
        state = np.zeros(numbering.state)
        state[3 * n : 4 * n] = 1.0
        self._turn = Turn(n * POSES, compiled=compiled)
        self.angles = [5 * k for k, driver in enumerate(mechanism.drivers) if driver.turns]
        self._rest = self.drives(Path({}, np.zeros(1)), np.zeros(1))
        self.evaluate(state[:, None], self._rest)
        self.rows = self._selected()
        self.design = self._closed(state)

    def _selected(self) -> Rows:
        """Return the rows to solve."""
        jacobian, drivers = self.jacobian(), len(self.mechanism.drivers)
        count, unknowns = jacobian.shape
        if count < unknowns:
            require_driven(self.mechanism)
        try:
            rows = Rows.of(jacobian.independent(drivers), jacobian)
            factors = rows.order.factor(jacobian.values[rows.solved])
            regular = abs(factors.signed_pivot) > RANK_TOLERANCE
            if regular and not (rows.dropped >= count - drivers).any():
                self._entries = factors.entries
                return rows
        except SingularError:
            pass
        require_driven(self.mechanism)
        raise SolveError(
            f"mechanism {self.mechanism.name!r}: driven by {locked_drivers(self.mechanism)} it"
            " does not move at the design position (lock-up or dead centre); give the design"
            " in another pose, some degrees on, and sweep from there, or drive another"
            " coordinate",
            FailureKind.LOCKED,
        )

    def jacobian(self) -> Jacobian:
        """Return the Jacobian of all rows at the first of the last evaluated poses."""
        elements = self.elements
        shape = len(elements.phi), elements.numbering.unknowns
        return Jacobian(elements.rows, elements.columns, elements.entries[:, 0].copy(), shape)

    def redundant(self, rows: Rows) -> list[str]:
        """Return the rows left out, as "joint: primitive"."""
        dropped: list[int] = rows.dropped.tolist()
        return [": ".join(self.elements.owners[row]) for row in dropped]

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
        return drive_numbers(drivers, drive, self.unit)

    def moved(self, state: Array, step: Array) -> Array:
        """The states after steps of the unknowns, shape (numbers, poses) each; the Euler parameters
        have length one again.
        """
        n = self.bodies
        q = self._turn(state[3 * n : 7 * n], step[3 * n : 6 * n])
        return np.concatenate([state[: 3 * n] + step[: 3 * n], q, state[7 * n :] + step[6 * n :]])

    def evaluate(self, state: Array, drives: Array) -> None:
        """Evaluate all rows at states and drives, shape (numbers, poses) each, or (numbers, 1) for
        all poses the same.
        """
        self.elements.evaluate(_repeated(state), _repeated(drives))

    def residuals(self, rows: Rows) -> Array:
        """Return the largest residual of the solved rows of each last evaluated pose."""
        return np.abs(self.elements.phi[rows.kept]).max(axis=0)

    def factor(self, rows: Rows, pose: int) -> Factors:
        """Return the factors of the solved rows at a last evaluated pose. Raises SingularError."""
        return rows.order.factor(self.elements.entries[rows.solved, pose])

    def motion(self, rows: Rows, factors: Sequence[Factors | None]) -> tuple[Array, Array]:
        """Return rates and accelerations of the unknowns at the last evaluated poses by their
        factors, shape (unknowns, poses) each; NaN without factors.
        """
        rates, accelerations = (np.full((len(rows.kept), POSES), np.nan) for _ in range(2))
        nu, gamma = self.elements.nu, self.elements.gamma
        for k, each in enumerate(factors):
            if each is not None:
                rates[:, k] = each.solve(nu[rows.kept, k])
        self.elements.accelerate(rates)
        for k, each in enumerate(factors):
            if each is not None:
                accelerations[:, k] = each.solve(gamma[rows.kept, k])
        return rates, accelerations

    def _closed(self, state: Array) -> Stand:
        """The design position; a rod given longer or shorter than its design distance is taken up
        here.
        """
        residual, at = math.inf, _repeated(state[:, None])
        for _ in range(50):
            self.evaluate(at, self._rest)
            residual = float(self.residuals(self.rows)[0])
            if residual <= CLOSED or not math.isfinite(residual):
                break
            try:
                factors = self.factor(self.rows, 0)
            except SingularError:
                break
            at = self.moved(
                at, _repeated(-factors.solve(self.elements.phi[self.rows.kept, 0])[:, None])
            )
        if not residual <= CLOSED or not self.elements.branch.min(initial=1.0) > 0.0:
            raise SolveError(
                f"mechanism {self.mechanism.name!r} does not close at the design position: residual"
                f" {residual * self.unit:.3g} m after Newton's iteration, expected 0; check"
                " points, axes and lengths",
                FailureKind.NOT_CLOSED,
            )
        zero, state = np.zeros(self.elements.numbering.unknowns), at[:, 0].copy()
        return Stand(self.rows, 0.0, 0.0, state, state, zero, zero, self._rest[:, 0])

    def moving(self, at: Stand, time: float, drives: Array) -> Stand:
        """Return a pose with rates by drives there, shape (5 * drivers, 1), and no step behind it.

        Raises:
            SingularError: the rows are singular there.
        """
        rows = at.rows
        self.evaluate(at.state[:, None], drives)
        factors = self.factor(rows, 0)
        rates, accelerations = self.motion(rows, [factors])
        pivot = abs(factors.signed_pivot)
        orientation, sigmas = self.tests(rows, {0: factors})
        slopes, largest, high = (
            each if len(each) else np.zeros(sigmas.shape[1])
            for each in (at.slopes, at.largest, at.high)
        )
        return replace(
            at,
            time=time,
            earlier=time,
            predicted=at.state,
            rates=rates[:, 0],
            accelerations=accelerations[:, 0],
            drives=drives[:, 0],
            pivot=pivot,
            largest_pivot=max(at.largest_pivot, pivot),
            orientation=orientation[0],
            sigmas=sigmas[0],
            slopes=slopes,
            largest=np.maximum(largest, sigmas[0]),
            high=np.maximum(high, sigmas[0]),
            past=((time, at.state),),
        )

    def tests(self, rows: Rows, factors: Mapping[int, Factors]) -> tuple[list[bytes], Array]:
        """Return the orientation and the sigmas of the blocks at some of the last evaluated poses,
        by their factors; sigmas have shape (poses, blocks).
        """
        values = self.elements.entries[rows.solved][:, [*factors]]
        signed = np.array([each.signed_pivot for each in factors.values()])

        def each(b: Array, name: str) -> Array:
            found = [getattr(one, name)(b[:, k]) for k, one in enumerate(factors.values())]
            return np.stack(found, axis=1)

        sigmas = rows.blocks.sigmas(
            values, lambda b: each(b, "solve"), lambda b: each(b, "solve_transposed")
        )
        return rows.blocks.orientation(values, signed), sigmas

    @cached_property
    def details(self) -> dict[str, Any]:
        """Details of the model for the record of a solution."""
        rows = len(self.elements.owners) - len(self.mechanism.drivers)
        kept = len(self.rows.kept)
        return {
            **counted(self.mechanism, kept, rows, self.redundant(self.rows)).details,
            "unknowns": kept,
            "program": self.elements.sizes,
            "factor_entries": self._entries,
        }


def _repeated(table: Array) -> Array:
    """Return a table for all poses, from one for all or for the same."""
    return np.broadcast_to(table, (len(table), POSES))


def distance(change: Array, scale: Array) -> Array:
    """The largest of changes of the state, shape (numbers, poses), each number measured by its
    scale; shape (poses,).
    """
    return np.abs(change.T * scale).max(axis=-1)
