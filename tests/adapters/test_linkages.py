"""Linkages and their drivers in every simulator, against closed forms over whole turns."""

import math
from dataclasses import replace

import numpy as np
import pytest
from kincheck.core.joints import Distance, Fixed, Revolute, Spherical, Translational
from kincheck.core.mechanism.mechanism import Body
from kincheck.core.mechanism.motions import JointAngle, JointDisplacement, PointCoordinate
from numpy.polynomial import Chebyshev

from ..support.engine_motion import (
    B0,
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
    periodic,
    rocker,
    rotation,
    slider_crank,
    solved,
    tolerances,
    with_joints,
)

BOTH_ORDERS = pytest.mark.parametrize("mirrored", [False, True], ids=["ij", "ji"])
Z = (0.0, 0.0, 1.0)


def ordered(joint, mirrored):
    return joint.reversed() if mirrored else joint


def four_bar(angle):
    """B and C of a four-bar of ground 1, crank 0.3, coupler 0.9, rocker 0.8; C lies on two circles,
    above the line B-D.
    """
    B = 0.3 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    e = np.array([1.0, 0.0, 0.0]) - B
    s = np.linalg.norm(e, axis=1, keepdims=True)
    along = (s**2 + 0.9**2 - 0.8**2) / (2 * s)
    return B, B + along * e / s + np.sqrt(0.9**2 - along**2) * np.cross([0.0, 0.0, 1.0], e) / s


@ENGINES
@BOTH_ORDERS
def test_four_bar_in_tilted_plane(mirrored, engine):
    """Three of the rows are too many."""
    R = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
    (B,), (C,) = (x @ R for x in four_bar(np.array([0.6])))
    places = {
        "A": ("ground", "crank", 0 * B),
        "B": ("crank", "coupler", B),
        "C": ("coupler", "rocker", C),
        "D": ("ground", "rocker", R[0]),
    }
    joints = [
        ordered(Revolute(name, i, j, tuple(point), tuple(R[2])), mirrored)
        for name, (i, j, point) in places.items()
    ]
    points = {"B": ("crank", B), "C": ("coupler", C), "C of the rocker": ("rocker", C)}
    mechanism = mechanism_of(joints, points, [JointAngle("crank", "A")])
    sign = -1.0 if mirrored else 1.0
    found = solved(engine, mechanism, sign * CRANK_TURN, sign * CRANK_RATE)
    pins = [periodic(x @ R) for x in four_bar(CRANK_TURN + 0.6)]
    for motion, expected in zip(found.points.values(), [*pins, pins[1]], strict=True):
        assert_motion(motion, *expected, atol=PERIODIC)
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


@ENGINES
def test_rods_move_body_as_arms(engine):
    """Two rods to one ball do what an arm on a revolute does."""
    balls = {
        "upper": ((-0.1, 0.4, 0.3), (0.2, 0.4, 0.3), (0.0, 0.7, 0.3)),
        "lower": ((-0.1, 0.3, -0.1), (0.2, 0.35, -0.1), (0.05, 0.8, -0.1)),
    }
    tie = Distance("tie", "knuckle", "ground", ((0.2, 0.7, 0.0), (0.2, 0.4, 0.02)))
    rods, arms = [tie], [tie]
    for name, (front, rear, ball) in balls.items():
        rods += [
            Distance(f"{name} {k}", "ground", "knuckle", (foot, ball))
            for k, foot in enumerate((front, rear))
        ]
        arms += [Revolute(f"{name} pivot", "ground", name, front, tuple(np.subtract(rear, front)))]
        arms += [Spherical(f"{name} ball", name, "knuckle", ball)]
    points = {"hub": ("knuckle", (0.0, 0.8, 0.1))}
    stroke = [PointCoordinate("stroke", "hub", (0.0, 0.1, 1.0))]
    on_rods, on_arms = (
        solved(engine, mechanism_of(joints, points, stroke), np.linspace(-0.08, 0.08, 9))
        for joints in (rods, arms)
    )
    hub = on_arms.points["hub"]
    expected = hub.position, hub.velocity, hub.acceleration
    assert_motion(on_rods.points["hub"], *expected, atol=tolerances(engine))


@ENGINES
def test_five_rods_keep_lengths(engine):
    """One rod is longer than the distance of its points at design."""
    ends = [
        ((0.1, 0.8, 0.25), (0.0, 0.4, 0.3)),
        ((0.15, 0.8, 0.25), (0.3, 0.4, 0.3)),
        ((0.1, 0.9, -0.2), (-0.1, 0.4, -0.2)),
        ((0.15, 0.9, -0.2), (0.4, 0.4, -0.2)),
        ((-0.1, 0.85, 0.02), (-0.3, 0.5, 0.0), 0.4),
    ]
    rods = [Distance(f"rod {k}", "B", "ground", each[:2], *each[2:]) for k, each in enumerate(ends)]
    points = {f"P{k}": ("B", each[0]) for k, each in enumerate(ends)}
    mechanism = mechanism_of(rods, points, [PointCoordinate("lift", "P0", (0.0, 0.2, 1.0))])
    mechanism = replace(mechanism, bodies=[Body("B", (0.1, 0.9, 0.0)), Body("frame", fixed=True)])
    found = solved(engine, mechanism, 0.0025 * np.arange(-16, 17))
    for k, rod in enumerate(rods):
        now = np.linalg.norm(found.points[f"P{k}"].position - ends[k][1], axis=1)
        np.testing.assert_allclose(now, rod.rod_length, rtol=0, atol=1e-14)
    for motion in found.points.values():
        assert_consistent(motion, 0.0025)


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
        ordered(Revolute("first", "ground", "arm", (0.0, 0.0, 0.0), tuple(axis)), mirrored),
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
        Revolute("shoulder", "ground", "upper", (0.0, 0.0, 0.0), Z),
        Revolute("elbow", "lower", "upper", (0.4, 0.0, 0.1), (0.0, 1.0, 0.0)),
    ]
    tip, turn = (0.7, 0.0, 0.5), np.linspace(-1.0, 2.0, 7)
    drivers = [JointAngle("turn", "shoulder"), PointCoordinate("hold", "tip", Z)]
    mechanism = mechanism_of(joints, {"tip": ("lower", tip)}, drivers)
    assert_motion(solved(engine, mechanism, turn).points["tip"], rotation(Z, turn) @ tip)


