"""Couplers in every engine, and linear ones as equations of MuJoCo."""

import math
from dataclasses import replace
from itertools import product

import kincheck
import numpy as np
import pytest
from kincheck.cases.jet import Jet, cos, sin, steady
from kincheck.core.case.io.case_file import case_text, load_case
from kincheck.core.errors import MechanismError
from kincheck.core.joints import (
    Cylindrical,
    Distance,
    Gear,
    LinearCoupler,
    RackPinion,
    Revolute,
    Screw,
    Translational,
    Universal,
)
from kincheck.core.mechanism.motions import JointAngle, JointDisplacement, Sine

from ..support.engine_motion import (
    ENGINES,
    IN_TREE_OR_CUT,
    SIMULATORS,
    assert_as_native,
    assert_motion,
    installed,
    mechanism_of,
    planar,
    rotation,
    solved,
    tolerances,
)
from ..support.mechanisms import ORIGIN, X, Z

TURNS = np.linspace(-7.0, 7.0, 29)
AXIS, TIP = (1.0, 2.0, -2.0), np.array([0.3, -0.2, 0.4])


@ENGINES
def test_screw_with_guided_nut_moves_exactly(engine):
    """A shaft in bearings drives a nut: of the 15 rows of the loop four say what others say."""
    joints = [
        Revolute("bearing", "ground", "shaft", ORIGIN, AXIS),
        Screw("thread", "nut", "shaft", ORIGIN, AXIS, 0.1),
        Translational("guide", "ground", "nut", (0.2, 0.0, 0.1), AXIS),
    ]
    mechanism = mechanism_of(joints, {"tip": ("nut", TIP)}, [JointAngle("turn", "bearing")])
    found = assert_as_native(engine, mechanism, TURNS)
    travel = -0.1 / (2.0 * math.pi) * np.array(AXIS) / 3.0
    assert_motion(found.points["tip"], TIP + np.outer(TURNS, travel), atol=tolerances(engine))


@IN_TREE_OR_CUT
def test_gear_train_with_rack_moves_exactly(engine, closing):
    """A bearing that names its shaft first has the other sign of rotation. The last wheel slides
    too, as driven.
    """
    cut = ["b", "c", "rail"] if closing else []
    joints = [
        Revolute("a", "ground", "A", ORIGIN, (0.0, 0.0, 2.0)),
        Revolute("b", "B", "ground", (0.4, 0.0, 0.0), (0.0, 0.0, 2.0)),
        Cylindrical("c", "ground", "C", X, (0.0, 0.0, 2.0)),
        Translational("rail", "ground", "R", (1.0, 0.2, 0.0), X),
    ]
    ends = {"A": (0.1, 0.0, 0.0), "B": (0.6, 0.0, 0.0), "C": (1.0, 0.1, 0.0), "R": (1.0, 0.2, 0.0)}
    couplers = [
        Gear("ab", ("b", "a"), 0.5),
        Gear("bc", ("b", "c"), 3.0),
        RackPinion("cr", ("c", "rail"), -0.2),
    ]
    drivers = [JointAngle("turn", "a"), JointDisplacement("shift", "c")]
    points = {name: (name, place) for name, place in ends.items()}
    mechanism = mechanism_of(joints, points, drivers, couplers)
    found = assert_as_native(engine, mechanism, TURNS, cut=cut)
    # b = a / 2 turns B by -a / 2; c = b / 3
    half, sixth, none = TURNS / 2, TURNS / 6, 0 * TURNS
    expected = {
        "B": (0.4 + 0.2 * np.cos(half), -0.2 * np.sin(half), none),
        "C": (1.0 - 0.1 * np.sin(sixth), 0.1 * np.cos(sixth), none),
        "R": (1.0 - 0.2 * sixth, 0.2 + none, none),
    }
    for name, wanted in expected.items():
        assert_motion(found.points[name], np.stack(wanted, axis=1))
    if engine == "mujoco":
        assert len(found.details["relations"]) == 3
    assert_as_native(engine, replace(mechanism, drivers=drivers[::-1]), TURNS, cut=cut)


