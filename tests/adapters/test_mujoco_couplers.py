"""Gears, racks and threads in MuJoCo, in its tree and closing loops, against the native
solver and closed forms.
"""

import math

import numpy as np
import pytest
from kincheck.core import Body, JointAngle, JointDisplacement, Mechanism, Point
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

from ..support.mujoco_agreement import AXIS, CUTS, TIP, TURNS, assert_agrees

pytest.importorskip("mujoco", reason="MuJoCo is not installed")


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
