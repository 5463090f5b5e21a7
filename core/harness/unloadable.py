"""Substitute for an engine whose module cannot be loaded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..case.case import Case
from ..trajectory import Trajectory


@dataclass(frozen=True)
class Unloadable:
    """Substitute for an engine whose module cannot be imported: its pairs end in an error."""

    name: str
    reason: str
    mode: str
    loop: str = "unknown"
    settings: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def version(self) -> str | None:
        """Raise the import error. The harness calls this method first.

        Raises:
            ImportError: always.
        """
        raise ImportError(f"engine {self.name!r} cannot be loaded: {self.reason}")

    def unsupported(self, case: Case) -> str | None:
        """Return None; never called."""
        return None

    def build(self, case: Case) -> Any:
        """Return None; never called."""

    def solve(self, model: Any, case: Case, tol: float) -> Trajectory:
        """Raise an error; never called."""
        raise NotImplementedError