@ENGINES
@pytest.mark.parametrize("ratio", [2.0, -0.3])
def test_planetary_gear_turns_exactly(ratio, engine):
    """The planet turns on its carrier, and rolls on a fixed sun: by the ratio more than it."""
    hub, tip = np.array([0.3, 0.0, 0.0]), np.array([0.4, 0.0, 0.0])
    joints = [
        Revolute("main", "ground", "carrier", ORIGIN, Z),
        Revolute("hub", "carrier", "planet", tuple(hub), Z),
    ]
    gear, driver = Gear("teeth", ("hub", "main"), ratio), JointAngle("turn", "main")
    mechanism = mechanism_of(joints, {"tip": ("planet", tip)}, [driver], [gear])
    expected = rotation(Z, TURNS) @ hub + rotation(Z, (1.0 + ratio) * TURNS) @ (tip - hub)
    assert_motion(solved(engine, mechanism, TURNS).points["tip"], expected)


@IN_TREE_OR_CUT
@pytest.mark.parametrize("bodies", [("spindle", "nut"), ("nut", "spindle")])
def test_screw_in_loop_moves_as_native(bodies, engine, closing):
    """A thread in a closed loop in space, between two Hooke's joints that let the spindle swing;
    over several turns.

    With the thread cut, bodies that turn about several moving axes carry it: the only place where
    its angle has a bias.
    """
    along, eye, foot = (0.1, 0.2, 1.0), (0.05, 0.1, 0.5), ORIGIN
    joints = [
        Universal("base", "ground", "housing", foot, ((1.0, 0.0, -0.1), (0.02, 1.0, 0.2))),
        Revolute("bearing", "housing", "spindle", foot, along),
        Screw("thread", *bodies, foot, along, 0.02),
        Universal("eye", "lever", "nut", eye, ((0.1, 1.0, 0.0), (1.0, -0.1, 0.3))),
        Revolute("pivot", "ground", "lever", (0.6, 0.0, 0.4), (0.3, 1.0, 0.2)),
    ]
    points = {
        "end": ("spindle", (0.2, 0.0, 0.6)),
        "nut": ("nut", (0.1, 0.2, 0.5)),
        "tip": ("lever", (0.9, 0.0, 0.2)),
    }
    mechanism = mechanism_of(joints, points, [JointAngle("turn", "bearing")])
    turn = np.linspace(-15.0, 15.0, 121)
    found = assert_as_native(engine, mechanism, turn, cut=["thread"] if closing else [])
    assert np.ptp(found.points["tip"].position[:, 2]) > 0.02
    if closing:
        assert "thread" in found.details["closures"]


def train(reverse):
    """On a carrier that turns about z: an input wheel, twice as large an intermediate wheel, a
    pinion on it, and its rack.
    """
    joints = [
        Revolute("carrier", "ground", "frame", ORIGIN, Z),
        Revolute("input", "frame", "wheel", (0.2, 0.0, 0.0), Z),
        Revolute("middle", "frame", "double", (0.5, 0.0, 0.0), Z),
        Translational("guide", "frame", "rack", (0.5, -0.05, 0.0), X),
    ]
    joints = [joint.reversed() if joint.name in reverse else joint for joint in joints]
    points = {"wheel": (0.3, 0.0, 0.0), "double": (0.5, 0.2, 0.0), "rack": (0.4, -0.05, 0.0)}
    sign = {name: -1.0 if name in reverse else 1.0 for name in ("input", "middle", "guide")}
    couplers = [
        Gear("mesh", ("input", "middle"), -2.0 * sign["input"] * sign["middle"]),
        RackPinion("teeth", ("middle", "guide"), 0.05 * sign["middle"] * sign["guide"]),
    ]
    places = {name: (name, place) for name, place in points.items()}
    return mechanism_of(joints, places, [JointAngle("turn", "carrier")], couplers), sign


