"""Scripts of the steppers: a reproducer of each engine, which needs numpy and the engine alone."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .stepper_formats import WRITERS
from .stepper_model import stepper_model


@dataclass(frozen=True)
class Stepper:
    """A stepper of free motion.

    Attributes:
        parts: the parts of its script, files of this folder.
        model: format of the model it reads; without one, the script builds the model.
        apart: requirements of an engine with an environment of its own.
    """

    parts: Sequence[str]
    model: str = ""
    apart: str = ""

    def files(self, mechanism: Any, twists: Any) -> dict[str, str]:
        """Return the files of a reproducer, by name: model.json, the engine's own model file if it
        reads one, and run.py.

        Args:
            twists: see `stepper_model`.

        Raises:
            UnsupportedError: steppers lack a part of the mechanism.
        """
        model, folder = stepper_model(mechanism, twists), Path(__file__).resolve().parent
        files = dict[str, str]()
        if self.model:
            file, write = WRITERS[self.model]
            model["file"], files[file] = file, write(model)
        texts = [(folder / part).read_text("utf-8") for part in (*self.parts, "stepper_loop.py")]
        # the parts are one file: they need not import each other
        text = "\n\n".join(
            re.sub(r"^from \.\S* import .*\n", "", each, flags=re.M).rstrip() for each in texts
        )
        return {
            **files,
            "model.json": json.dumps(model, indent=1) + "\n",
            "run.py": f"{text}\n\n\nmain(stepper, version)\n",
        }


_MUJOCO = "stepper_mjcf.py"
mujoco = Stepper([_MUJOCO, "mujoco.py"], "mjcf")
pinocchio = Stepper(["pinocchio.py"])
exudyn = Stepper(["exudyn.py"])
drake = Stepper(["drake.py"])
dart = Stepper(["dart.py"])
simbody = Stepper(["simbody.py"])
pybullet = Stepper(["pybullet.py"], "urdf", "pybullet")
mjx = Stepper([_MUJOCO, "mjx.py"], "mjcf", "mujoco-mjx")
mujoco_warp = Stepper([_MUJOCO, "warp.py"], "mjcf", "mujoco-warp")
newton = Stepper(["newton.py"], "mjcf", "newton mujoco-warp")
genesis = Stepper(["genesis.py"], "mjcf", "genesis-world torch")
