"""Every joint type in MuJoCo, in its tree and closing a loop, against the native solver and closed
forms.
"""

import math
from contextlib import nullcontext
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from kincheck.adapters.mujoco import spec
from kincheck.core import Body, JointAngle, JointDisplacement, Mechanism, Point
from kincheck.core import solve as solve_natively
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.joints import (
    ConstantVelocity,
    Cylindrical,
    Gear,
    RackPinion,
    Revolute,
    Screw,
    Spherical,
    Translational,
)
from kincheck.core.mechanism.topology import SpanningTree, spanning_tree

from ..support.joint_loops import (
    RATE,
    TOO_LOOSE,
    TURN,
    TYPES,
    assert_moves_natively,
    on_crank,
)
from .test_mujoco import assert_motion, solve

pytest.importorskip("mujoco", reason="MuJoCo is not installed")

# Position, velocity and acceleration, m and s: round-off, amplified at most a thousandfold by the
# mechanisms at these speeds.
TOLERANCES = (1e-13, 1e-12, 1e-11)


def solved(mechanism, driver, values, rate=1.0, cut=()):
    """MuJoCo's solution, with joints to be cut: they close loops, and their bodies hang on others,
    or are free.
    """
    outputs = tuple(
        Output(point.name, point.name, (1.0, 0.0, 0.0), False, 0.0, 0.0, "")
        for point in mechanism.points
    )
    sweep = Sweep(driver, np.array(values), rate)
    with cutting(*cut) if cut else nullcontext():
        return solve(Case("test", "test", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs))


def assert_agrees(mechanism, driver, values, rate=1.0, cut=()):
    """The motions of all points are those of the native solver; returned is MuJoCo's solution."""
    found = solved(mechanism, driver, values, rate, cut)
    expected = solve_natively(mechanism, driver, values, rate=rate)
    assert expected.solved.all()
    for name, motion in expected.points.items():
        assert_motion(
            found.points[name],
            motion.position,
            motion.velocity,
            motion.acceleration,
            atol=TOLERANCES,
        )
    return found


def cutting(*names):
    """MuJoCo's tree without these joints; the native engine, whose models are kept, has none."""

    def tree(mechanism):
        kept = [each for each in mechanism.joints if each.name not in names]
        rest = spanning_tree(replace(mechanism, joints=kept, drivers=(), couplers=()))
        return SpanningTree(rest.branches, (*rest.cut, *map(mechanism.joint, names)))

    return mock.patch.object(spec, "spanning_tree", tree)


@pytest.mark.parametrize("closing", [False, True], ids=["tree", "cut"])
@pytest.mark.parametrize("bodies", [("A", "B"), ("B", "A")], ids=["ij", "ji"])
@pytest.mark.parametrize("kind", TYPES)
def test_joint_moves_as_natively(kind, bodies, closing):
    found = solved(on_crank(kind, *bodies), "turn", TURN, RATE, ["tested"] if closing else [])
    assert ("tested" in found.details["closures"]) == (closing or kind in TOO_LOOSE)
    assert_moves_natively(found, kind, bodies)


# Coordinates of joints: driven, coupled, over several turns


TURNS = np.linspace(-7.0, 7.0, 29)
CUTS = pytest.mark.parametrize("closing", [False, True], ids=["tree", "cut"])


def on_screw(theta, axis, point, lead, rate):
    """Position, velocity and acceleration of a point that turns about an axis through the origin
    and moves along it.
    """
    h = np.array(axis) / np.linalg.norm(axis)
    along, across = (point @ h) * h, point - (point @ h) * h
    c, s = np.cos(theta)[:, None], np.sin(theta)[:, None]
    n, p = np.cross(h, across), lead / (2.0 * math.pi)
    return (
        along + c * across + s * n + np.outer(p * theta, h),
        rate * (c * n - s * across + p * h),
        -(rate**2) * (c * across + s * n),
    )


AXIS, TIP = (1.0, 2.0, -2.0), np.array([0.3, -0.2, 0.4])


