"""Adapters: one file an engine, each made from the neutral mechanism. Engines are imported only when they are used."""

import importlib
from typing import Any

ENGINES = {
    "native": "Native",
    "mujoco": "MuJoCo",
    "pinocchio": "Pinocchio",
    "exudyn": "Exudyn",
}
"""Name on the command line (and of the module) -> class."""


def engine(name: str) -> Any:
    """The engine of that name, ready to use; its simulator is not imported yet."""
    return getattr(importlib.import_module(f".{name}", __name__), ENGINES[name])()
