"""Written loads and coordinates read again: springs, actuators, limits, frames."""

import importlib
import json
import runpy
from dataclasses import replace

import numpy as np
import pytest
from kincheck import cases
from kincheck.core import (
    Body,
    Cylindrical,
    Mechanism,
    Planar,
    Revolute,
    Screw,
    Translational,
    Universal,
)
from kincheck.core.case.io.reader_options import Supplied
from kincheck.core.case.models.files import load
from kincheck.core.doors import offers
from kincheck.core.extensions.exports.command import writer_of
from kincheck.core.extensions.exports.model_writer import way_to, written
from kincheck.core.mechanism.loads import Bushing, Force, SpringDamper, Torque, TorsionSpringDamper
from kincheck.core.mechanism.mechanism import Point
from kincheck.core.mechanism.motions import JointAngle, JointDisplacement
from scipy.spatial.transform import Rotation

from ...support.engine_motion import motion_case
from ...support.exported import IN_TREES, read
from ...support.loads import six

# The arm: masses [kg] and their places, global at design [m].
pytestmark = pytest.mark.needs("writers", "trees", "osim", "dart")  # they read what is written

MASSES = np.array([0.5, 0.75, 1.25, 0.3])
PLACES = np.array([[0.4, 0.1, 0.0], [0.1, -0.2, 0.3], [0.7, 0.0, -0.1], [0.2, 0.3, 0.2]])
ORIGIN = (0.25, -0.5, 0.125)
TURNED = (0.5, 0.5, -0.5, 0.5)  # its frame, a third of a turn about a diagonal
AXIS, GRAVITY = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.5, -9.80665])
ANGLE = 0.4
HOOK, EYE = np.array([0.5, 0.2, 0.6]), np.array([0.45, 0.1, 0.1])
PUSH = np.array([3.0, 1.0, -2.0])
TWIST = np.array([0.2, 0.9, 0.1])
# Small numbers that stand in for missing inertia are a millionth of the arm's.
STOOD_IN = 1e-5


def cloud(about):
    """Return the inertia of the arm's masses about a point, shape (3, 3)."""
    arms = PLACES - about
    return (MASSES @ (arms**2).sum(axis=1)) * np.eye(3) - (MASSES[:, None] * arms).T @ arms


CENTER = MASSES @ PLACES / MASSES.sum()


def arm(**more):
    about = cloud(CENTER)
    entries = tuple(six(about))
    own = {"mass": float(MASSES.sum()), "center_of_mass": (*CENTER.tolist(),), "inertia": entries}
    return Mechanism(
        "pendulum",
        [Body("arm", ORIGIN, TURNED, **own)],
        [Revolute("pin", "ground", "arm", point=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0))],
        [Point("tip", "arm", (0.7, 0.0, 0.0))],
        [JointAngle("turn", "pin")],
        gravity=(*GRAVITY.tolist(),),
        **more,
    )


SPRINGS = [
    SpringDamper("spring", "ground", "arm", (HOOK, EYE), 250.0, 5.0, 0.375),
    TorsionSpringDamper("clock", "pin", 7.0, 0.25, -0.5),
]
LOADS = [
    Force("push", "arm", EYE, PUSH, "body"),
    Force("pull", "arm", EYE, PUSH),
    Torque("twist", "arm", TWIST, "body"),
]


def rubber(
    law, turning=(10.0, 20.0, 30.0), stiffness=(100.0, 200.0, 300.0), bodies=("ground", "arm")
):
    """Return a bushing of the arm with oblique axes; the first body carries them."""
    axes = ((1.0, 2.0, 1.0), (2.0, -1.0, 0.0))
    sizes = {"stiffness": stiffness, "turning_stiffness": turning, "law": law}
    return Bushing("rubber", *bodies, (0.3, 0.1, -0.2), axes, **sizes)


def energy(each, angle):
    """Return the energy of a bushing on an arm that turns about the axis."""
    if each.i == "arm":  # ground turns the other way
        angle = -angle
    axes, R = np.array(each.triad), Rotation.from_rotvec(angle * AXIS)
    x, turn = axes @ (R.apply(each.point) - each.point), axes @ R.as_matrix() @ axes.T
    angles = Rotation.from_matrix(turn).as_euler("XYZ")
    if each.law != "cardan":
        angles = 2.0 * Rotation.from_matrix(turn).as_quat()[:3]
    return 0.5 * (each.stiffness @ x**2 + each.turning_stiffness @ angles**2)


