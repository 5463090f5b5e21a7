"""The native engine: the formulation of kincheck.core, entering by the same door as the simulators."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from ..core.analysis.march import Route
from ..core.analysis.model import LAST_ITERATION, compile_model
from ..core.analysis.programs import Request
from ..core.analysis.solve import follow
from ..core.harness.case import Case
from ..core.program.compiled import available
from ..core.trajectory import Trajectory


class Native:
    """Geometric constraints in global axes, traced, run over lanes of samples by machine code, or by numpy without llvmlite."""

    name = "native"
    mode = "projection"

    @property
    def loop(self) -> str:
        """Newton's iteration over the samples runs in machine code where there is a compiler for it."""
        return "compiled" if available() else "python"

    @property
    def settings(self) -> Mapping[str, Any]:
        """Formulation, executor and how the loop ends."""
        executor = "llvm, vectors of lanes" if available() else "numpy, one call an operation over all lanes"
        return {"row_style": "native (global axes)", "executor": executor, "last_iteration_below": LAST_ITERATION}

    def version(self) -> str | None:
        """Version of kincheck."""
        try:
            return version("kincheck")
        except PackageNotFoundError:
            return None

    def unsupported(self, case: Case) -> str | None:
        """Never: a joint is supported by being composed of primitives."""
        return None

    def build(self, case: Case) -> Route:
        """Select the rows, trace the programs for the points that the outputs read, and lay out the samples."""
        path = case.sweep.path
        return Route(compile_model(case.mechanism, Request(tuple(path.motions), case.points)), path)

    def solve(self, model: Route, case: Case, tol: float) -> Trajectory:
        """March all samples; tol is relative to the mechanism's size."""
        return follow(model, tol)

    def efforts(self) -> Mapping[str, Native]:
        """One: its iteration ends by itself, and what a coarser end would save is less than a microsecond."""
        return {"until converged": self}

    def floor(self, case: Case) -> None:
        """None: its loop is compiled."""
