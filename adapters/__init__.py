"""Adapters: one file an engine or a format, each made from the neutral mechanism. They are imported
only when they are used.
"""

import importlib
from typing import Any

ENGINES = {
    "native": ("native", "Native"),
    "mujoco": ("mujoco.mujoco", "MuJoCo"),
    "pinocchio": ("pinocchio.pinocchio", "Pinocchio"),
    "exudyn": ("exudyn.exudyn", "Exudyn"),
    "drake": ("drake.drake", "Drake"),
    "dart": ("dart.dart", "Dart"),
    "simbody": ("simbody.simbody", "Simbody"),
}
"""Name on the command line: module and class of the engine in projection mode."""

SIMULATIONS = {
    "mujoco": ("mujoco.steps", "stiff"),
    "mujoco-default": ("mujoco.steps", "default"),
    "mujoco-projecting": ("mujoco.steps", "projecting"),
    "pinocchio": ("pinocchio.dynamics", "Dynamics"),
    "exudyn": ("exudyn.solvers", "trapezoidal"),
    "exudyn-alpha": ("exudyn.solvers", "generalized_alpha"),
    "exudyn-static": ("exudyn.solvers", "static"),
    "exudyn-static-modified": ("exudyn.solvers", "static_modified"),
    "drake": ("drake.steps", "Steps"),
    "dart": ("dart.steps", "Steps"),
    "simbody": ("simbody.assembly", "Assembly"),
}
"""Name on the command line -> module and what makes the engine: simulate mode. A simulator's bare
name is its recommended solver.

A record is one of a case, an engine and a mode, and the same name in two modes is two products; a
further variant of a simulator needs a name. A mode of its own for each variant would have made what
may be ranked with what a matter of a list.
"""


def engine(name: str, mode: str = "projection") -> Any:
    """Return the engine of a name and mode; its simulator is not imported yet."""
    module, maker = ENGINES[name] if mode == "projection" else SIMULATIONS[name]
    return getattr(importlib.import_module(f".{module}", __name__), maker)()


WRITERS = ("mjcf", "exudyn", "urdf", "sdf", "osim")
"""Formats, as on the command line; that of a name is the function `write` of the module
writers.NAME.
"""


def writer(name: str) -> Any:
    """The function that writes a mechanism in the format of that name; no simulator is needed for
    it.
    """
    return importlib.import_module(f".writers.{name}", __name__).write
