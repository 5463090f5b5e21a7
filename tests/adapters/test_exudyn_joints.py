"""Every joint in Exudyn against the native engine in a closed loop; threads, gears and racks
against closed forms over turns.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck.adapters.exudyn.exudyn import Exudyn
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.joints import (
    ConstantVelocity,
    Cylindrical,
    Distance,
    Gear,
    RackPinion,
    Revolute,
    Screw,
    Translational,
)
from kincheck.core.kinematics import solve
from kincheck.core.mechanism.mechanism import Body, Mechanism, Point
from kincheck.core.mechanism.motions import JointAngle, JointDisplacement, PointCoordinate, Sine

from ..support.joint_loops import RATE, TURN, TYPES, assert_moves_natively, on_crank

pytest.importorskip("exudyn")

TOL = 1e-12
# Exudyn and the native engine hold their residuals to 1e-12, and the smallest pivot of these loops
# is 0.06. Accelerations rest on differences of the Jacobian besides (see DIFFERENCES of the
# adapter), of the same size at these speeds.
CLOSE = (1e-10, 1e-9, 1e-9)
PLACES = ((0.5, 0.1, 0.4), (-0.3, 0.2, 0.9))
# Ends on b and on the ground. Drawn at random and chosen so that each joint's loop, held by the
# first of them, stays far from lock-up: the smallest pivot of the native rows is 0.06.
RODS = [
    ((0.0, 0.7, 0.4), (0.1, -0.1, 1.2)),
    ((0.4, -0.7, 0.1), (0.9, -0.7, 1.3)),
    ((0.3, 0.4, -0.5), (1.5, 0.0, -0.4)),
    ((0.7, 0.6, -0.1), (1.6, 2.7, 0.7)),
    ((-0.5, 0.8, -0.2), (1.7, 1.4, 1.6)),
]


def solved(mechanism, driver, values, motions=None, rate=1.0):
    """The trajectory in Exudyn, with all points; every sample must be there."""
    outputs = tuple(
        Output(point.name, point.name, (1.0, 0.0, 0.0), False, 1e-9, 0.0, "")
        for point in mechanism.points
    )
    sweep = Sweep(driver, np.asarray(values, dtype=float), rate, motions=motions or {})
    case = Case(mechanism.name, "test", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs)
    assert Exudyn().unsupported(case) is None
    found = Exudyn().solve(Exudyn().build(case), case, TOL)
    assert found.solved.all(), found.message
    assert found.residual <= TOL
    return found


def compare(mechanism, driver, values, motions=None):
    """Exudyn against the native engine."""
    truth = solve(mechanism, driver, values, motions=motions)
    assert truth.solved.all(), truth.message
    for name, found in solved(mechanism, driver, values, motions).points.items():
        true = truth.points[name]
        assert np.ptp(true.position, axis=0).max() > 1e-3  # it moves
        for quantity, largest in zip(("position", "velocity", "acceleration"), CLOSE, strict=True):
            assert np.abs(getattr(found, quantity) - getattr(true, quantity)).max() <= largest


def loop(joint, rods=None):
    """Body a swings on the ground, the joint is between a and b, and b hangs on as many rods as the
    joint has freedoms.
    """
    ties = [
        Distance(f"rod {k}", "b", "ground", ends)
        for k, ends in enumerate(RODS[: 6 - joint.rows if rods is None else rods])
    ]
    swing = Revolute("swing", "ground", "a", (0.2, -0.1, 0.3), (0.3, 1.0, 0.4))
    points = [Point(f"P{k}", "b", place) for k, place in enumerate(PLACES)]
    return Mechanism(
        joint.type,
        [Body("a"), Body("b", (0.4, 0.1, 0.2))],
        [swing, joint, *ties],
        points,
        [JointAngle("t", "swing")],
    )


@pytest.mark.parametrize("bodies", [("A", "B"), ("B", "A")])
@pytest.mark.parametrize("kind", TYPES)
def test_every_joint_in_a_closed_loop(kind, bodies):
    found = solved(on_crank(kind, *bodies), "turn", TURN, rate=RATE)
    assert_moves_natively(found, kind, bodies, CLOSE)


def test_constant_velocity_of_parallel_shafts_at_design():
    joint = ConstantVelocity(
        "joint", "a", "b", (0.3, -0.2, 0.5), ((0.2, 1.0, 0.1), (0.2, 1.0, 0.1))
    )
    compare(loop(joint), "t", np.linspace(-0.4, 0.4, 7))


DRIVEN = [
    (JointAngle, Revolute, (), 7.0),
    (JointAngle, Screw, (0.2,), 7.0),
    (JointDisplacement, Screw, (0.2,), 0.25),
    (JointDisplacement, Translational, (), 0.1),
]


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize(("kind", "type_", "extra", "reach"), DRIVEN)
def test_driven_coordinate_of_an_axial_joint(kind, type_, extra, reach, reverse):
    """On a body that swings by itself, over more than a turn: 7 rad, or 0.25 m of a thread of
    0.2 m.
    """
    joint = type_("joint", "a", "b", (0.3, -0.2, 0.5), (1.0, 2.0, -0.5), *extra)
    mechanism = loop(joint.reversed() if reverse else joint, rods=0)
    mechanism = replace(mechanism, drivers=[kind("d", "joint"), *mechanism.drivers])
    compare(mechanism, "d", np.linspace(-reach, reach, 41), {"t": Sine(0.3, 0.1)})


@pytest.mark.parametrize("reverse", [False, True])
def test_both_coordinates_of_a_cylindrical_joint(reverse):
    joint = Cylindrical("joint", "a", "b", (0.3, -0.2, 0.5), (1.0, 2.0, -0.5))
    mechanism = loop(joint.reversed() if reverse else joint, rods=0)
    mechanism = replace(
        mechanism,
        drivers=[JointAngle("r", "joint"), JointDisplacement("d", "joint"), *mechanism.drivers],
    )
    compare(mechanism, "r", np.linspace(-7.0, 7.0, 41), {"d": Sine(0.1, 0.2), "t": Sine(0.3, 0.1)})


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("lead", [0.05, -0.2])
@pytest.mark.parametrize("driver", ["angle", "displacement", "point"])
def test_screw_over_three_turns(lead, driver, reverse):
    """A nut on a fixed spindle along z: a helix, whatever drives it."""
    screw = Screw("thread", "ground", "nut", (0.0, 0.0, 0.0), (0.0, 0.0, 2.0), lead)
    drivers = {
        "angle": JointAngle("d", "thread"),
        "displacement": JointDisplacement("d", "thread"),
        "point": PointCoordinate("d", "P", (0.0, 0.0, 1.0)),
    }
    points = [Point("P", "nut", (0.3, 0.0, 0.1))]
    joint = screw.reversed() if reverse else screw
    mechanism = Mechanism(
        "screw", [Body("nut", (0.1, 0.2, 0.3))], [joint], points, [drivers[driver]]
    )
    angle, pitch = np.linspace(-3.0 * math.pi, 3.0 * math.pi, 61), lead / (2.0 * math.pi)
    # exchanged bodies measure the spindle from the nut; a point is where it is
    sense = -1.0 if reverse and driver != "point" else 1.0
    values = sense * angle * (1.0 if driver == "angle" else pitch)
    P = solved(mechanism, "d", values, rate=values[-1] / angle[-1]).points["P"]
    c, s, one = 0.3 * np.cos(angle), 0.3 * np.sin(angle), np.ones_like(angle)
    # the angle of a displacement amplifies its round-off by 2 pi / lead, below 130
    assert np.abs(P.position - np.stack([c, s, 0.1 + pitch * angle], axis=1)).max() <= 1e-12
    assert np.abs(P.velocity - np.stack([-s, c, pitch * one], axis=1)).max() <= 1e-12
    assert np.abs(P.acceleration - np.stack([-c, -s, 0.0 * one], axis=1)).max() <= 1e-11


def train(reverse=()):
    """On a carrier that turns about z: an input wheel, twice as large an intermediate wheel, a
    pinion on it, and its rack.
    """
    z, x = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
    joints = [
        Revolute("carrier", "ground", "frame", (0.0, 0.0, 0.0), z),
        Revolute("input", "frame", "wheel", (0.2, 0.0, 0.0), z),
        Revolute("middle", "frame", "double", (0.5, 0.0, 0.0), z),
        Translational("guide", "frame", "rack", (0.5, -0.05, 0.0), x),
    ]
    joints = [joint.reversed() if joint.name in reverse else joint for joint in joints]
    points = [("wheel", (0.3, 0.0, 0.0)), ("double", (0.5, 0.2, 0.1)), ("rack", (0.4, -0.05, 0.0))]
    sign = {name: -1.0 if name in reverse else 1.0 for name in ("input", "middle", "guide")}
    couplers = [
        Gear("mesh", ("input", "middle"), -2.0 * sign["input"] * sign["middle"]),
        RackPinion("teeth", ("middle", "guide"), 0.05 * sign["middle"] * sign["guide"]),
    ]
    return Mechanism(
        "train",
        [Body(name) for name in ("frame", "wheel", "double", "rack")],
        joints,
        [Point(body, body, position) for body, position in points],
        [JointAngle("turn", "carrier"), JointAngle("in", "input")],
        couplers,
    )


@pytest.mark.parametrize(
    "reverse", [(), ("input",), ("middle", "guide"), ("input", "middle", "guide")]
)
@pytest.mark.parametrize("driver", ["in", "middle", "rack"])
def test_gears_and_a_rack_over_turns(driver, reverse):
    """Driven at the input, in the middle and from the rack; the carrier turns with it, which adds
    to all wheels alike.
    """
    mechanism, sign = (
        train(reverse),
        {name: -1.0 if name in reverse else 1.0 for name in ("input", "middle", "guide")},
    )
    # of the input wheel in its carrier, at 1 rad/s
    angle = np.linspace(-2.5 * math.pi, 2.5 * math.pi, 51)
    drivers = {
        "in": (JointAngle("d", "input"), sign["input"]),
        "middle": (JointAngle("d", "middle"), -0.5 * sign["middle"]),
        "rack": (JointDisplacement("d", "guide"), -0.025 * sign["guide"]),
    }
    moved, factor = drivers[driver]
    mechanism = replace(mechanism, drivers=[mechanism.drivers[0], moved])
    found = solved(mechanism, "d", factor * angle, {"turn": Sine(0.5, 0.1)}, rate=factor)
    swing = np.stack(Sine(0.5, 0.1).at(angle))

    def turning(arm, turn, slide=0.0):
        """Position, velocity, acceleration as complex numbers of arm e^(i turn) in the carrier,
        jets by the product rule.
        """
        return (
            arm
            * np.exp(1j * turn[0])
            * np.stack([np.ones_like(angle), 1j * turn[1], 1j * turn[2] - turn[1] ** 2])
        )

    one, none = np.ones_like(angle), np.zeros_like(angle)
    wheel, double = swing + [angle, one, none], swing + [-0.5 * angle, -0.5 * one, none]
    s, s_t = 0.4 - 0.025 * angle, -0.025
    rack = turning(1.0, swing)
    rack = np.stack(
        [
            rack[0] * (s - 0.05j),
            rack[1] * (s - 0.05j) + rack[0] * s_t,
            rack[2] * (s - 0.05j) + 2.0 * rack[1] * s_t,
        ],
    )
    expected = {
        "wheel": turning(0.2, swing) + turning(0.1, wheel),
        "double": turning(0.5, swing) + turning(0.2j, double),
        "rack": rack,
    }
    for name, motion in found.points.items():
        for values, true, tolerance in zip(
            (motion.position, motion.velocity, motion.acceleration),
            expected[name],
            (1e-12, 1e-12, 1e-11),
            strict=True,
        ):
            # round-off of angles of 8 rad and of a rack that tells its pinion's angle by 20 rad/m
            assert np.abs(values[:, 0] + 1j * values[:, 1] - true).max() <= tolerance


def test_couplers_agree_with_the_native_engine():
    mechanism = replace(
        train(), drivers=[JointAngle("turn", "carrier"), JointDisplacement("d", "guide")]
    )
    compare(mechanism, "d", np.linspace(-0.2, 0.2, 25), {"turn": Sine(0.5, 0.1)})


def test_coarse_steps_of_a_fast_pinion():
    """A crank that pushes a rack, in steps of 30 degrees: the pinion turns by up to 10 rad a step,
    and its speed changes.
    """
    joints = [
        Revolute("pivot", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        Distance("rod", "crank", "rack", ((0.1, 0.0, 0.0), (0.5, 0.0, 0.0))),
        Translational("guide", "ground", "rack", (0.5, 0.0, 0.0), (1.0, 0.0, 0.0)),
        Revolute("axle", "ground", "pinion", (0.5, 0.05, 0.0), (0.0, 0.0, 1.0)),
    ]
    teeth = RackPinion("teeth", ("axle", "guide"), 0.005)
    bodies, points = (
        [Body(name) for name in ("crank", "rack", "pinion")],
        [Point("P", "pinion", (0.6, 0.05, 0.0))],
    )
    mechanism = Mechanism("m", bodies, joints, points, [JointAngle("t", "pivot")], [teeth])
    angle = np.radians(np.arange(0.0, 181.0, 30.0))
    slide = 0.1 * np.cos(angle) + np.sqrt(0.4**2 - (0.1 * np.sin(angle)) ** 2) - 0.5
    turn = slide / 0.005
    P = solved(mechanism, "t", angle).points["P"].position
    # round-off of a turn of 40 rad, on 0.1 m
    assert np.abs(P[:, 0] - 0.5 - 0.1 * np.cos(turn)).max() <= 1e-13
    assert np.abs(P[:, 1] - 0.05 - 0.1 * np.sin(turn)).max() <= 1e-13
