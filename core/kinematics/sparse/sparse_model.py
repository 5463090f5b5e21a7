"""A large mechanism as one sparse system, if components cannot be solved one after the other and
one compiled program would be too large.

With machine code several samples are solved at once (see `together`). Samples refused there, and
all samples without machine code, are solved here one by one: constraints in bulk (see `elements`),
SuperLU in a fixed order (see `sparse_lu`). A sample is predicted by a Taylor step and takes two
factorisations: at the predicted pose for Newton's iterations, as long as they converge fast, and at
the solution for velocities and accelerations. One factorisation for all, with refinement for the
last two, takes a third longer on a ring of 3,000 cranks and a tenth less on a chain of 5,000 loops.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from functools import cached_property

import numpy as np

from ...failures import PoseFailure
from ...trajectory import Array
from ..compiled.request import MAX_ITERATIONS
from ..continuation.failure_reasons import failure_kind
from ..structure.sparse_lu import SingularError
from .batched_newton import Batch
from .row_selection import Jacobian
from .sparse_equations import PoseError, SparseEquations
from .step_state import CONTRACTS, SETTLED, STALLS, Poses, Stand, distance, lacked

# Rows are chosen anew where that makes the determinant, and so the least of what it is a product
# of, as many times larger.
BETTER = 3.0
FEW = 5
"""Names listed in a message, at most."""


class SparseModel(SparseEquations):
    """Sparse equations with steps along a motion, and a choice of better rows on the way."""

    def anew(
        self, at: Stand, drives: Array, known: Sequence[SparseModel]
    ) -> tuple[SparseModel, Stand] | None:
        """Return the model with better rows at a pose, and the pose by these rows; None if none are
        better.

        Args:
            known: models with other rows, made earlier.

        Raises:
            PoseError: the pose is too near to a singular one to compare rows.
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

    @cached_property
    def together(self) -> Batch | None:
        """Batch of samples by machine code; None without machine code."""
        return Batch(self) if self.elements.compiled else None

    def _predicted(self, here: Stand, time: float) -> tuple[Array, Array]:
        """Return a Taylor step of second order, without and with the error of the last such step,
        which grows by the cube of the step.
        """
        h = time - here.time
        taylor = self.moved(here.state, h * (here.rates + (0.5 * h) * here.accelerations))
        corrected = taylor + lacked(np.array(h), here.time - here.earlier) * (
            here.state - here.predicted
        )
        return taylor, self.moved(corrected, np.zeros_like(here.rates))

    def reach(self, here: Stand, time: float, drives: Array, tol: float) -> Stand:
        """Go from a pose of the motion to a time.

        Raises:
            PoseError: there is no solution, or it does not continue the motion.
        """
        # a lost iteration may overflow; it is found by its residual
        with np.errstate(all="ignore"):
            taylor, state = self._predicted(here, time)
            residual = self.evaluate(state, drives)
            rate, done, iterations = math.inf, residual <= SETTLED, 0
            while not done and iterations < MAX_ITERATIONS:
                if not math.isfinite(residual):
                    raise self._failed(["closed"], residual, tol)
                renewed = not rate <= CONTRACTS
                if renewed:
                    self._factor()
                state = self.moved(state, -self.factors.solve(self.elements.phi[self.kept]))
                last, residual = residual, self.evaluate(state, drives)
                rate, iterations = residual / last, iterations + 1
                done = residual <= SETTLED or (renewed and residual <= tol and rate > STALLS)
            if not done or not math.isfinite(residual):
                raise self._failed(["closed"], residual, tol)
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
            sigmas=self._sigmas(pivot)[None],
        )
        failed = [name for name, passed in poses.passed(here, tol).items() if not passed.all()]
        if failed:
            raise self._failed(failed, residual, tol, leftover, branch)
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

    def _failed(
        self,
        failed: Sequence[str],
        closure: float,
        tol: float,
        leftover: float = 0.0,
        branch: float = 1.0,
    ) -> PoseError:
        """Return the failure of a pose by the criteria not met."""
        names = self.redundant
        few = [*names[:FEW], "..."] if len(names) > FEW else names
        kind = failure_kind(failed, closure)
        return PoseError(PoseFailure(kind, closure, tol, leftover, branch, few))
