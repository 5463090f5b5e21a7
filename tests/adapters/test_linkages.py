"""Linkages and their drivers in every simulator, against closed forms over whole turns."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck.cases.jet import sqrt, steady
from kincheck.core.joints import Fixed, Revolute, Spherical, Translational
from kincheck.core.mechanism.mechanism import Body
from kincheck.core.mechanism.motions import JointAngle, JointDisplacement, PointCoordinate

from ..support.engine_motion import (
    BOTH_ORDERS,
    C0,
    CRANK_PIN,
    CRANK_RATE,
    CRANK_TURN,
    ENGINES,
    IN_TREE_OR_CUT,
    PERIODIC,
    RSSR,
    SLIDER,
    assert_consistent,
    assert_motion,
    mechanism_of,
    ordered,
    periodic,
    planar,
    rocker,
    rotation,
    slider_crank,
    solved,
    tolerances,
    with_joints,
)
from ..support.mechanisms import ORIGIN, Z, four_bar, four_bar_motion, placed, swapped


@ENGINES
@pytest.mark.parametrize("change", [lambda same: same, swapped], ids=["ij", "ji"])
def test_four_bar_in_tilted_plane(change, engine):
    """Three of the rows are too many."""
    R = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
    tilted = placed(change(four_bar()), lambda P: tuple(R @ P), lambda axis: tuple(R @ axis))
    sign = -1.0 if change is swapped else 1.0
    found = solved(engine, tilted, sign * CRANK_TURN, sign * CRANK_RATE)
    motion = planar(*four_bar_motion(CRANK_TURN, CRANK_RATE))
    expected = (values @ R.T[[0, 2, 1]] for values in motion)
    assert_motion(found.points["C"], *expected, atol=PERIODIC)
    assert found.details["rank"] == found.details["unknowns"]


@ENGINES
@pytest.mark.parametrize("length", [None, 0.78])
def test_rssr_with_given_rod_length(length, engine):
    """A rod of another length than at design moves the rocker before the sweep starts."""
    joints = [*RSSR[:2], replace(RSSR[2], length=length)]
    mechanism = mechanism_of(joints, {"C": ("rocker", C0)}, [JointAngle("crank", "a")])
    found = solved(engine, mechanism, CRANK_TURN, CRANK_RATE).points["C"]
    assert_motion(found, *periodic(rocker(CRANK_PIN, length or 0.76)), atol=PERIODIC)


@pytest.fixture(scope="module")
def peg():
    """Where the peg of the slider-crank goes, with no joint cut or mirrored."""
    return solved("mujoco", slider_crank(), CRANK_TURN, CRANK_RATE).points["peg"].position


@pytest.mark.by_day(3)
@IN_TREE_OR_CUT
@BOTH_ORDERS
@pytest.mark.parametrize("name", ["pivot", "pin", "gudgeon", "guide", "glue"])
def test_slider_crank_joint_mirrored_or_cut(name, closing, mirrored, engine, peg):
    """The driven joint among them; its value keeps its sign when both the bodies and the axis are
    exchanged.
    """
    whole = slider_crank()
    joint = ordered(whole.joint(name), mirrored)
    if mirrored and isinstance(joint, Revolute):
        joint = replace(joint, axis=tuple(-x for x in joint.axis))
    cut = [name] if closing else []
    found = solved(engine, with_joints(whole, joint), CRANK_TURN, CRANK_RATE, cut)
    assert not closing or name in found.details["closures"]
    assert_motion(found.points["slider"], *periodic(SLIDER), atol=PERIODIC)
    assert_motion(found.points["peg"], *periodic(peg), atol=PERIODIC)


# Drivers


@ENGINES
@BOTH_ORDERS
def test_joint_angle_over_turns(mirrored, engine):
    """Of the second body, about an axis that is not a unit vector; an obliquely held forearm with
    a plate goes round.
    """
    axis, P = np.array([0.4, 1.0, -0.7]), np.array([0.7, 0.2, 0.4])
    weld = ("plate", "forearm") if mirrored else ("forearm", "plate")
    joints = [
        ordered(Revolute("first", "ground", "arm", ORIGIN, tuple(axis)), mirrored),
        Revolute("second", "forearm", "arm", (0.3, 0.1, 0.0), (1.0, 0.0, 0.0)),
        Fixed("weld", *weld, (0.2, 0.5, 0.1) if mirrored else None),
    ]
    drivers = [JointAngle("sweep", "first"), JointAngle("hold", "second")]
    mechanism = mechanism_of(joints, {"P": ("plate", P)}, drivers)
    bodies = [
        Body("arm"),
        Body("forearm", (0.1, 0.2, 0.3)),
        Body("plate", (0.7, 0.0, 0.1), (0.5, 0.5, -0.5, 0.5)),
    ]
    turn, sign = np.linspace(-7.0, 15.0, 57), -1.0 if mirrored else 1.0
    found = solved(engine, replace(mechanism, bodies=bodies), turn, 2.0).points["P"]
    h = axis / np.linalg.norm(axis)
    circle = rotation(axis, sign * turn) @ P
    velocity, acceleration = 2.0 * sign * np.cross(h, circle), 4.0 * (P @ h * h - circle)
    assert_motion(found, circle, velocity, acceleration, atol=tolerances(engine))


@ENGINES
def test_point_coordinate_held_constant(engine):
    """Two arms in a row: with the tip's height held, the tip describes a circle."""
    joints = [
        Revolute("shoulder", "ground", "upper", ORIGIN, Z),
        Revolute("elbow", "lower", "upper", (0.4, 0.0, 0.1), (0.0, 1.0, 0.0)),
    ]
    tip, turn = (0.7, 0.0, 0.5), np.linspace(-1.0, 2.0, 7)
    drivers = [JointAngle("turn", "shoulder"), PointCoordinate("hold", "tip", Z)]
    mechanism = mechanism_of(joints, {"tip": ("lower", tip)}, drivers)
    assert_motion(solved(engine, mechanism, turn).points["tip"], rotation(Z, turn) @ tip)


