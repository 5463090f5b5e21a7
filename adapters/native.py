"""The native engine: the formulation of kincheck.core, entering by the same door as the simulators."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from ..core.analysis.model import Model, compile_model
from ..core.analysis.programs import Request
from ..core.analysis.solve import sweep
from ..core.harness.case import Case
from ..core.trajectory import Trajectory


class Native:
    """Geometric constraints in global axes, traced and run by numpy over lanes of samples."""

    name = "native"
    mode = "projection"
    loop = "python"

    @property
    def settings(self) -> Mapping[str, Any]:
        """Formulation, executor and how the loop ends."""
        return {"row_style": "native (global axes)", "executor": "numpy, lanes of samples", "last_iteration_below": 1e-9}

    def version(self) -> str | None:
        """Version of kincheck."""
        try:
            return version("kincheck")
        except PackageNotFoundError:
            return None

    def unsupported(self, case: Case) -> str | None:
        """Never: a joint is supported by being composed of primitives."""
        return None

    def build(self, case: Case) -> Model:
        """Select the rows and trace the programs for the points that the outputs read."""
        return compile_model(case.mechanism, Request(tuple(case.sweep.path.motions), case.points))

    def solve(self, model: Model, case: Case, tol: float) -> Trajectory:
        """March all samples; tol is relative to the mechanism's size."""
        return sweep(model, case.sweep.path, tol)