@ENGINES
@pytest.mark.parametrize(
    "chosen", [*product(["in", "middle", "rack"], [(), ("input",), ("middle", "guide")])], ids=str
)
def test_gears_and_rack_on_turning_carrier(chosen, engine):
    """Driven at the input, in the middle and from the rack; the carrier turns with it, which adds
    to all wheels alike.
    """
    driver, reverse = chosen
    mechanism, sign = train(reverse)
    # of the input wheel in its carrier, at 1 rad/s
    angle = np.linspace(-2.5 * math.pi, 2.5 * math.pi, 51)
    swept, factor = {
        "in": (JointAngle("d", "input"), sign["input"]),
        "middle": (JointAngle("d", "middle"), -0.5 * sign["middle"]),
        "rack": (JointDisplacement("d", "guide"), -0.025 * sign["guide"]),
    }[driver]
    mechanism = replace(mechanism, drivers=[swept, *mechanism.drivers])
    motions = {"turn": Sine(0.5, 0.1)}
    found = solved(engine, mechanism, factor * angle, factor, motions=motions)
    turn, swing = steady(angle, 1.0), Jet(*Sine(0.5, 0.1).at(angle))
    c, s, wheel, double = cos(swing), sin(swing), swing + turn, swing - 0.5 * turn
    x = 0.4 - 0.025 * turn
    expected = {
        "wheel": planar(0.2 * c + 0.1 * cos(wheel), 0.2 * s + 0.1 * sin(wheel)),
        "double": planar(0.5 * c - 0.2 * sin(double), 0.5 * s + 0.2 * cos(double)),
        "rack": planar(x * c + 0.05 * s, x * s - 0.05 * c),
    }
    # round-off of angles of 8 rad and of a rack that tells its pinion's angle by 20 rad/m
    atol = (1e-12, 1e-12, 1e-11 if engine != "exudyn" else 1e-10)
    for name, motion in found.points.items():
        assert_motion(motion, *expected[name], atol=atol)


@ENGINES
def test_rack_pinion_in_coarse_steps(engine):
    """A crank that pushes a rack, in steps of 30 degrees: the pinion turns by up to 10 rad a step,
    and its speed changes.
    """
    joints = [
        Revolute("pivot", "ground", "crank", ORIGIN, Z),
        Distance("rod", "crank", "rack", ((0.1, 0.0, 0.0), (0.5, 0.0, 0.0))),
        Translational("guide", "ground", "rack", (0.5, 0.0, 0.0), X),
        Revolute("axle", "ground", "pinion", (0.5, 0.05, 0.0), Z),
    ]
    teeth = RackPinion("teeth", ("axle", "guide"), 0.005)
    points = {"P": ("pinion", (0.6, 0.05, 0.0))}
    mechanism = mechanism_of(joints, points, [JointAngle("t", "pivot")], [teeth])
    angle = np.radians(np.arange(0.0, 181.0, 30.0))
    slide = 0.1 * np.cos(angle) + np.sqrt(0.4**2 - (0.1 * np.sin(angle)) ** 2) - 0.5
    turn = slide / 0.005
    P = solved(engine, mechanism, angle).points["P"].position
    # round-off of a turn of 40 rad, on 0.1 m
    assert np.abs(P[:, 0] - 0.5 - 0.1 * np.cos(turn)).max() <= 1e-13
    assert np.abs(P[:, 1] - 0.05 - 0.1 * np.sin(turn)).max() <= 1e-13


# Couplers of three joints in every simulator, against the sum that they keep at zero


