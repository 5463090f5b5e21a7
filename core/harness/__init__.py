"""Runs of cases in engines: engine protocol, execution, comparison and results. The harness names
no simulator.
"""

from importlib import import_module
from typing import Any


def __getattr__(name: str) -> Any:
    """Return `check_joint`, which `kincheck.core` exports since version 0.2, for older scripts."""
    if name != "check_joint":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_module("kincheck.core").check_joint
