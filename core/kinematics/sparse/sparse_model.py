"""A large mechanism as one sparse system: for what cannot be solved part by part and is too large
for a program of its own.

With machine code several samples are solved at once (see `together`). What these cannot follow, and
all where there is none, is solved here, one sample after the other: constraints in bulk (see
`elements`), SuperLU in a fixed order (see `factors`). A sample is predicted by a Taylor step and
takes two factorisations: at the predicted pose for Newton's iterations, as long as they converge
fast with it, and at the solution for velocities and accelerations. With one for all, and refinement
for the last two, a ring of 3,000 cranks takes a third longer, a chain of 5,000 loops a tenth less.
Lengths are measured near the size of the bodies, not of the whole: that is what the entries of the
matrix and the round-off of the rows depend on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from ...errors import SolveError
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from ...trajectory import Array
from ..compiled.compiled_model import CLOSED, MAX_ITERATIONS
from ..continuation.failure_reasons import in_words
from ..formulation.constraints import constraints, measured
from ..formulation.driver_inputs import drive_numbers
from ..structure.degrees_of_freedom import counted
from ..structure.driver_count import locked_drivers, require_driven
from ..structure.redundancy import RANK_TOLERANCE
from ..structure.sparse_lu import Factors, Indices, SingularError
from .batched_newton import Batch
from .determinant_signs import Blocks
from .elements import Elements
from .rotation_update import Turn
from .row_selection import Jacobian
from .step_state import CONTRACTS, SETTLED, STALLS, Poses, Stand, distance, lacked

# Rows are chosen anew where that makes the determinant, and so the least of what it is a product
# of, as many times larger.
BETTER = 3.0
FEW = 5
"""Names listed in a message, at most."""


class FailedError(ArithmeticError):
    """A pose that is not reached, and why."""


class SparseModel:
    """A mechanism made ready to be solved along paths, as often as wanted.

    Attributes:
        extent: a power of two of metres near the mechanism's size; frame: what lengths are measured
            in.
        kept, dropped: rows that are solved, and rows that repeat them; solved: the entries of
            those.
        blocks, factors: of the matrix that these make.
        scale: see `distance`.
        design: at the design position, with all drivers at rest.

    Raises:
        SolveError: it cannot move, can move more than its drivers say, or does not close at the
            design position.
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
                " coordinate"
            )

    def _keep(self, kept: Indices, jacobian: Jacobian) -> None:
        """Solve these rows. Raises SingularError."""
        self.kept, self.dropped = kept, np.setdiff1d(np.arange(jacobian.shape[0]), kept)
        among = jacobian.among(kept)
        self.solved = np.flatnonzero(among >= 0)
        pattern = among[self.solved], jacobian.columns[self.solved]
        self.factors = Factors(*pattern, jacobian.values[self.solved], len(kept))
        self.blocks = Blocks(*pattern, len(kept), well_chosen=jacobian.well_chosen)

    def anew(
        self, at: Stand, drives: Array, known: Sequence[SparseModel]
    ) -> tuple[SparseModel, Stand] | None:
        """The same by rows that are better where a motion stands, and how it stands by them; None
        where none are better.

        Args:
            known: others that are made already.

        Raises:
            FailedError: it is too near to a singular pose for that to be seen.
        """
        self.evaluate(at.state, drives)
        self._factor()
        jacobian = Jacobian.of(self.elements)
        if not (len(self.dropped) and jacobian.well_chosen):
            return None
        kept = jacobian.independent(len(self.mechanism.drivers))
        other = next((each for each in known if np.array_equal(each.kept, kept)), None)
        try:
            if other is None:
                other = copy(self)  # elements and all that rows have no part in are shared
                vars(other).pop("together", None)
                other._keep(kept, jacobian)
            other.factors.update(jacobian.values[other.solved])
            other.factors.factor()
        except SingularError:
            return None
        if not other.factors.log_determinant > self.factors.log_determinant + math.log(BETTER):
            return None
        still = Stand(at.time, at.time, at.state, at.state, at.rates, at.accelerations)
        return other, other.moving(still, at.time, drives)

    @property
    def redundant(self) -> list[str]:
        """The rows that are left out, as "joint: primitive"."""
        rows: list[int] = self.dropped.tolist()
        return [": ".join(self.elements.owners[row]) for row in rows]

    def drives(self, path: Path, times: Array) -> Array:
        """What `Elements.evaluate` wants of all drivers at the times, shape (5 * drivers, n)."""
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
        """Evaluate all rows, and the largest residual of those that are solved."""
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
                " points, axes and lengths"
            )
        zero = np.zeros(self.elements.numbering.unknowns)
        return Stand(0.0, 0.0, state, state, zero, zero)

    def moving(self, at: Stand, time: float, drives: Array) -> Stand:
        """What stands, with the rates that the drives give it there, and no step behind it. Raises
        FailedError.
        """
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
        (pivot, orientation), sigmas = self._pivots(), self._sigmas()
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
        """The smallest in size, and the orientation, where all was last factored."""
        pivot, entries = self.factors.signed_pivot, self.elements.entries[self.solved]
        return abs(pivot), self.blocks.orientation(entries[:, None], np.array([pivot]))[0]

    def _sigmas(self) -> Array:
        """Those of the blocks where all was last factored; where all rows are solved the smallest
        pivot stands for all.
        """
        if not len(self.dropped):
            return np.array([abs(self.factors.signed_pivot)])
        factors, entries = self.factors, self.elements.entries[self.solved]
        return self.blocks.sigmas(entries[:, None], factors.solve, factors.solve_transposed)[0]

    def _factor(self) -> None:
        try:
            self.factors.factor()
        except SingularError as error:
            raise FailedError("the equations are singular there") from error

    def motion(self) -> tuple[Array, Array]:
        """Rates and accelerations of the unknowns where all was last evaluated: one factorisation
        for both.
        """
        self._factor()
        rates = self.factors.solve(self.elements.nu[self.kept])
        self.elements.accelerate(rates)
        return rates, self.factors.solve(self.elements.gamma[self.kept])

    @property
    def details(self) -> dict[str, Any]:
        """What the record of every solution says of the model."""
        rows = len(self.elements.owners) - len(self.mechanism.drivers)
        return {
            **counted(self.mechanism, len(self.kept), rows, self.redundant).details,
            "unknowns": len(self.kept),
            "program": self.elements.sizes,
            "factor_entries": self.factors.entries,
        }

    @cached_property
    def together(self) -> Batch | None:
        """Several samples at once, by machine code; None where there is none."""
        return Batch(self) if self.elements.compiled else None

    def _predicted(self, here: Stand, time: float) -> tuple[Array, Array]:
        """A Taylor step of second order, and that with what the last such step lacked, which grows
        by the cube of the step.
        """
        h = time - here.time
        taylor = self.moved(here.state, h * (here.rates + (0.5 * h) * here.accelerations))
        corrected = taylor + lacked(np.array(h), here.time - here.earlier) * (
            here.state - here.predicted
        )
        return taylor, self.moved(corrected, np.zeros_like(here.rates))

    def reach(self, here: Stand, time: float, drives: Array, tol: float) -> Stand:
        """Go from where a motion stands to a time.

        Raises:
            FailedError: what is there is no solution, or does not continue the motion.
        """
        # a lost iteration may overflow; it is found by its residual
        with np.errstate(all="ignore"):
            taylor, state = self._predicted(here, time)
            residual = self.evaluate(state, drives)
            rate, done, iterations = math.inf, residual <= SETTLED, 0
            while not done and iterations < MAX_ITERATIONS:
                if not math.isfinite(residual):
                    raise FailedError("Newton diverges to numbers that are not finite")
                renewed = not rate <= CONTRACTS
                if renewed:
                    self._factor()
                state = self.moved(state, -self.factors.solve(self.elements.phi[self.kept]))
                last, residual = residual, self.evaluate(state, drives)
                rate, iterations = residual / last, iterations + 1
                done = residual <= SETTLED or (renewed and residual <= tol and rate > STALLS)
            if not done or not math.isfinite(residual):
                raise FailedError(self._in_words(["closed"], residual, tol))
            step, gap = (
                float(distance(state - other, self.scale)) for other in (here.state, taylor)
            )
            rates, accelerations = self.motion()
        pivot, orientation = self._pivots()
        leftover = float(np.abs(self.elements.phi[self.dropped]).max(initial=0.0))
        branch = float(self.elements.branch.min(initial=1.0))
        poses = Poses(
            done=np.array([done]),
            closure=np.array([residual]),
            leftover=np.array([leftover]),
            branch=np.array([branch]),
            gap=np.array([gap]),
            step=np.array([step]),
            turn=np.array([np.abs(drives[self.angles] - here.turns).max(initial=0.0)]),
            pivot=np.array([pivot]),
            chosen=True,
            turned=np.array([orientation != here.orientation]),
            sigmas=self._sigmas()[None],
        )
        failed = [name for name, passed in poses.passed(here, tol).items() if not passed.all()]
        if failed:
            raise FailedError(self._in_words(failed, residual, tol, leftover, branch))
        (found,) = poses.remembered(here)
        motion = (
            time,
            here.time,
            state,
            taylor,
            rates,
            accelerations,
            drives[self.angles],
            iterations,
        )
        return Stand(
            *motion,
            residual,
            leftover,
            branch,
            pivot,
            max(pivot, here.largest_pivot),
            orientation,
            *found,
        )

    def _in_words(
        self,
        failed: Sequence[str],
        closure: float,
        tol: float,
        leftover: float = 0.0,
        branch: float = 1.0,
    ) -> str:
        """Why a pose was refused."""
        names = self.redundant
        return in_words(
            failed,
            closure,
            leftover,
            branch,
            tol,
            [*names[:FEW], "..."] if len(names) > FEW else names,
        )
