"""PyBullet as a stepper of free motion: `stepSimulation` of model.urdf, with a point-to-point
constraint for each tie.
"""

from importlib import import_module
from importlib.metadata import version as version_of
from typing import Any

import numpy as np

from .stepper_loop import loads, require, state_of


def version() -> str:
    """Return the version of PyBullet."""
    import_module("pybullet")
    return version_of("pybullet")


def stepper(model: Any, settings: Any, effort: Any, times: Any) -> Any:
    """Return functions to advance to a sample, and to read the bodies' states there."""
    pb: Any = import_module("pybullet")
    require(model, "PyBullet", chains=False, rods=False)
    if pb.isConnected():
        pb.disconnect()
    pb.connect(pb.DIRECT)
    pb.setGravity(*model["gravity"])
    pb.setTimeStep(effort["step"])
    if "iterations" in settings:
        names = {"numSolverIterations": settings["iterations"], "solverResidualThreshold": 0.0}
        pb.setPhysicsEngineParameter(**names)
    robot = pb.loadURDF(model["file"], useFixedBase=True, flags=pb.URDF_USE_INERTIA_FROM_FILE)
    links = {pb.getJointInfo(robot, k)[12].decode(): k for k in range(pb.getNumJoints(robot))}
    for link in (-1, *links.values()):
        pb.changeDynamics(robot, link, linearDamping=0, angularDamping=0, maxJointVelocity=1e9)
    for body in model["bodies"]:
        link, ball = links[body["name"]], body["moves"][0]["kind"] == "ball"
        pb.changeDynamics(robot, link, jointDamping=0)
        if ball:  # without the motor that holds a joint
            pb.setJointMotorControlMultiDof(
                robot,
                link,
                pb.POSITION_CONTROL,
                [0, 0, 0, 1],
                positionGain=0,
                velocityGain=0,
                force=[0, 0, 0],
            )
            pb.resetJointStateMultiDof(robot, link, [0, 0, 0, 1], body["rates"])
        else:
            pb.setJointMotorControl2(robot, link, pb.VELOCITY_CONTROL, force=0)
            pb.resetJointState(robot, link, 0.0, *body["rates"])
    center = {body["name"]: np.array(body["center"]) for body in model["bodies"]}
    turn: Any = {"ground": np.eye(3)}
    for name, link in links.items():
        q = pb.getLinkState(robot, link, computeForwardKinematics=1)[1]
        turn[name] = np.array(pb.getMatrixFromQuaternion(q)).reshape(3, 3)
    made = list[Any]()
    for tie in model["ties"]:
        ends = list[Any]()
        for name, point in zip(tie["bodies"], tie["points"], strict=True):
            arm = np.array(point) - center.get(name, np.zeros(3))
            ends.append((links.get(name, -1), (turn[name].T @ arm).tolist()))
        (one, first), (two, second) = ends
        ends = robot, one, robot, two, pb.JOINT_POINT2POINT, [0, 0, 0], first, second
        made.append(pb.createConstraint(*ends))
        pb.changeConstraint(made[-1], maxForce=1e9)

    def states(sample: int) -> Any:
        found: Any = {}
        for name, link in links.items():
            state = pb.getLinkState(robot, link, 1, 1)
            R = np.array(pb.getMatrixFromQuaternion(state[5])).reshape(3, 3)
            x, v, w = (np.array(state[k]) for k in (0, 6, 7))
            found[name] = state_of(center[name], x, R, w, v)
        return found

    def advance(sample: int) -> None:
        for _ in range(effort["steps"]):
            if model["springs"] or model["loads"]:
                now = states(sample)
                for name, point, force, torque in loads(model, now):
                    link = links[name]
                    pb.applyExternalForce(robot, link, force, point, pb.WORLD_FRAME)
                    pb.applyExternalTorque(robot, link, torque, pb.WORLD_FRAME)
            pb.stepSimulation()

    def reactions(sample: int) -> Any:
        # impulses of the last step over its time, on the second body: Bullet's rows are the first
        # body's velocity less the second's, times -1
        found: Any = {}
        for tie, each in zip(model["ties"], made, strict=True):
            force = np.array(pb.getConstraintState(each))
            found[tie["joint"]] = found.get(tie["joint"], 0.0) + force
        return found if sample else {}

    return advance, states, reactions
