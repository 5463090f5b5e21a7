"""The native engine on the command line, with its efforts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from ..core.harness.native_engine import NativeEngine
from ..core.kinematics import LAST_ITERATION

# Largest residual at the start of Newton's last step, by effort. The step leaves about the square
# of this residual.
EFFORTS: Mapping[str, float] = {
    "1 Newton step": math.inf,
    "last step from below 1e-4": 1e-4,
    "last step from below 1e-6": 1e-6,
    "until converged": LAST_ITERATION,
}


@dataclass(frozen=True)
class Native(NativeEngine):
    """The native engine; see `Measurable`."""

    def efforts(self) -> Mapping[str, Native]:
        """Return the efforts, by the residual at the start of Newton's last step; all have the same
        predictor.
        """
        return {
            label: replace(self, solver=replace(self.solver, last_iteration=last))
            for label, last in EFFORTS.items()
        }
