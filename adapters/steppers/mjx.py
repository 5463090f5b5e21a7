"""MJX as a stepper of free motion: `mjx.step` of model.xml in float64, compiled for the CPU."""

import os
from importlib import import_module
from importlib.metadata import version as version_of
from typing import Any

from .stepper_mjcf import body_states, loaded


def version() -> str:
    """Return the version of MJX."""
    os.environ["JAX_PLATFORMS"] = "cpu"
    import_module("mujoco.mjx")
    import_module("jax").config.update("jax_enable_x64", True)
    return version_of("mujoco-mjx")


def stepper(model: Any, settings: Any, effort: Any, times: Any) -> Any:
    """Return functions to advance to a sample, and to read the bodies' states there."""
    mjx, jax = import_module("mujoco.mjx"), import_module("jax")
    m, seen = loaded(model, settings, effort)
    device = mjx.put_model(m)
    d = mjx.put_data(m, seen)

    def step(_: Any, at: Any) -> Any:
        return mjx.step(device, at)

    def several(d: Any) -> Any:
        return jax.lax.fori_loop(0, effort["steps"], step, d)

    compiled = jax.jit(several).lower(d).compile()

    def advance(sample: int) -> None:
        nonlocal d
        d = jax.block_until_ready(compiled(d))

    def states(sample: int) -> Any:
        return body_states(m, seen, model, d.qpos, d.qvel)

    return advance, states
