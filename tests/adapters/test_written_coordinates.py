"""Coordinates of written models: driven in the file's own simulator, each joint moves as the joint
of the case does, with its name, sense and zero, whichever body the tree hangs on the other.
"""

import importlib
from dataclasses import replace

import numpy as np
import pytest
from kincheck import adapters
from kincheck.core import (
    Body,
    Cylindrical,
    JointAngle,
    JointDisplacement,
    Mechanism,
    Planar,
    Revolute,
    Screw,
    Translational,
    Universal,
)
from kincheck.core.case.case import Case, Sweep, Truth
from kincheck.core.case.io.model_writer import written

P, Q = (0.3, -0.2, 0.5), (0.1, 0.7, -0.4)
Z, AXIS, ACROSS = (0.0, 0.0, 1.0), (2.0, -1.0, 2.0), (1.0, 2.0, 0.0)
# Round-off of some ten products of numbers of about one.
EXACT = 1e-14
WHERE = {"base": 0.4}


def turn(axis, angle, point):
    """The displacement by a turn, as a matrix of homogeneous coordinates (Rodrigues)."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    T = np.eye(4)
    T[:3, :3] += np.sin(angle) * K + (1 - np.cos(angle)) * K @ K
    T[:3, 3] = np.array(point) - T[:3, :3] @ point
    return T


def shift(axis, distance):
    T = np.eye(4)
    T[:3, 3] = distance * np.array(axis) / np.linalg.norm(axis)
    return T


ALONG = {"joint.translation": 0.3, "joint.rotation": -0.7}
JOINTS = {
    "revolute": (
        lambda i, j: Revolute("joint", i, j, P, AXIS),
        {"joint": 0.7},
        turn(AXIS, 0.7, P),
    ),
    "translational": (
        lambda i, j: Translational("joint", i, j, P, AXIS),
        {"joint": 0.3},
        shift(AXIS, 0.3),
    ),
    "cylindrical": (
        lambda i, j: Cylindrical("joint", i, j, P, AXIS),
        ALONG,
        shift(AXIS, 0.3) @ turn(AXIS, -0.7, P),
    ),
    "screw": (
        lambda i, j: Screw("joint", i, j, P, AXIS, -0.6 * np.pi / 0.7),
        ALONG,
        shift(AXIS, 0.3) @ turn(AXIS, -0.7, P),
    ),
    "universal": (
        lambda i, j: Universal("joint", i, j, P, (AXIS, ACROSS)),
        {"joint.hinge1": 0.5, "joint.hinge2": -0.4},
        turn(AXIS, 0.5, P) @ turn(ACROSS, -0.4, P),
    ),
    "planar": (
        lambda i, j: Planar("joint", i, j, P, AXIS),
        {"joint.rotation": 0.7},
        turn(AXIS, 0.7, P),
    ),
}


def case(kind, swapped, carried):
    """A body on the ground, or on a body that turns on it; first or second in its joint."""
    build, _, _ = JOINTS[kind]
    bodies = [Body("arm", Q, (0.5, 0.5, -0.5, 0.5), mass=1.0, inertia=(1, 1, 1, 0, 0, 0))]
    joints, other = [], "ground"
    if carried:
        other = "carrier"
        bodies.append(Body("carrier", P, mass=2.0, inertia=(1, 2, 2, 0, 0, 0)))
        joints.append(Revolute("base", "ground", "carrier", Q, Z))
    joints.append(build(*(("arm", other) if swapped else (other, "arm"))))
    mechanism = Mechanism("driven", bodies, joints, [], [])
    sweep = Sweep("time", np.array([0.0, 1.0]))
    return Case("driven", "made up", Truth.CONSENSUS_ONLY, mechanism, sweep, ())


def mujoco(texts, values, folder):
    mj = importlib.import_module("mujoco")
    model = mj.MjModel.from_xml_string(texts[".xml"])
    data = mj.MjData(model)
    for name, value in values.items():
        data.joint(name).qpos[:] = value
    mj.mj_kinematics(model, data)
    return data.body("arm").xpos, data.body("arm").xmat.reshape(3, 3)


def pinocchio(texts, values, folder):
    pin = importlib.import_module("pinocchio")
    model = pin.buildModelFromXML(texts[".urdf"])
    data, q = model.createData(), pin.neutral(model)
    for name, value in values.items():
        q[model.idx_qs[model.getJointId(name)]] = value
    pin.framesForwardKinematics(model, data, q)
    place = data.oMf[model.getFrameId("arm", pin.FrameType.BODY)]
    return of_link(place.homogeneous)


def of_link(place):
    """The body's pose from that of its link, which is at its joint and parallel to the ground."""
    pose = np.array(place) @ shift(np.subtract(Q, P), np.linalg.norm(np.subtract(Q, P)))
    return pose[:3, 3], pose[:3, :3] @ TURNED