def twisting(each):
    """Return the torque of a bushing on the arm at the start, by differences of sixth order."""
    weights, h = {3: 1 / 60, 2: -3 / 20, 1: 3 / 4}, 2e-3
    ends = (
        (w, energy(each, ANGLE + k * h) - energy(each, ANGLE - k * h)) for k, w in weights.items()
    )
    return -sum(w * change for w, change in ends) / h


def turned(vector):
    """Return a vector turned about the axis by the angle of the start."""
    return Rotation.from_rotvec(ANGLE * AXIS).apply(vector)


def start(springs, loads, bushing=None, clock=SPRINGS[1]):
    """Return the angular acceleration of the arm at rest [rad/s^2]."""
    torque = np.cross(turned(CENTER), MASSES.sum() * GRAVITY)
    if bushing is not None:
        torque += twisting(bushing) * AXIS
    if springs:
        eye = turned(EYE)
        pull = HOOK - eye
        length = np.linalg.norm(pull)
        torque += np.cross(eye, 250.0 * (length - 0.375) * pull / length)
        torque += -clock.stiffness * (ANGLE + 0.5) * AXIS
    if loads:
        torque += np.cross(turned(EYE), turned(PUSH) + PUSH) + turned(TWIST)
    return torque @ AXIS / (AXIS @ cloud(np.zeros(3)) @ AXIS)


SPEED = 2.0


def slowed(clock=SPRINGS[1]):
    """Return the change of the angular acceleration by the dampers at that speed [rad/s^2]."""
    eye = turned(EYE)
    along = (HOOK - eye) / np.linalg.norm(HOOK - eye)
    arm_of_pull = np.cross(eye, along) @ AXIS
    damping = 5.0 * arm_of_pull**2 + clock.damping
    return -damping * SPEED / (AXIS @ cloud(np.zeros(3)) @ AXIS)


def texts(to, mechanism):
    return writer_of(to)(mechanism, way_to(motion_case(mechanism, [ANGLE]), ANGLE), {})


def started(text):
    """Return MuJoCo's model of a file, and its data at the start."""
    mj = pytest.importorskip("mujoco")
    model = mj.MjModel.from_xml_string(text)
    data = mj.MjData(model)
    mj.mj_resetDataKeyframe(model, data, model.key("start").id)
    mj.mj_forward(model, data)
    return model, data


def test_written_mjcf_loads_accelerate_arm():
    text = texts("mjcf", arm(forces=[*SPRINGS, *LOADS]))[".xml"]
    model, data = started(text)
    assert data.qacc[0] == pytest.approx(start(springs=True, loads=False), rel=STOOD_IN)
    body = data.body("arm")
    axes = body.ximat.reshape(3, 3)
    found = axes @ np.diag(model.body("arm").inertia) @ axes.T
    R = np.column_stack([turned(each) for each in np.eye(3)])
    np.testing.assert_allclose(found, R @ cloud(CENTER) @ R.T, atol=1e-14)
    np.testing.assert_allclose(body.xipos, turned(CENTER), atol=1e-14)
    assert (model.tendon_damping[0], model.dof_damping[0]) == (5.0, 0.25)
    assert "Left out: force 'push' (force), force 'pull' (force), force 'twist' (torque)." in text


@pytest.mark.parametrize("bodies", [("ground", "arm"), ("arm", "ground")])
@pytest.mark.parametrize("law", ["euler_parameters", "cardan"])
def test_written_exudyn_loads_accelerate_arm(tmp_path, law, bodies):
    exu = pytest.importorskip("exudyn")
    exu.config.printToConsole = False
    script = tmp_path / "model.py"
    soft = rubber(law, bodies=bodies)
    found = texts("exudyn", arm(forces=[*SPRINGS, *LOADS, soft]))[".py"]
    script.write_text(found, encoding="utf-8")
    model = runpy.run_path(str(script))
    mbs = model["mbs"]
    settings = exu.SimulationSettings()
    settings.solution.file.write = False  # in the working directory
    static, solver = exu.MainSolverStatic(), exu.MainSolverImplicitSecondOrder()
    assert static.InitializeSolver(mbs, settings)
    static.ComputeNewtonJacobian(mbs, settings)
    n = static.GetODE2size()
    rows = static.GetSystemJacobian()[n:, :n]
    assert solver.InitializeSolver(mbs, settings)
    solver.ComputeMassMatrix(mbs)
    solver.ComputeODE2RHS(mbs)
    M, f = solver.GetSystemMassMatrix()[:n, :n], solver.GetSystemResidual()[:n]
    # one way is free at rest: along it, mass times acceleration is force
    *_, free = np.linalg.svd(rows)
    rank = np.linalg.matrix_rank(rows)
    kept = free[rank:].T
    acceleration = kept @ np.linalg.solve(kept.T @ M @ kept, kept.T @ f)
    node = mbs.GetNode(model["nodes"]["arm"])
    reference = np.array(node["referenceCoordinates"][3:]) + node["initialCoordinates"][3:]
    # p'' = 0.5 G' omega' of a turn about y at rest: e0 = cos, e2 = sin of half the angle
    e0, e2 = reference[0], reference[2]
    found = 2.0 * (e0 * acceleration[5] - e2 * acceleration[3])
    assert found == pytest.approx(start(springs=True, loads=True, bushing=soft), rel=1e-7)
    rigid = mbs.GetObject(model["bodies"]["arm"])
    about = cloud(np.array(ORIGIN))
    expected = [*np.diag(about), about[1, 2], about[0, 2], about[0, 1]]
    np.testing.assert_allclose(rigid["inertia"], expected, atol=1e-14)
    spring, clock = (mbs.GetObject(model["forces"][name]) for name in ("spring", "clock"))
    assert (spring["damping"], clock["damping"]) == (5.0, 0.25)