@ENGINES
def test_unswept_driver_holds_joint(engine):
    """The RSSR's rocker on a slide that is held."""
    slide = Translational("slide", "carriage", "ground", (0.0, 0.0, 0.0), (1.0, 1.0, 0.0))
    drivers = [JointAngle("crank", "a"), JointDisplacement("hold", "slide")]
    joints = [RSSR[0], replace(RSSR[1], j="carriage"), RSSR[2], slide]
    mechanism = mechanism_of(joints, {"C": ("rocker", C0)}, drivers)
    found = solved(engine, mechanism, CRANK_TURN, CRANK_RATE).points["C"]
    assert_motion(found, *periodic(rocker(CRANK_PIN, 0.76)), atol=PERIODIC)


@ENGINES
def test_point_coordinate_along_oblique_direction(engine):
    """r cos(t - t_d) = c: a pendulum of radius r pulled along the direction t_d in its plane; a
    slider pushed along another direction k moves by c / (k . axis).
    """
    r, t_d, c, rate = 0.5, math.atan2(4.0, 3.0), np.linspace(-0.2, 0.1, 13), 2.0
    pull = [PointCoordinate("pull", "tip", (3.0, 4.0, 0.0))]
    points = {"tip": ("arm", (r, 0.0, 0.0))}
    mechanism = mechanism_of([replace(RSSR[0], j="arm")], points, pull)
    motion = solved(engine, mechanism, c, rate).points["tip"]
    s = -np.arccos((r * math.cos(t_d) + c) / r)[:, None]
    e, n = (
        np.cos(s + t_d + k) * [1, 0, 0] + np.sin(s + t_d + k) * [0, 1, 0]
        for k in (0.0, math.pi / 2)
    )
    s_t = -rate / (r * np.sin(s))
    expected = r * e, r * s_t * n, -r * s_t**2 * (n / np.tan(s) + e)
    assert_motion(motion, *expected, atol=tolerances(engine))
    axis, k, P = np.array([0.4, 1.0, -0.7]), np.array([3.0, 2.0, 1.0]), (0.5, 0.6, 0.1)
    slide = Translational("slide", "ground", "B", (0.2, -0.1, 0.3), tuple(axis))
    push = [PointCoordinate("push", "P", tuple(k))]
    found = solved(engine, mechanism_of([slide], {"P": ("B", P)}, push), c).points["P"]
    assert_motion(found, P + c[:, None] * axis / (k / np.linalg.norm(k) @ axis))


@ENGINES
@BOTH_ORDERS
def test_joint_displacement_drives_rssr(mirrored, engine):
    """A slider, named second or first of its joint, pushes the rocker of the RSSR by the rod."""
    h, values, rate = np.array([2.0, 1.0, -2.0]) / 3.0, np.linspace(-0.05, 0.05, 9), 0.5
    guide = Translational("guide", "ground", "slider", (0.0, 0.0, 0.0), tuple(3.0 * h))
    joints = [ordered(guide, mirrored), RSSR[1], replace(RSSR[2], i="slider")]
    drivers, sign = [JointDisplacement("push", "guide")], -1.0 if mirrored else 1.0
    mechanism = mechanism_of(joints, {"C": ("rocker", C0)}, drivers)
    # interpolated on twice the range: at its ends the derivatives are poor
    fit = [
        Chebyshev.interpolate(
            lambda s, k=k: rocker(B0 + sign * np.outer(s, h), 0.76)[:, k], 40, [-0.1, 0.1]
        )
        for k in range(3)
    ]
    expected = (rate**n * np.column_stack([x.deriv(n)(values) for x in fit]) for n in range(3))
    assert_motion(solved(engine, mechanism, values, rate).points["C"], *expected, atol=PERIODIC)


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
        Revolute("hinge", "ground", "arm", (0.0, 0.0, 0.0), Z),
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
    cosine = (arm**2 + base**2 - (length + values) ** 2) / (2.0 * arm * base)
    angle = np.arccos(cosine) + math.atan2(D[1], D[0])
    path = arm * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    assert_motion(found["tip"], path, atol=(2e-14,))
    for motion in found.values():
        assert_consistent(motion, (values[1] - values[0]) / rate)
