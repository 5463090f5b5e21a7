"""MuJoCo's part of the steppers that read its model: settings, start, and states of bodies."""

from importlib import import_module
from typing import Any

import numpy as np


def loaded(model: Any, settings: Any, effort: Any) -> tuple[Any, Any]:
    """Return MuJoCo's model from its file, with the settings, and its data at the start."""
    mujoco: Any = import_module("mujoco")
    m = mujoco.MjModel.from_xml_path(model["file"])
    m.opt.timestep = effort["step"]
    m.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{settings['integrator'].upper()}")
    m.opt.iterations = settings.get("iterations", m.opt.iterations)
    m.opt.tolerance = settings.get("tolerance", m.opt.tolerance)
    if "time_constant" in settings:
        m.eq_solref[:] = settings["time_constant"] * effort["step"], 1.0
        m.eq_solimp[:] = settings["impedance"]
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, 0)
    for load in model["loads"]:
        arm = np.array(load["point"]) - np.array(m.body(load["body"]).ipos)
        if np.any(load["force"]) and arm.any():
            raise NotImplementedError("a force off the centre of mass is no constant of MuJoCo")
        d.xfrc_applied[m.body(load["body"]).id] += [*load["force"], *load["torque"]]
    return m, d


def body_states(m: Any, seen: Any, model: Any, qpos: Any, qvel: Any) -> Any:
    """Return the states of the bodies at positions and velocities, which the data then has."""
    mujoco: Any = import_module("mujoco")
    seen.qpos[:], seen.qvel[:] = qpos, qvel
    mujoco.mj_fwdPosition(m, seen)
    mujoco.mj_fwdVelocity(m, seen)
    found: Any = {}
    twist = np.zeros(6)
    for body in model["bodies"]:
        k = m.body(body["name"]).id
        mujoco.mj_objectVelocity(m, seen, mujoco.mjtObj.mjOBJ_XBODY, k, twist, 0)
        R = np.array(seen.xmat[k]).reshape(3, 3)
        found[body["name"]] = np.array(seen.xpos[k]), R, twist[:3].copy(), twist[3:].copy()
    return found


def tie_forces(m: Any, seen: Any, model: Any) -> Any:
    """Return the forces of joints that close loops, first body on second, at the data's state."""
    import_module("mujoco").mj_forward(m, seen)
    found: Any = {}
    for k, tie in enumerate(model["ties"]):
        force = seen.efc_force[: seen.ne][seen.efc_id[: seen.ne] == k]
        if tie["length"]:
            P, Q = (seen.site(f"tie {k}.{end}").xpos for end in range(2))
            force = -force * (Q - P) / np.linalg.norm(Q - P)
        found[tie["joint"]] = found.get(tie["joint"], 0.0) - force
    return found