def test_written_urdf_inertia_accelerates_arm():
    pin = pytest.importorskip("pinocchio")
    found = texts("urdf", arm(forces=[*SPRINGS, *LOADS]))
    model = pin.buildModelFromXML(found[".urdf"])
    model.gravity.linear = GRAVITY
    q = np.array(json.loads(found[".constraints.json"])["start"]["coordinates"]["pin"])
    zero = np.zeros(1)
    acceleration = pin.aba(model, model.createData(), q, zero, zero)
    assert acceleration[0] == pytest.approx(start(springs=False, loads=False), rel=1e-12)
    inertia = model.inertias[1]
    np.testing.assert_allclose(inertia.inertia, cloud(CENTER), atol=1e-14)
    assert "Left out: gravity [1.0, 0.5, -9.80665] m/s^2, force 'clock' (tors" in found[".urdf"]


@pytest.mark.parametrize("bodies", [("ground", "arm"), ("arm", "ground")])
@pytest.mark.parametrize("to", ["sdf", "urdf"])
def test_written_drake_loads_accelerate_arm(to, bodies):
    """URDF has no springs at hinges."""
    plants = pytest.importorskip("pydrake.multibody.plant", reason="drake is not installed")
    still = (0.0, 0.0, 0.0), (200.0, 200.0, 200.0)  # the same in any law
    soft = rubber("cardan", *still, bodies)
    springs = SPRINGS if to == "sdf" else SPRINGS[:1]
    files = texts(to, arm(forces=[*springs, *LOADS, soft]))
    found = files[f".{to}"]
    plant = plants.MultibodyPlant(0.0)
    parsing = importlib.import_module("pydrake.multibody.parsing")
    parsing.Parser(plant).AddModelsFromString(found, to)
    plant.mutable_gravity_field().set_gravity_vector(GRAVITY)
    if to == "urdf":
        plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("ground"))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    if to == "urdf":  # its joints are at zero at design
        plant.SetPositions(context, [ANGLE])

    def acceleration():
        return plant.EvalTimeDerivatives(context).CopyToVector()[-1]

    clock = SPRINGS[1] if to == "sdf" else replace(SPRINGS[1], stiffness=0.0, damping=0.0)
    expected = start(springs=True, loads=False, bushing=soft, clock=clock)
    assert acceleration() == pytest.approx(expected, rel=1e-12)
    rest = acceleration()
    plant.SetVelocities(context, [SPEED])
    assert acceleration() - rest == pytest.approx(slowed(clock), rel=1e-9)
    assert "By Drake's own law" in found
    assert "Left out: gravity [1.0, 0.5, -9.80665] m/s^2, force 'push' (force), f" in found


@pytest.mark.parametrize("turning", [0.0, 30.0])
def test_written_urdf_bushing_is_kept(tmp_path, turning):
    """Its axes are oblique; the point and the numbers are as written, to the last digits."""
    soft = rubber("euler_parameters", (turning, 0.0, 5.0))
    mechanism = arm(forces=[*SPRINGS[:1], replace(soft, damping=(1.0, 2.0, 3.0))])
    case = motion_case(mechanism, [ANGLE])
    for suffix, text in written(case, writer_of("urdf")).items():
        (tmp_path / f"arm{suffix}").write_text(text)
    spring, found = load(tmp_path / "arm.urdf", Supplied(drive=("pin:0:1",))).mechanism.forces
    assert vars(spring) == vars(SPRINGS[0])
    given = mechanism.forces[1]
    for key, value in vars(given).items():
        if key not in ("axes", "point", "preload"):
            assert getattr(found, key) == value
    assert np.array(found.axes) == pytest.approx(np.array(given.axes), abs=1e-15)
    assert found.point == pytest.approx(given.point, abs=1e-15)
    assert found.preload == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


