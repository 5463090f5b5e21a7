"""Cases against engines: protocol, running, comparison, results. No simulator is known here."""

from importlib import import_module
from typing import Any


def __getattr__(name: str) -> Any:
    """Return `check_joint`, which was here before version 0.2; `kincheck.core` has it now."""
    if name != "check_joint":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module("kincheck.core").check_joint
