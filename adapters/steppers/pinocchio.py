"""Pinocchio as a stepper of free motion: `constraintDynamics`, with steps of the classical
Runge-Kutta method here, in Python. One rigid constraint of a point closes each tie.
"""

from importlib import import_module
from typing import Any

import numpy as np

from .stepper_loop import loads, require, state_of


def version() -> str:
    """Return the version of Pinocchio."""
    found: Any = import_module("pinocchio")
    if not hasattr(found, "Model"):
        raise ImportError("another package is named pinocchio; Pinocchio's is pin")
    return str(found.__version__)


def stepper(model: Any, settings: Any, effort: Any, times: Any) -> Any:
    """Return functions to advance to a sample, and to read the bodies' states there."""
    pin: Any = import_module("pinocchio")
    require(model, "Pinocchio", rods=False)
    m, at, origin = pin.Model(), {"ground": 0}, {"ground": np.zeros(3)}
    m.gravity.linear = np.array(model["gravity"])
    kinds = {
        "hinge": pin.JointModelRevoluteUnaligned,
        "slide": pin.JointModelPrismaticUnaligned,
        "ball": pin.JointModelSpherical,
    }
    for body in model["bodies"]:
        parent, before = at[body["parent"]], origin[body["parent"]]
        for k, move in enumerate(body["moves"]):
            given = () if move["kind"] == "ball" else (np.array(move["axis"]),)
            parent = m.addJoint(
                parent,
                kinds[move["kind"]](*given),
                pin.SE3(np.eye(3), np.array(move["point"]) - before),
                f"{body['name']} {k}",
            )
            before = np.array(move["point"])
        at[body["name"]], origin[body["name"]] = parent, before
        c, I = np.array(body["center"]), np.array(body["inertia"])  # noqa: E741
        m.appendBodyToJoint(parent, pin.Inertia(body["mass"], c - before, I), pin.SE3.Identity())
    ties, data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for tie in model["ties"]:
        ends: list[Any] = []
        for body, P in zip(tie["bodies"], tie["points"], strict=True):
            ends += [at[body], pin.SE3(np.eye(3), np.array(P) - origin[body])]
        kind = pin.ContactType.CONTACT_3D, m, *ends, pin.ReferenceFrame.LOCAL
        made = pin.RigidConstraintModel(*kind)
        if "decay" in settings:
            closing = 1.0 / (settings["decay"] * effort["step"])
            made.m_baumgarte_parameters.Kp = closing**2
            made.m_baumgarte_parameters.Kd = 2.0 * closing
        ties.append(made)
    for each in ties:
        data.append(each.createData())
    d, seen = m.createData(), m.createData()
    pin.initConstraintDynamics(m, d, ties, data)
    proximal = pin.ProximalSettings()
    if "mu" in settings:
        accuracy = settings["accuracy"]
        proximal = pin.ProximalSettings(accuracy, accuracy, settings["mu"], settings["rounds"])
    q, v = pin.neutral(m), np.concatenate([body["rates"] for body in model["bodies"]])
    loaded = bool(model["springs"] or model["loads"])

    def read(q: Any, v: Any) -> Any:
        pin.forwardKinematics(m, seen, q, v)
        found: Any = {}
        for body in model["bodies"]:
            name = body["name"]
            pose = seen.oMi[at[name]].copy()
            twist = pin.getVelocity(m, seen, at[name], pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            turning = pose.rotation, twist.angular.copy()
            found[name] = state_of(origin[name], pose.translation, *turning, twist.linear)
        return found

    def forces(q: Any, v: Any) -> Any:
        tau = np.zeros(m.nv)
        if not loaded:
            return tau
        states = read(q, v)
        pin.computeJointJacobians(m, seen, q)
        for body, point, force, torque in loads(model, states):
            k = at[body]
            J = pin.getJointJacobian(m, seen, k, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
            moment = torque + np.cross(point - seen.oMi[k].translation, force)
            tau += J.reshape(6, -1).T @ np.concatenate([force, moment])
        return tau

    def rate(q: Any, v: Any) -> Any:
        return np.array(pin.constraintDynamics(m, d, q, v, forces(q, v), ties, data, proximal))

    def step(h: float) -> None:
        nonlocal q, v
        a1 = rate(q, v)
        v2 = v + 0.5 * h * a1
        a2 = rate(pin.integrate(m, q, 0.5 * h * v), v2)
        v3 = v + 0.5 * h * a2
        a3 = rate(pin.integrate(m, q, 0.5 * h * v2), v3)
        v4 = v + h * a3
        a4 = rate(pin.integrate(m, q, h * v3), v4)
        q = pin.integrate(m, q, h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4))
        v = v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)

    def advance(sample: int) -> None:
        for _ in range(effort["steps"]):
            step(effort["step"])

    def states(sample: int) -> Any:
        return read(q, v)

    def reactions(sample: int) -> Any:
        rate(q, v)
        found: Any = {}
        for tie, model_of, each in zip(model["ties"], ties, data, strict=True):
            R = d.oMi[model_of.joint1_id].rotation
            found[tie["joint"]] = found.get(tie["joint"], 0.0) - R @ each.contact_force.linear
        return found

    return advance, states, reactions
