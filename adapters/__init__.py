"""Adapters: one package or file per engine and format, which translates the neutral mechanism. An
adapter is imported at its first use.
"""

import importlib
import json
import re
from collections.abc import Mapping
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

SIMULATIONS: Mapping[str, tuple[str, str, Mapping[str, Any]]] = {
    "mujoco": ("mujoco.steps", "Stepping", {"kind": "stiff", "effort": 4}),
    "mujoco-default": ("mujoco.steps", "Stepping", {"kind": "default", "effort": 1}),
    "mujoco-projecting": ("mujoco.steps", "Stepping", {"kind": "projecting", "effort": 5}),
    "pinocchio": ("pinocchio.pinocchio", "Dynamics", {}),
    "exudyn": ("exudyn.solvers", "Solver", {"kind": "trapezoidal", "steps": 4}),
    "exudyn-alpha": ("exudyn.solvers", "Solver", {"kind": "generalized alpha", "steps": 4}),
    "exudyn-static": ("exudyn.statics", "StaticSolver", {"kind": "static", "modified": False}),
    "exudyn-static-modified": ("exudyn.solvers", "Solver", {"kind": "static"}),
    "drake": ("drake.drake", "Steps", {}),
    "dart": ("dart.dart", "Steps", {}),
    "simbody": ("simbody.assembly", "Assembly", {}),
}
"""Engines in simulate mode: name on the command line -> module, class and fields of the class. A
simulator's bare name is its recommended solver.

A record belongs to a case, an engine and a mode, so one name in two modes denotes two products. A
further variant of a simulator gets another name, not another mode, because each mode is a ranking.
"""


def engine(name: str, mode: str = "projection") -> Any:
    """Return the engine of a name and mode; its simulator is not imported yet."""
    fields: Mapping[str, Any] = {}
    if mode == "projection":
        module, kind = ENGINES[name]
    else:
        module, kind, fields = SIMULATIONS[name]
    maker = getattr(importlib.import_module(f".{module}", __name__), kind)
    return maker(name=name, **fields) if fields else maker()


WRITERS = ("mjcf", "exudyn", "urdf", "sdf", "osim")
"""Formats on the command line; the function `write` of the module writers.NAME writes format NAME.
"""


def writer(name: str) -> Any:
    """Return the function that writes a mechanism in a named format, without a simulator."""
    return importlib.import_module(f".writers.{name}", __name__).write


CONVERTERS = {"mujoco": "mujoco.saved"}
"""Simulators with converters: name on the command line -> module with `convert`."""


def converter(name: str) -> Any:
    """Return the function from a model's file to the text saved by a simulator."""
    return importlib.import_module(f".{CONVERTERS[name]}", __name__).convert


_MUJOCO = "shared/stepper_mjcf.py"
STEPPERS = {
    "mujoco": ("mjcf", _MUJOCO, "mujoco/stepper.py"),
    "pinocchio": ("", "pinocchio/stepper.py"),
    "exudyn": ("", "exudyn/stepper.py"),
    "drake": ("", "drake/stepper.py"),
    "dart": ("", "dart/stepper.py"),
    "simbody": ("", "simbody/stepper.py"),
    "pybullet": ("urdf", "steppers/pybullet.py"),
    "mjx": ("mjcf", _MUJOCO, "steppers/mjx.py"),
    "mujoco-warp": ("mjcf", _MUJOCO, "steppers/warp.py"),
    "newton": ("mjcf", "steppers/newton.py"),
    "genesis": ("mjcf", "steppers/genesis.py"),
}
"""Steppers of free motion, by engine: format of the model that they read, and the parts of a script
without kincheck. Where no format is named, the script builds the model.
"""

APART = {
    "pybullet": "pybullet",
    "mjx": "mujoco-mjx",
    "mujoco-warp": "mujoco-warp",
    "newton": "newton mujoco-warp",
    "genesis": "genesis-world torch",
}
"""Steppers with an environment of their own, by engine: the requirements there."""


def stepper_files(name: str, mechanism: Any, twists: Any) -> dict[str, str]:
    """Return the files of a stepper's reproducer, by name: model.json, the engine's own model file
    if it reads one, and run.py, which needs numpy and the engine alone.

    Args:
        twists: see `shared.stepper_model`.

    Raises:
        UnsupportedError: steppers lack a part of the mechanism.
    """
    stepper_model = importlib.import_module(".shared.stepper_model", __name__).stepper_model
    formats = importlib.import_module(".shared.stepper_formats", __name__).WRITERS
    kind, *parts = STEPPERS[name]
    model, folder = stepper_model(mechanism, twists), Path(__file__).resolve().parent
    files = dict[str, str]()
    if kind:
        file, write = formats[kind]
        model["file"], files[file] = file, write(model)
    texts = [(folder / part).read_text("utf-8") for part in (*parts, "shared/stepper_loop.py")]
    # the parts are one file: they need not import each other
    text = "\n\n".join(
        re.sub(r"^from \.\S* import .*\n", "", each, flags=re.M).rstrip() for each in texts
    )
    return {
        **files,
        "model.json": json.dumps(model, indent=1) + "\n",
        "run.py": f"{text}\n\n\nmain(stepper, version)\n",
    }
