"""MuJoCo Warp as a stepper of free motion: `step` of model.xml in float32, on the CPU."""

from importlib import import_module
from importlib.metadata import version as version_of
from typing import Any

from .stepper_mjcf import body_states, loaded


def version() -> str:
    """Return the version of MuJoCo Warp."""
    import_module("warp").config.quiet = True
    import_module("mujoco_warp")
    return version_of("mujoco-warp")


def stepper(model: Any, settings: Any, effort: Any, times: Any) -> Any:
    """Return functions to advance to a sample, and to read the bodies' states there."""
    mujoco: Any = import_module("mujoco")
    warp, engine = import_module("warp"), import_module("mujoco_warp")
    m, seen = loaded(model, settings, effort)
    mujoco.mj_forward(m, seen)
    with warp.ScopedDevice("cpu"):
        device = engine.put_model(m)
        engine.step(device, engine.put_data(m, seen))  # it compiles
        d = engine.put_data(m, seen)

    def advance(sample: int) -> None:
        with warp.ScopedDevice("cpu"):
            for _ in range(effort["steps"]):
                engine.step(device, d)

    def states(sample: int) -> Any:
        return body_states(m, seen, model, d.qpos.numpy()[0], d.qvel.numpy()[0])

    return advance, states