@pytest.mark.parametrize("bodies", [("ground", "arm"), ("arm", "ground")])
def test_written_osim_loads_accelerate_arm(tmp_path, bodies):
    o = pytest.importorskip("opensim", reason="opensim is not installed")
    o.Logger.setLevelString("Off")
    soft = rubber("cardan", bodies=bodies)
    found = texts("osim", arm(forces=[*SPRINGS, *LOADS, soft]))[".osim"]
    file = tmp_path / "arm.osim"
    file.write_text(found, encoding="utf-8")
    model = o.Model(str(file))
    state = model.initSystem()

    def acceleration():
        model.realizeAcceleration(state)
        [found] = state.getUDot().to_numpy()
        return found

    assert acceleration() == pytest.approx(
        start(springs=True, loads=False, bushing=soft), rel=1e-12
    )
    still = acceleration()
    state.setU(o.Vector.createFromMat(np.array([SPEED])))
    assert acceleration() - still == pytest.approx(slowed(), rel=1e-9)
    assert "own law" not in found
    assert "own law" in texts("osim", arm(forces=[rubber("euler_parameters")]))[".osim"]
    assert "Left out: force 'push' (force), force 'pull'" in found


@pytest.mark.parametrize(
    ("to", "names"), [("mjcf", "dead second"), ("sdf", "dead second short"), ("osim", "dead")]
)
def test_written_model_names_omitted_springs(to, names):
    """Between fixed bodies; a second one of a joint; of no free length, which Drake refuses."""
    forces = [
        TorsionSpringDamper("dead", "bolt", 1.0),
        TorsionSpringDamper("first", "pin", 1.0),
        TorsionSpringDamper("second", "pin", 2.0),
        SpringDamper("short", "ground", "arm", (HOOK, EYE), 10.0, 0.0, 0.0),
    ]
    mechanism = arm()
    bolt = Revolute("bolt", "ground", "base", point=(0.0, 0.0, 0.0), axis=(0.0, 1.0, 0.0))
    bodies = [Body("base", fixed=True), *mechanism.bodies]
    joints = [bolt, *mechanism.joints]
    mechanism = replace(mechanism, bodies=bodies, joints=joints, forces=forces)
    (text,) = texts(to, mechanism).values()
    _, found = text.split("Left out: ")
    told = [each for each in ("dead", "first", "second", "short") if f"'{each}'" in found[:200]]
    assert told == names.split()


@pytest.mark.parametrize("to", offers("writers"))
def test_written_model_without_masses(to):
    """Gravity alone moves nothing: the file is that of the mechanism without."""
    plain = replace(arm(), bodies=[Body("arm", ORIGIN, TURNED)], gravity=(0.0, 0.0, 0.0))
    falling = replace(plain, gravity=(0.0, 0.0, -9.8))
    assert texts(to, falling) == texts(to, plain)
    for text in written(cases.load("five_bar"), writer_of(to)).values():
        assert "Left out" not in text


def test_written_spring_sign_in_reversed_joint():
    """The tree goes from ground to the joint's first body."""
    mechanism = arm()
    pin = replace(mechanism.joint("pin"), i="arm", j="ground")
    spring = TorsionSpringDamper("clock", "pin", 7.0, 0.25, -0.5)
    _, data = started(texts("mjcf", replace(mechanism, joints=[pin], forces=[spring]))[".xml"])
    # the joint's angle is that of ground relative to the arm, in the file as in the case
    assert data.qpos[0] == pytest.approx(ANGLE)
    assert data.qfrc_spring[0] == pytest.approx(-7.0 * (ANGLE + 0.5))


# Coordinates of written models: driven in the file's own simulator, each joint moves as the joint


P, Q = (0.3, -0.2, 0.5), (0.1, 0.7, -0.4)
Z, AXIS_COORDINATES, ACROSS = (0.0, 0.0, 1.0), (2.0, -1.0, 2.0), (1.0, 2.0, 0.0)
# Round-off of some ten products of numbers of about one.
EXACT = 1e-14
WHERE = {"base": 0.4}


