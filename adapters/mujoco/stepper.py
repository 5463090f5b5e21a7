"""MuJoCo as a stepper of free motion: `mj_step`, each loop closed by connects between sites."""

from importlib import import_module
from typing import Any

import numpy as np


def version() -> str:
    """Return the version of MuJoCo."""
    return str(import_module("mujoco").__version__)


def stepper(model: Any, settings: Any, effort: Any, times: Any, loads: Any) -> Any:
    """Return the functions that advance to a sample and read the bodies' states there."""
    mujoco: Any = import_module("mujoco")
    spec = mujoco.MjSpec()
    spec.option.gravity, spec.option.timestep = model["gravity"], effort["step"]
    spec.option.integrator = getattr(
        mujoco.mjtIntegrator, f"mjINT_{settings['integrator'].upper()}"
    )
    spec.option.iterations = settings.get("iterations", spec.option.iterations)
    spec.option.tolerance = settings.get("tolerance", spec.option.tolerance)
    # otherwise a diverged motion would start again from the design
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    kinds, bodies, sites = mujoco.mjtJoint, {"ground": spec.worldbody}, 0
    for body in model["bodies"]:
        node = bodies[body["name"]] = bodies[body["parent"]].add_body(name=body["name"])
        I = np.array(body["inertia"])  # noqa: E741
        node.mass, node.ipos, node.explicitinertial = body["mass"], body["center"], True
        node.fullinertia = I[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        for move in body["moves"]:
            kind = getattr(kinds, f"mjJNT_{move['kind'].upper()}")
            node.add_joint(type=kind, pos=move["point"], axis=move["axis"])

    def ends(each: Any) -> list[str]:
        nonlocal sites
        names = [f"site {sites}", f"site {sites + 1}"]
        for name, body, point in zip(names, each["bodies"], each["points"], strict=True):
            bodies[body].add_site(name=name, pos=point)
        sites += 2
        return names

    def tendon(name: str, each: Any) -> Any:
        made = spec.add_tendon(name=name)
        for site in ends(each):
            made.wrap_site(site)
        return made

    soft = {}
    if "time_constant" in settings:
        soft["solref"] = [settings["time_constant"] * effort["step"], 1.0]
        soft["solimp"] = settings["impedance"]
    for k, tie in enumerate(model["ties"]):
        if tie["length"]:
            tendon(f"tie {k}", tie)
            made = spec.add_equality(type=mujoco.mjtEq.mjEQ_TENDON, name1=f"tie {k}", **soft)
            made.data = [0.0] * len(made.data)
        else:
            one, two = ends(tie)
            site, kind = mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtEq.mjEQ_CONNECT
            spec.add_equality(type=kind, name1=one, name2=two, objtype=site, **soft)
    for k, each in enumerate(model["springs"]):
        made = tendon(f"spring {k}", each)
        made.stiffness, made.damping = [each["stiffness"], 0, 0], [each["damping"], 0, 0]
        made.springlength = [each["free_length"]] * 2
    m = spec.compile()
    d, seen = mujoco.MjData(m), mujoco.MjData(m)
    d.qvel[:] = np.concatenate([body["rates"] for body in model["bodies"]])
    numbers = {body["name"]: m.body(body["name"]).id for body in model["bodies"]}
    for load in model["loads"]:
        arm = np.array(load["point"]) - np.array(m.body(load["body"]).ipos)
        if np.any(load["force"]) and arm.any():
            raise NotImplementedError("a force off the centre of mass is no constant of MuJoCo")
        d.xfrc_applied[numbers[load["body"]]] += np.concatenate([load["force"], load["torque"]])

    def advance(sample: int) -> None:
        mujoco.mj_step(m, d, effort["steps"])

    def states(sample: int) -> Any:
        seen.qpos[:], seen.qvel[:] = d.qpos, d.qvel
        mujoco.mj_fwdPosition(m, seen)
        mujoco.mj_fwdVelocity(m, seen)
        found: Any = {}
        twist = np.zeros(6)
        for name, k in numbers.items():
            mujoco.mj_objectVelocity(m, seen, mujoco.mjtObj.mjOBJ_XBODY, k, twist, 0)
            R = np.array(seen.xmat[k]).reshape(3, 3)
            found[name] = np.array(seen.xpos[k]), R, twist[:3].copy(), twist[3:].copy()
        return found

    return advance, states
