"""An engine whose module cannot be loaded, in its place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..case.case import Case
from ..trajectory import Trajectory


@dataclass(frozen=True)
class Unloadable:
    """What stands in the place of an engine whose own module fails when it is imported: its pairs
    are errors, which say why.
    """

    name: str
    reason: str
    mode: str
    loop: str = "unknown"
    settings: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def version(self) -> str | None:
        """Where an engine is asked first.

        Raises:
            ImportError: always, with the reason.
        """
        raise ImportError(f"engine {self.name!r} cannot be loaded: {self.reason}")

    def unsupported(self, case: Case) -> str | None:
        """Never asked."""
        return None

    def build(self, case: Case) -> Any:
        """Never asked."""

    def solve(self, model: Any, case: Case, tol: float) -> Trajectory:
        """Never asked."""
        raise NotImplementedError
