"""The harness: cases, the engine protocol, running, comparing and reporting. It knows no
simulator.
"""

from importlib import import_module
from typing import Any


def __getattr__(name: str) -> Any:
    """Return `check_joint`, which versions before 0.2 had here; `kincheck.core` has it now."""
    if name != "check_joint":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module("kincheck.core").check_joint