# q1 + 0.05/mm q2 - 2 q3 = 0 with q1 = t, q2 = 10 mm sin(pi t): q3 = t / 2 + 0.25 sin(pi t), whose
# couple is -1/2 of that on the first joint; the arm of 2 kg at 0.3 m weighs on the third.
CASE = """schema = "kincheck-case/1"
name = "differential"
source = "made for this test"
truth = "closed_form"
gravity = [0, -10000, 0]
[units]
length = "mm"
[bodies.left]
[bodies.rack]
[bodies.cage]
mass = 2
center_of_mass = [300, 0, 0]
[joints.left]
type = "revolute"
bodies = ["ground", "left"]
point = [0, 0, 0]
axis = [0, 0, 1]
[joints.rack]
type = "translational"
bodies = ["left", "rack"]
point = [0, 0, 0]
axis = [1, 0, 0]
[joints.cage]
type = "revolute"
bodies = ["ground", "cage"]
point = [0, 0, 0]
axis = [0, 0, 1]
[couplers.sum]
type = "linear_coupler"
joints = ["left", "rack", "cage"]
factors = [1, 0.05, -2]
[drivers.left]
type = "joint_angle"
joint = "left"
[drivers.rack]
type = "joint_displacement"
joint = "rack"
[drivers.rack.motion]
type = "sine"
amplitude = 10
frequency = 0.5
[sweep]
driver = "left"
start = 0
stop = 1
steps = 5
[outputs.cage]
type = "joint_angle"
joint = "cage"
[outputs.effort]
type = "driver_effort"
driver = "left"
[reference]
columns = ["left", "cage", "cage.velocity", "cage.acceleration", "effort"]
rows = [
ROWS
]
citation = "the sum"
"""


def differential(folder):
    t = np.linspace(0.0, 1.0, 5)
    turn = 0.5 * t + 0.25 * np.sin(np.pi * t)
    rate = 0.5 + 0.25 * np.pi * np.cos(np.pi * t)
    curvature = -0.25 * np.pi**2 * np.sin(np.pi * t)
    # a torque on the cage of I a + m g x [N mm], of which the first joint has half
    effort = 500.0 * (2.0 * 0.3**2 * curvature + 2.0 * 10.0 * 0.3 * np.cos(turn))
    rows = np.stack([t, turn, rate, curvature, effort], axis=1)
    text = CASE.replace("ROWS", ",\n".join(str(row) for row in rows.tolist()))
    (file := folder / "differential.toml").write_text(text)
    return load_case(file)


@pytest.mark.by_day(2)
@pytest.mark.parametrize("engine", ["native", *SIMULATORS])
def test_linear_coupler_of_three_joints_passes(engine, tmp_path):
    case = differential(tmp_path)
    if engine != "native":
        installed(engine)
    (found,) = kincheck.run(case, engine).records
    assert found.outcome.value == "pass", found


def test_linear_coupler_in_written_files(tmp_path):
    compare = pytest.importorskip("kincheck.core.extensions.same.verdict").compare
    undriven = pytest.importorskip("kincheck.core.extensions.same.undriven")
    written = pytest.importorskip("kincheck.core.extensions.exports.model_writer").written
    writer_of = pytest.importorskip("kincheck.core.extensions.exports.command").writer_of
    case = differential(tmp_path)
    (file := tmp_path / "again.toml").write_text(case_text(case))
    assert load_case(file).mechanism.couplers == case.mechanism.couplers
    for form in ("mjcf", "urdf"):
        for suffix, text in written(case, writer_of(form), None).items():
            (tmp_path / f"written_{form}{suffix}").write_text(text)
    for name in ("written_mjcf.xml", "written_urdf.urdf"):
        same = compare(
            undriven.undriven_case(case, "case"), undriven.undriven_file(tmp_path / name), {}
        )
        assert same.verdict == "same", same.reason
        assert same.largest < 1e-14


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((("a", "b", "a"), (1.0, 1.0, 1.0)), "couples 'a' with itself"),
        ((("a", "b", "c"), (1.0, 1.0)), "found 2, expected 3"),
        ((("a", "b", "c"), (1.0, 0.0, 1.0)), "would lock or lose a joint"),
        ((("a",), (1.0,)), "two names or more"),
    ],
)
def test_linear_coupler_bad_arguments_are_refused(given, said):
    with pytest.raises(MechanismError, match=said):
        LinearCoupler("sum", *given)
