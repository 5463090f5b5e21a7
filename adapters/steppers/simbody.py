"""Simbody as a stepper of free motion, by OpenSim's Manager: Runge-Kutta-Merson with steps for an
accuracy, and projection onto the constraints. A point constraint closes each tie.
"""

from importlib import import_module
from typing import Any

import numpy as np

from .stepper_loop import require, state_of


def version() -> str:
    """Return the version of OpenSim."""
    found: Any = import_module("opensim")
    found.Logger.setLevelString("Off")
    return f"OpenSim {found.GetVersion()}"


def stepper(model: Any, settings: Any, effort: Any, times: Any) -> Any:
    """Return functions to advance to a sample, and to read the bodies' states there."""
    o: Any = import_module("opensim")
    require(model, "OpenSim", chains=False)
    made = o.Model()
    joints: list[Any] = []
    bodies, origin = {"ground": made.getGround()}, {"ground": np.zeros(3)}

    def vector(x: Any) -> Any:
        return o.Vec3(*map(float, x))

    made.setGravity(vector(model["gravity"]))

    def turned(axis: Any, onto: int) -> Any:
        """Return the angles of a frame with an axis along a direction."""
        a = np.array(axis) / np.linalg.norm(axis)
        other = np.cross(a, np.eye(3)[np.abs(a).argmin()])
        other = other / np.linalg.norm(other)
        R = np.empty((3, 3))
        R[:, onto], R[:, (onto + 1) % 3] = a, other
        R[:, (onto + 2) % 3] = np.cross(a, other)
        # body-fixed angles about x, y, z
        y = np.arcsin(np.clip(R[0, 2], -1.0, 1.0))
        x, z = np.arctan2(-R[1, 2], R[2, 2]), np.arctan2(-R[0, 1], R[0, 0])
        return vector([x, y, z])

    for number, body in enumerate(model["bodies"]):
        (move,) = body["moves"]
        P, own = np.array(move["point"]), np.array(body["inertia"])
        six = own[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]].tolist()
        child = o.Body(
            f"body_{number}", body["mass"], vector(np.array(body["center"]) - P), o.Inertia(*six)
        )
        made.addBody(child)
        kind, onto = {
            "hinge": ("PinJoint", 2),
            "slide": ("SliderJoint", 0),
            "ball": ("BallJoint", 0),
        }[move["kind"]]
        angles = vector(np.zeros(3)) if kind == "BallJoint" else turned(move["axis"], onto)
        parent = bodies[body["parent"]], vector(P - origin[body["parent"]]), angles
        joint = getattr(o, kind)(f"joint_{number}", *parent, child, vector(np.zeros(3)), angles)
        made.addJoint(joint)
        joints.append(joint)
        bodies[body["name"]], origin[body["name"]] = child, P

    def ends(each: Any) -> list[Any]:
        return [
            (bodies[name], vector(np.array(point) - origin[name]))
            for name, point in zip(each["bodies"], each["points"], strict=True)
        ]

    for tie in model["ties"]:
        first, second = ends(tie)
        if tie["length"]:
            made.addConstraint(o.ConstantDistanceConstraint(*first, *second, tie["length"]))
        else:
            made.addConstraint(o.PointConstraint(*first, *second))
    for each in model["springs"]:
        (first, start), (second, end) = ends(each)
        paths = first.getAbsolutePathString(), start, second.getAbsolutePathString(), end
        tension = f"{each['stiffness']!r}*(d-{each['free_length']!r})+{each['damping']!r}*ddot"
        made.addForce(o.ExpressionBasedPointToPointForce(*paths, tension))
    for k, load in enumerate(model["loads"]):
        given = o.PrescribedForce(f"load_{k}", bodies[load["body"]])
        given.setPointIsInGlobalFrame(False)
        given.setForceIsInGlobalFrame(True)
        at = np.array(load["point"]) - origin[load["body"]]
        constants = [
            [o.Constant(float(x)) for x in each] for each in (load["force"], load["torque"], at)
        ]
        for function, each in zip(
            ("setForceFunctions", "setTorqueFunctions", "setPointFunctions"), constants, strict=True
        ):
            getattr(given, function)(*each)
        made.addForce(given)
    made.finalizeConnections()
    state = made.initSystem()
    for joint, body in zip(joints, model["bodies"], strict=True):
        for k, rate in enumerate(body["rates"]):
            joint.get_coordinates(k).setSpeedValue(state, rate)
    manager = o.Manager(made)
    manager.setIntegratorAccuracy(effort["accuracy"])
    state.setTime(0.0)
    manager.initialize(state)

    def advance(sample: int) -> None:
        nonlocal state
        state = manager.integrate(times[sample])

    def states(sample: int) -> Any:
        made.realizeVelocity(state)
        found: Any = {}
        for name, body in bodies.items():
            if name == "ground":
                continue
            pose, twist = body.getTransformInGround(state), body.getVelocityInGround(state)
            rows = pose.R()
            R = np.array([[rows.get(i, j) for j in range(3)] for i in range(3)])
            w, v = (twist.get(k).to_numpy() for k in range(2))
            found[name] = state_of(origin[name], pose.p().to_numpy(), R, w, v)
        return found

    def reactions(sample: int) -> Any:
        made.realizeAcceleration(state)
        found: Any = {}
        for joint, body in zip(joints, model["bodies"], strict=True):
            force = joint.calcReactionOnChildExpressedInGround(state).get(1).to_numpy()
            found[body["joint"]] = force if body["second"] else -force
        return found

    return advance, states, reactions
