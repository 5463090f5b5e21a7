"""DART as a stepper of free motion: `World.step`, semi-implicit Euler, with a ball constraint for
each tie. The loop over the steps is in Python, because forces last one step.
"""

from importlib import import_module
from typing import Any

import numpy as np

from .stepper_loop import loads, require, state_of


def version() -> str:
    """Return the version of DART."""
    return str(import_module("dartpy").__version__)


def stepper(model: Any, settings: Any, effort: Any, times: Any) -> Any:
    """Return functions to advance to a sample, and to read the bodies' states there."""
    dart: Any = import_module("dartpy")
    require(model, "DART", chains=False, rods=False)
    parts, skeleton = dart.dynamics, dart.dynamics.Skeleton("mechanism")
    nodes: dict[str, Any] = {"ground": None}
    origin = {"ground": np.zeros(3)}

    def placed(offset: Any) -> Any:
        found = dart.math.Isometry3()
        found.set_translation(offset)
        return found

    for body in model["bodies"]:
        node, before = nodes[body["parent"]], origin[body["parent"]]
        (move,) = body["moves"]
        kind = {"hinge": "Revolute", "slide": "Prismatic", "ball": "Ball"}[move["kind"]]
        given = getattr(parts, f"{kind}JointProperties")()
        P = np.array(move["point"])
        given.mName, given.mT_ParentBodyToJoint = body["name"], placed(P - before)
        if kind != "Ball":
            given.mAxis = np.array(move["axis"])
        _, node = getattr(skeleton, f"create{kind}JointAndBodyNodePair")(node, given)
        inertia = np.array(body["inertia"])
        node.setInertia(parts.Inertia(body["mass"], np.array(body["center"]) - P, inertia))
        nodes[body["name"]], origin[body["name"]] = node, P
    world = dart.simulation.World()
    world.setGravity(np.array(model["gravity"]))
    world.setTimeStep(effort["step"])
    world.addSkeleton(skeleton)
    skeleton.setVelocities(np.concatenate([body["rates"] for body in model["bodies"]]))
    for tie in model["ties"]:
        ends = [nodes[name] for name in tie["bodies"] if name != "ground"]
        made = dart.constraint.BallJointConstraint(*ends, np.array(tie["points"][0]))
        if "error_reduction" in settings:
            made.setErrorReductionParameter(settings["error_reduction"])
            made.setMaxErrorReductionVelocity(settings["fastest"])
        world.getConstraintSolver().addConstraint(made)
    loaded = bool(model["springs"] or model["loads"])

    def states(sample: int) -> Any:
        found: Any = {}
        for name, node in nodes.items():
            if node is None:
                continue
            pose = node.getWorldTransform()
            turning = pose.rotation(), node.getAngularVelocity()
            at = origin[name], pose.translation()
            found[name] = state_of(*at, *turning, node.getLinearVelocity())
        return found

    def advance(sample: int) -> None:
        for _ in range(effort["steps"]):
            if loaded:
                now = states(sample)
                for name, point, force, torque in loads(model, now):
                    x, R, _, _ = now[name]
                    nodes[name].addExtForce(force, R.T @ (point - x) - origin[name])
                    nodes[name].addExtTorque(torque, False)
            world.step(True)

    return advance, states
