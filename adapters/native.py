"""The native engine: the formulation of kincheck.core, entering by the same door as the
simulators.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..core.case.case import Case
from ..core.kinematics import LAST_ITERATION, NativeSolver, Solver
from ..core.program.llvm.compiler import available
from ..core.trajectory import Trajectory
from ..core.version import VERSION

# Residuals from which Newton's last step starts, by effort: what that step leaves is about its
# square.
EFFORTS: Mapping[str, float] = {
    "1 Newton step": math.inf,
    "last step from below 1e-4": 1e-4,
    "last step from below 1e-6": 1e-6,
    "until converged": LAST_ITERATION,
}


@dataclass(frozen=True)
class Native:
    """Geometric constraints in global axes, traced, run over lanes of samples by machine code, or
    by numpy without llvmlite.

    Attributes:
        last_iteration: the step that starts from a residual below this is a sample's last [units of
            the mechanism's size]; above the default, what it leaves is accepted whatever it is.
    """

    last_iteration: float = LAST_ITERATION
    name = "native"
    mode = "projection"
    in_process = True
    bounds_error = True

    @property
    def loop(self) -> str:
        """Newton's iteration over the samples runs in machine code where there is a compiler for
        it.
        """
        return "compiled" if available() else "python"

    @property
    def settings(self) -> Mapping[str, Any]:
        """Formulation, executor and how the loop ends."""
        executor = (
            "llvm, vectors of lanes"
            if available()
            else "numpy, one call an operation over all lanes"
        )
        last = self.last_iteration if math.isfinite(self.last_iteration) else "any"
        return {
            "row_style": "native (global axes)",
            "executor": executor,
            "last_iteration_below": last,
        }

    def version(self) -> str | None:
        """Version of kincheck."""
        return VERSION

    def unsupported(self, case: Case) -> str | None:
        """Return None always: a joint is supported by being composed of primitives."""
        return None

    def build(self, case: Case) -> Solver:
        """Select the rows, trace the programs for the points that the outputs read, and lay out the
        samples.
        """
        solver = NativeSolver(last_iteration=self.last_iteration)
        return solver.prepare(case.mechanism, case.sweep.path, case.points, forces=case.forces)

    def solve(self, model: Solver, case: Case, tol: float) -> Trajectory:
        """March all samples; tol is relative to the mechanism's size."""
        return model(tol if self.last_iteration <= LAST_ITERATION else math.inf)

    def efforts(self) -> Mapping[str, Native]:
        """Return the efforts by how near to the solution Newton's last step starts; the predictor
        is the same.
        """
        return {label: Native(last) for label, last in EFFORTS.items()}

    def floor(self, case: Case) -> None:
        """Return None: its loop is compiled."""