def dart(texts, values, folder):
    dartpy = importlib.import_module("dartpy")
    (file := folder / "model.urdf").write_text(texts[".urdf"])
    loaders = getattr(dartpy, "io", None) or dartpy.utils
    skeleton = loaders.DartLoader().parseSkeleton(str(file))
    for name, value in values.items():
        skeleton.getJoint(name).setPosition(0, value)
    return of_link(skeleton.getBodyNode("arm").getWorldTransform().matrix())


def drake(texts, values, folder):
    plants = importlib.import_module("pydrake.multibody.plant")
    plant = plants.MultibodyPlant(1e-3)
    parsing = importlib.import_module("pydrake.multibody.parsing")
    parsing.Parser(plant).AddModelsFromString(texts[".sdf"], "sdf")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    for name, value in values.items():
        joint = plant.GetJointByName(name)
        (joint.set_angle if joint.type_name() == "revolute" else joint.set_translation)(
            context, value
        )
    pose = plant.GetFrameByName("arm").CalcPoseInWorld(context)
    return pose.translation(), pose.rotation().matrix()


def simbody(texts, values, folder):
    o = importlib.import_module("opensim")
    o.Logger.setLevelString("Off")
    (file := folder / "model.osim").write_text(texts[".osim"])
    model = o.Model(str(file))
    state = model.initSystem()
    for name, value in values.items():
        model.getCoordinateSet().get(name).setValue(state, value, False)
    model.realizePosition(state)
    place = model.getBodySet().get("arm").getTransformInGround(state)
    R = np.array([[place.R().get(i, k) for k in range(3)] for i in range(3)])
    return place.p().to_numpy(), R


# x -> y -> z -> x, by the Euler parameters of the arm
TURNED = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
SIMULATORS = {
    "mjcf": ("mujoco", mujoco),
    "urdf": ("pinocchio", pinocchio),
    "urdf in dart": ("dartpy", dart),
    "sdf": ("pydrake", drake),
    "osim": ("opensim", simbody),
}


@pytest.mark.parametrize("carried", [False, True], ids=["on ground", "on a moving body"])
@pytest.mark.parametrize("swapped", [False, True], ids=["second", "first"])
@pytest.mark.parametrize("kind", JOINTS)
@pytest.mark.parametrize("to", SIMULATORS)
def test_written_joint_is_driven_as_in_case(to, kind, swapped, carried, tmp_path):
    name, read = SIMULATORS[to]
    pytest.importorskip(name, reason=f"{name} is not installed")
    _, values, moved = JOINTS[kind]
    texts = written(case(kind, swapped, carried), adapters.writer(to.split()[0]))
    if carried:
        values = values | WHERE
    at, axes = read(texts, values, tmp_path)
    T = np.linalg.inv(moved) if swapped else moved
    if carried:
        T = turn(Z, WHERE["base"], Q) @ T
    np.testing.assert_allclose(at, T[:3, :3] @ Q + T[:3, 3], rtol=0, atol=EXACT)
    np.testing.assert_allclose(axes, T[:3, :3] @ TURNED, rtol=0, atol=EXACT)


STARTS = {"revolute": {"joint": 0.7}, "translational": {"joint": -0.3}}


@pytest.mark.parametrize("swapped", [False, True], ids=["second", "first"])
@pytest.mark.parametrize("kind", STARTS)
@pytest.mark.parametrize("to", ["mjcf", "osim"])
def test_start_elsewhere_keeps_the_zeros(to, kind, swapped, tmp_path):
    """Driven to zero, the model is in the design pose; driven on, where the case is."""
    name, read = SIMULATORS[to]
    pytest.importorskip(name, reason=f"{name} is not installed")
    driver = JointAngle if kind == "revolute" else JointDisplacement
    still = case(kind, swapped, carried=False)
    mechanism = replace(still.mechanism, drivers=[driver("drive", "joint")])
    driven = replace(still, mechanism=mechanism, sweep=Sweep("drive", np.array([0.0, 0.7])))
    (start,) = STARTS[kind].values()
    texts = written(driven, adapters.writer(to), start)
    _, values, moved = JOINTS[kind]
    at, axes = read(texts, {"joint": 0.0}, tmp_path)
    np.testing.assert_allclose(at, Q, rtol=0, atol=EXACT)
    np.testing.assert_allclose(axes, TURNED, rtol=0, atol=EXACT)
    T = np.linalg.inv(moved) if swapped else moved
    at, _ = read(texts, values, tmp_path)
    np.testing.assert_allclose(at, T[:3, :3] @ Q + T[:3, 3], rtol=0, atol=EXACT)