@ENGINES
def test_point_coordinate_along_oblique_direction(engine):
    """A pendulum of radius r is pulled along a direction in its plane; a slider pushed along
    another direction k moves by c / (k . axis).
    """
    r, c, rate = 0.5, np.linspace(-0.2, 0.1, 13), 2.0
    pull = [PointCoordinate("pull", "tip", (3.0, 4.0, 0.0))]
    points = {"tip": ("arm", (r, 0.0, 0.0))}
    mechanism = mechanism_of([replace(RSSR[0], j="arm")], points, pull)
    motion = solved(engine, mechanism, c, rate).points["tip"]
    along = steady(0.6 * r + c, rate)
    across = -sqrt(r * r - along * along)
    expected = planar(0.6 * along - 0.8 * across, 0.8 * along + 0.6 * across)
    assert_motion(motion, *expected, atol=tolerances(engine))
    axis, k, P = np.array([0.4, 1.0, -0.7]), np.array([3.0, 2.0, 1.0]), (0.5, 0.6, 0.1)
    slide = Translational("slide", "ground", "B", (0.2, -0.1, 0.3), tuple(axis))
    push = [PointCoordinate("push", "P", tuple(k))]
    found = solved(engine, mechanism_of([slide], {"P": ("B", P)}, push), c).points["P"]
    assert_motion(found, P + c[:, None] * axis / (k / np.linalg.norm(k) @ axis))


@ENGINES
@BOTH_ORDERS
def test_joint_displacement_of_turning_cylinder(mirrored, engine):
    """An arm on a hinge at the origin, pushed by a cylinder hinged at D: the law of cosines gives
    the arm's angle.
    """
    D, arm, start = np.array([0.6, -0.2, 0.0]), 0.5, 0.9
    tip = arm * np.array([math.cos(start), math.sin(start), 0.0])
    length, base = float(np.linalg.norm(tip - D)), float(np.linalg.norm(D))
    joints = [
        Revolute("hinge", "ground", "arm", ORIGIN, Z),
        Revolute("foot", "ground", "cylinder", tuple(D), Z),
        Translational("piston", "cylinder", "rod", tuple(D), tuple(tip - D)),
        Spherical("pin", "rod", "arm", tuple(tip)),
    ]
    values, rate, sign = np.linspace(-0.1, 0.1, 51), 2.0, -1.0 if mirrored else 1.0
    mechanism = mechanism_of(
        [ordered(joint, mirrored) for joint in joints],
        {"tip": ("rod", tip), "away": ("rod", (0.1, 0.2, 0.3))},
        [JointDisplacement("push", "piston")],
    )
    found = solved(engine, mechanism, sign * values, sign * rate).points
    now = steady(length + values, rate)
    cosine = (arm**2 + base**2 - now * now) / (2.0 * arm * base)
    sine, (x, y, _) = sqrt(1.0 - cosine * cosine), arm / base * D
    expected = planar(x * cosine - y * sine, y * cosine + x * sine)
    assert_motion(found["tip"], *expected, atol=(2e-14, *tolerances(engine)[1:]))
    assert_consistent(found["away"], (values[1] - values[0]) / rate)
