"""Adapters: one package or file per engine and format, which translates the neutral mechanism. An
adapter is imported at its first use.
"""

import importlib
import json
from pathlib import Path
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
"""Engines in projection mode: name on the command line -> module and class."""

SIMULATIONS = {
    "mujoco": ("mujoco.steps", "stiff"),
    "mujoco-default": ("mujoco.steps", "default"),
    "mujoco-projecting": ("mujoco.steps", "projecting"),
    "pinocchio": ("pinocchio.pinocchio", "Dynamics"),
    "exudyn": ("exudyn.solvers", "trapezoidal"),
    "exudyn-alpha": ("exudyn.solvers", "generalized_alpha"),
    "exudyn-static": ("exudyn.statics", "static"),
    "exudyn-static-modified": ("exudyn.solvers", "static_modified"),
    "drake": ("drake.drake", "Steps"),
    "dart": ("dart.dart", "Steps"),
    "simbody": ("simbody.assembly", "Assembly"),
}
"""Engines in simulate mode: name on the command line -> module and maker of the engine. A
simulator's bare name is its recommended solver.

A record belongs to a case, an engine and a mode, so one name in two modes denotes two products. A
further variant of a simulator gets another name, not another mode, because each mode is a ranking.
"""


def engine(name: str, mode: str = "projection") -> Any:
    """Return the engine of a name and mode; its simulator is not imported yet."""
    module, maker = ENGINES[name] if mode == "projection" else SIMULATIONS[name]
    return getattr(importlib.import_module(f".{module}", __name__), maker)()


WRITERS = ("mjcf", "exudyn", "urdf", "sdf", "osim")
"""Formats on the command line; the function `write` of the module writers.NAME writes format NAME.
"""


def writer(name: str) -> Any:
    """Return the function that writes a mechanism in a named format, without a simulator."""
    return importlib.import_module(f".writers.{name}", __name__).write


CONVERTERS = {"mujoco": "mujoco.saved"}
"""Simulators with converters: name on the command line -> module with `saved`."""


def converter(name: str) -> Any:
    """Return the function from a model's file to the text saved by a simulator."""
    return importlib.import_module(f".{CONVERTERS[name]}", __name__).saved


STEPPERS = ("mujoco", "pinocchio", "exudyn", "drake", "dart", "simbody")
"""Steppers of free motion, by engine; the module NAME.stepper is a script without kincheck."""


def stepper_files(name: str, mechanism: Any, twists: Any) -> dict[str, str]:
    """Return the files of a stepper's reproducer, by name: model.json and run.py, which needs numpy
    and the engine alone.

    Args:
        twists: see `shared.stepper_model`.

    Raises:
        UnsupportedError: steppers lack a part of the mechanism.
    """
    stepper_model = importlib.import_module(".shared.stepper_model", __name__).stepper_model
    folder = Path(__file__).resolve().parent
    parts = [folder / name / "stepper.py", folder / "shared" / "stepper_loop.py"]
    text = "\n\n".join(part.read_text("utf-8").rstrip() for part in parts)
    return {
        "model.json": json.dumps(stepper_model(mechanism, twists), indent=1) + "\n",
        "run.py": f"{text}\n\n\nmain(stepper, version)\n",
    }
