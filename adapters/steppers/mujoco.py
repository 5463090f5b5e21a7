"""MuJoCo as a stepper of free motion: `mj_step` of model.xml, its loops closed by connects."""

from importlib import import_module
from typing import Any

from .stepper_mjcf import body_states, loaded, tie_forces


def version() -> str:
    """Return the version of MuJoCo."""
    return str(import_module("mujoco").__version__)


def stepper(model: Any, settings: Any, effort: Any, times: Any) -> Any:
    """Return functions to advance to a sample, and to read the bodies' states there."""
    mujoco: Any = import_module("mujoco")
    m, d = loaded(model, settings, effort)
    # otherwise a diverged motion would start again from the design
    m.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    seen = mujoco.MjData(m)
    seen.xfrc_applied[:] = d.xfrc_applied

    def advance(sample: int) -> None:
        mujoco.mj_step(m, d, effort["steps"])

    def states(sample: int) -> Any:
        return body_states(m, seen, model, d.qpos, d.qvel)

    def reactions(sample: int) -> Any:
        return tie_forces(m, seen, model)

    return advance, states, reactions