@CUTS
@pytest.mark.parametrize("mirrored", [False, True], ids=["ij", "ji"])
@pytest.mark.parametrize("lead", [0.05, -9.0])
@pytest.mark.parametrize("kind", [JointAngle, JointDisplacement])
def test_a_screw_driven_over_several_turns(kind, lead, mirrored, closing):
    """Both ways round, by either of its coordinates, with a lead above and below one radian a
    metre.
    """
    thread = Screw("thread", "ground", "nut", (0.0, 0.0, 0.0), AXIS, lead)
    mechanism = Mechanism(
        "screw",
        [Body("nut")],
        [thread.reversed() if mirrored else thread],
        [Point("tip", "nut", tuple(TIP))],
        [kind("drive", "thread")],
    )
    unit = 1.0 if kind is JointAngle else lead / (2.0 * math.pi)
    found = assert_agrees(
        mechanism, "drive", unit * TURNS, unit * 2.0, cut=["thread"] if closing else []
    )
    sign = -1.0 if mirrored else 1.0
    assert_motion(
        found.points["tip"],
        *on_screw(sign * TURNS, AXIS, TIP, lead, sign * 2.0),
        atol=(1e-12, 1e-12, 1e-11),
    )
    assert len(found.details["relations"]) == 1


@CUTS
@pytest.mark.parametrize("mirrored", [False, True], ids=["ij", "ji"])
@pytest.mark.parametrize("driver", ["turn", "push"])
def test_both_coordinates_of_a_cylindrical_joint_are_driven(driver, mirrored, closing):
    sleeve = Cylindrical("sleeve", "ground", "rod", (0.0, 0.0, 0.0), AXIS)
    drivers = [JointAngle("turn", "sleeve"), JointDisplacement("push", "sleeve")]
    joints = [sleeve.reversed() if mirrored else sleeve]
    assert_agrees(
        Mechanism("cylindrical", [Body("rod")], joints, [Point("tip", "rod", tuple(TIP))], drivers),
        driver,
        TURNS,
        cut=["sleeve"] if closing else [],
    )


def test_a_nut_that_a_guide_keeps_from_turning():
    """A shaft in bearings drives a nut: of the 15 rows of the loop four say what others say."""
    joints = [
        Revolute("bearing", "ground", "shaft", (0.0, 0.0, 0.0), AXIS),
        Screw("thread", "nut", "shaft", (0.0, 0.0, 0.0), AXIS, 0.1),
        Translational("guide", "ground", "nut", (0.2, 0.0, 0.1), AXIS),
    ]
    mechanism = Mechanism(
        "jack",
        [Body("shaft"), Body("nut")],
        joints,
        [Point("tip", "nut", tuple(TIP))],
        [JointAngle("turn", "bearing")],
    )
    found = assert_agrees(mechanism, "turn", TURNS)
    travel = -0.1 / (2.0 * math.pi) * np.array(AXIS) / 3.0
    np.testing.assert_allclose(
        found.points["tip"].position, TIP + np.outer(TURNS, travel), rtol=0, atol=1e-13
    )


@CUTS
def test_a_train_of_gears_with_a_rack(closing):
    """A bearing that names its shaft first has the other sign of rotation. The last wheel slides
    too, as driven.
    """
    cut = ["b", "c", "rail"] if closing else []
    axis, points = (
        (0.0, 0.0, 2.0),
        {"A": (0.1, 0.0, 0.0), "B": (0.6, 0.0, 0.0), "C": (1.0, 0.1, 0.0), "R": (1.0, 0.2, 0.0)},
    )
    joints = [
        Revolute("a", "ground", "A", (0.0, 0.0, 0.0), axis),
        Revolute("b", "B", "ground", (0.4, 0.0, 0.0), axis),
        Cylindrical("c", "ground", "C", (1.0, 0.0, 0.0), axis),
        Translational("rail", "ground", "R", (1.0, 0.2, 0.0), (1.0, 0.0, 0.0)),
    ]
    couplers = [
        Gear("ab", ("b", "a"), 0.5),
        Gear("bc", ("b", "c"), 3.0),
        RackPinion("cr", ("c", "rail"), -0.2),
    ]
    drivers = [JointAngle("turn", "a"), JointDisplacement("shift", "c")]
    mechanism = Mechanism(
        "train",
        [Body(n) for n in points],
        joints,
        [Point(n, n, p) for n, p in points.items()],
        drivers,
        couplers,
    )
    found = assert_agrees(mechanism, "turn", TURNS, cut=cut)
    # b = a / 2 turns B by -a / 2; c = b / 3
    x = {name: motion.position for name, motion in found.points.items()}
    expected = {
        "B": np.stack([0.4 + 0.2 * np.cos(TURNS / 2), -0.2 * np.sin(TURNS / 2), 0 * TURNS], axis=1),
        "C": np.stack([1.0 - 0.1 * np.sin(TURNS / 6), 0.1 * np.cos(TURNS / 6), 0 * TURNS], axis=1),
        "R": np.stack([1.0 - 0.2 * TURNS / 6, 0.2 + 0 * TURNS, 0 * TURNS], axis=1),
    }
    for name, wanted in expected.items():
        np.testing.assert_allclose(x[name], wanted, rtol=0, atol=1e-13)
    assert len(found.details["relations"]) == 3
    assert_agrees(mechanism, "shift", TURNS, cut=cut)