def turn(axis, angle, point):
    """The displacement by a turn, as a matrix of homogeneous coordinates."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis)).as_matrix()
    T[:3, 3] = np.array(point) - T[:3, :3] @ point
    return T


def shift(axis, distance):
    T = np.eye(4)
    T[:3, 3] = distance * np.array(axis) / np.linalg.norm(axis)
    return T


ALONG = {"joint.translation": 0.3, "joint.rotation": -0.7}
TURN, SHIFT = turn(AXIS_COORDINATES, 0.7, P), shift(AXIS_COORDINATES, 0.3)
HELIX = SHIFT @ turn(AXIS_COORDINATES, -0.7, P)
JOINTS = {
    "revolute": (Revolute, (AXIS_COORDINATES,), {"joint": 0.7}, TURN),
    "translational": (Translational, (AXIS_COORDINATES,), {"joint": 0.3}, SHIFT),
    "cylindrical": (Cylindrical, (AXIS_COORDINATES,), ALONG, HELIX),
    "screw": (Screw, (AXIS_COORDINATES, -0.6 * np.pi / 0.7), ALONG, HELIX),
    "universal": (
        Universal,
        ((AXIS_COORDINATES, ACROSS),),
        {"joint.hinge1": 0.5, "joint.hinge2": -0.4},
        turn(AXIS_COORDINATES, 0.5, P) @ turn(ACROSS, -0.4, P),
    ),
    "planar": (Planar, (AXIS_COORDINATES,), {"joint.rotation": 0.7}, TURN),
}


def case(kind, swapped, carried):
    """A body on the ground, or on a body that turns on it; first or second in its joint."""
    joint, axes, *_ = JOINTS[kind]
    bodies = [Body("arm", Q, (0.5, 0.5, -0.5, 0.5), mass=1.0, inertia=(1, 1, 1, 0, 0, 0))]
    joints, other = [], "ground"
    if carried:
        other = "carrier"
        bodies.append(Body("carrier", P, mass=2.0, inertia=(1, 2, 2, 0, 0, 0)))
        joints.append(Revolute("base", "ground", "carrier", Q, Z))
    pair = ("arm", other) if swapped else (other, "arm")
    joints.append(joint("joint", *pair, P, *axes))
    mechanism = Mechanism("driven", bodies, joints, [], [])
    return motion_case(mechanism, [0.0, 1.0])


# x -> y -> z -> x, by the Euler parameters of the arm
TURNED_COORDINATES = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])


def pose(to, case, values, folder, start=None):
    texts = written(case, writer_of(to.split()[0]), start)
    return read(to, texts, case.mechanism, folder, values).bodies["arm"]


@pytest.mark.parametrize("carried", [False, True], ids=["on ground", "on a moving body"])
@pytest.mark.parametrize("swapped", [False, True], ids=["second", "first"])
@pytest.mark.parametrize("kind", JOINTS)
@pytest.mark.parametrize("to", IN_TREES)
def test_written_joint_coordinate_drives_body(to, kind, swapped, carried, tmp_path):
    *_, values, T = JOINTS[kind]
    if swapped:
        T = np.linalg.inv(T)
    if carried:
        values, T = values | WHERE, turn(Z, WHERE["base"], Q) @ T
    at, axes = pose(to, case(kind, swapped, carried), values, tmp_path)
    np.testing.assert_allclose(at, T[:3, :3] @ Q + T[:3, 3], rtol=0, atol=EXACT)
    np.testing.assert_allclose(axes, T[:3, :3] @ TURNED_COORDINATES, rtol=0, atol=EXACT)


@pytest.mark.parametrize("swapped", [False, True], ids=["second", "first"])
@pytest.mark.parametrize(
    ("kind", "driver", "start"),
    [("revolute", JointAngle, 0.7), ("translational", JointDisplacement, -0.3)],
)
@pytest.mark.parametrize("to", ["mjcf", "osim"])
def test_written_start_keeps_coordinate_zeros(to, kind, driver, start, swapped, tmp_path):
    """Driven to zero, the model is in the design pose; driven on, where the case is."""
    still = case(kind, swapped, carried=False)
    mechanism = replace(still.mechanism, drivers=[driver("drive", "joint")])
    driven = motion_case(mechanism, [0.0, 0.7])
    at, axes = pose(to, driven, {"joint": 0.0}, tmp_path, start)
    np.testing.assert_allclose(at, Q, rtol=0, atol=EXACT)
    np.testing.assert_allclose(axes, TURNED_COORDINATES, rtol=0, atol=EXACT)
    *_, values, T = JOINTS[kind]
    if swapped:
        T = np.linalg.inv(T)
    at, _ = pose(to, driven, values, tmp_path, start)
    np.testing.assert_allclose(at, T[:3, :3] @ Q + T[:3, 3], rtol=0, atol=EXACT)
