"""MuJoCo's own numbers, without kincheck.

python probe.py --read              inertias and limits of a file, compiled
python probe.py --model             this file
python probe.py MODEL.xml OUT.npz   all fields of model and data at one state
"""

from __future__ import annotations

import json
import sys
from importlib import import_module
from typing import Any

import numpy as np

BODIES = 40
ROUND_OFF = 1e-12
"""Of an inertia's size: a thousand times what an eigenvalue solver leaves."""

MODEL = """qpos0 body_pos body_quat body_ipos body_iquat body_mass body_subtreemass body_inertia
jnt_pos jnt_axis jnt_range dof_armature dof_damping eq_data eq_solref eq_solimp body_invweight0
dof_invweight0 tendon_length0 tendon_invweight0 dof_M0 stat"""
DATA = """qpos qvel act ctrl xpos xquat xmat xipos ximat xanchor xaxis geom_xpos geom_xmat site_xpos
site_xmat subtree_com cdof cinert crb ten_length ten_J actuator_length actuator_moment qM M qLD
qLDiagInv ncon nefc efc_type efc_id efc_J efc_pos efc_margin efc_frictionloss efc_diagApprox
efc_KBIP efc_D efc_R ten_velocity actuator_velocity cvel cdof_dot qfrc_bias qfrc_spring
qfrc_damper qfrc_passive efc_vel efc_aref actuator_force qfrc_actuator qfrc_smooth qacc_smooth
efc_b efc_AR efc_force efc_state qfrc_constraint qacc cacc cfrc_int cfrc_ext sensordata"""
"""Fields in the order in which MuJoCo computes them; others follow."""
TIMES = {"timer", "signature", "solver", "warning", "time", "maxuse_arena", "narena", "nbuffer"}


def inertias() -> Any:
    """Return symmetric positive definite tensors of moving masses, shape (BODIES, 3, 3)."""
    places = np.random.default_rng(1).normal(size=(BODIES, 8, 3))
    places[: BODIES // 4, :, 2] *= 1e-3  # nearly plane
    squares = np.einsum("bni,bnj->bij", places, places)
    return np.einsum("bii->b", squares)[:, None, None] * np.eye(3) - squares


def limits() -> Any:
    """Return limits of angles [degrees], shape (BODIES, 2)."""
    return np.sort(np.random.default_rng(2).uniform(-170.0, 170.0, (BODIES, 2)))


def model() -> str:
    """Return the file with the inertias and limits, each number with all its digits."""
    bodies = [
        f'<body name="b{k}"><joint type="hinge" limited="true" range="{low!r} {high!r}"/>'
        '<inertial pos="0 0 0" mass="1" fullinertia="'
        + " ".join(repr(float(m[i, j])) for i, j in SIX)
        + '"/></body>'
        for k, (m, (low, high)) in enumerate(zip(inertias(), limits().tolist(), strict=True))
    ]
    lines = "\n".join(bodies)
    return f"<mujoco><worldbody>\n{lines}\n</worldbody></mujoco>\n"


SIX = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def read() -> dict[str, Any]:
    """Return, by name, MuJoCo's numbers, those of the file, and the largest accepted difference."""
    mujoco: Any = import_module("mujoco")
    m, truth = mujoco.MjModel.from_xml_string(model()), inertias()
    found: list[Any] = []
    for k in range(BODIES):
        turned = np.zeros(9)
        mujoco.mju_quat2Mat(turned, m.body_iquat[k + 1])
        axes = turned.reshape(3, 3)
        found.append(axes @ np.diag(m.body_inertia[k + 1]) @ axes.T)
    scale = np.abs(truth).max(axis=(1, 2))[:, None, None]
    given, made = ((np.array(each) / scale).ravel().tolist() for each in (truth, found))
    return {
        "inertia": [made, given, ROUND_OFF],
        "limit": [m.jnt_range.ravel().tolist(), np.radians(limits()).ravel().tolist(), ROUND_OFF],
    }


def fields(file: str) -> dict[str, Any]:
    """Return the fields of model and data of a file at its first keyframe, with velocities."""
    mujoco: Any = import_module("mujoco")
    m = mujoco.MjModel.from_xml_path(file)
    d = mujoco.MjData(m)
    if m.nkey:
        mujoco.mj_resetDataKeyframe(m, d, 0)
    d.qvel[:] = np.linspace(0.5, 1.0, m.nv)
    mujoco.mj_forward(m, d)
    found: dict[str, Any] = {}
    for part, order in ((m, MODEL), (d, DATA)):
        others = [each for each in dir(part) if not each.startswith("_") and each not in TIMES]
        for name in dict.fromkeys([*order.split(), *others]):
            try:
                values = np.asarray(getattr(part, name, None), dtype=float)
            except (TypeError, ValueError):
                continue
            # which constraints form an island is not a number of the motion
            if values.size and np.isfinite(values).any() and "island" not in name:
                found[name] = values
    rates = np.zeros((m.nbody, 6, m.nv))
    for body, rows in enumerate(rates):
        mujoco.mj_jacDot(m, d, rows[:3], rows[3:], d.xipos[body], body)
    return {**found, "mj_jacDot": rates}


def main(first: str, out: str = "") -> None:
    """Do the work of the command line."""
    if first == "--read":
        print(json.dumps(read()))
    elif first == "--model":
        print(model(), end="")
    else:
        np.savez(out, **fields(first))


if __name__ == "__main__":
    main(*sys.argv[1:])