@CUTS
def test_a_steering_gear(closing):
    """The pinion moves the rack, each end of which turns a wheel by a tie rod that cannot spin."""
    joints = [
        Revolute("column", "ground", "pinion", (0.2, 0.1, 0.3), (1.0, 0.2, 0.5)),
        Translational("rail", "rack", "ground", (0.2, 0.0, 0.2), (0.0, 1.0, 0.0)),
    ]
    points = []
    for side in (-1.0, 1.0):
        wheel, rod, inner, outer = (
            f"wheel {side:g}",
            f"rod {side:g}",
            (0.2, 0.35 * side, 0.2),
            (0.15, 0.65 * side, 0.15),
        )
        joints += [
            Revolute(
                f"kingpin {side:g}",
                "ground",
                wheel,
                (0.0, 0.7 * side, 0.1),
                (-0.1, -0.2 * side, 1.0),
            ),
            ConstantVelocity(
                f"inner {side:g}",
                "rack",
                rod,
                inner,
                ((0.0, side, 0.0), tuple(np.subtract(outer, inner))),
            ),
            Spherical(f"outer {side:g}", rod, wheel, outer),
        ]
        points += [
            Point(wheel, wheel, (0.1, 0.8 * side, 0.0)),
            Point(rod, rod, (0.2, 0.5 * side, 0.3)),
        ]
    bodies = [
        Body(name)
        for name in dict.fromkeys(body for joint in joints for body in joint.bodies)
        if name != "ground"
    ]
    mechanism = Mechanism(
        "steering",
        bodies,
        joints,
        points,
        [JointAngle("turn", "column")],
        [RackPinion("gear", ("column", "rail"), 0.008)],
    )
    assert_agrees(mechanism, "turn", np.linspace(-6.0, 6.0, 13), cut=["rail"] if closing else [])


@CUTS
@pytest.mark.parametrize("mirrored", [False, True], ids=["ij", "ji"])
@pytest.mark.parametrize("bend", [0.0, 0.6, 1.5])
def test_a_constant_velocity_joint_keeps_the_velocity(bend, mirrored, closing):
    """Two shafts in bearings, at an angle, over several turns: both have turned alike, which no
    universal joint does.
    """
    # else the bearings carry both shafts, and the joint between them is cut
    cut = [] if closing else ["out"]
    k = (math.cos(bend), 0.6 * math.sin(bend), 0.8 * math.sin(bend))
    joint = ConstantVelocity("joint", "a", "b", (0.0, 0.0, 0.0), ((1.0, 0.0, 0.0), k))
    joints = [
        Revolute("in", "ground", "a", (-0.5, 0.0, 0.0), (1.0, 0.0, 0.0)),
        joint.reversed() if mirrored else joint,
        Revolute("out", "ground", "b", tuple(0.5 * np.array(k)), k),
    ]
    mechanism = Mechanism(
        "shafts",
        [Body("a"), Body("b")],
        joints,
        [Point("tip", "b", tuple(TIP))],
        [JointAngle("turn", "in")],
    )
    found = assert_agrees(mechanism, "turn", TURNS, 2.0, cut)
    assert ("joint" in found.details["closures"]) == closing
    assert_motion(found.points["tip"], *on_screw(TURNS, k, TIP, 0.0, 2.0), atol=TOLERANCES)
