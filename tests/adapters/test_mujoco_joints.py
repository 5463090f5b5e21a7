"""Every joint type in MuJoCo, in its tree and closing a loop, against the native solver and closed
forms.
"""

import math

import numpy as np
import pytest
from kincheck.core import Body, JointAngle, JointDisplacement, Mechanism, Point
from kincheck.core.joints import (
    ConstantVelocity,
    Cylindrical,
    Revolute,
    Screw,
)

from ..support.joint_loops import (
    RATE,
    TOO_LOOSE,
    TURN,
    TYPES,
    assert_moves_natively,
    on_crank,
)
from ..support.mujoco_agreement import AXIS, CUTS, TIP, TOLERANCES, TURNS, assert_agrees, solved
from ..support.mujoco_cases import assert_motion

pytest.importorskip("mujoco", reason="MuJoCo is not installed")


@pytest.mark.parametrize("closing", [False, True], ids=["tree", "cut"])
@pytest.mark.parametrize("bodies", [("A", "B"), ("B", "A")], ids=["ij", "ji"])
@pytest.mark.parametrize("kind", TYPES)
def test_joint_moves_as_natively(kind, bodies, closing):
    found = solved(on_crank(kind, *bodies), "turn", TURN, RATE, ["tested"] if closing else [])
    assert ("tested" in found.details["closures"]) == (closing or kind in TOO_LOOSE)
    assert_moves_natively(found, kind, bodies)


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
