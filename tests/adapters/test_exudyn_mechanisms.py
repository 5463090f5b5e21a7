"""Exudyn's adapter against closed forms of linkages, shafts and arms over whole turns."""

import math

import numpy as np
import pytest
from kincheck.core.joints import Distance, Fixed, Revolute, Spherical, Translational, Universal
from kincheck.core.mechanism.mechanism import Body
from kincheck.core.mechanism.motions import JointAngle, JointDisplacement

from ..support.exudyn_cases import assert_consistent, case_of, solved, turned

pytest.importorskip("exudyn")


# Positions are held to 1e-14: round-off 1e-16 times the condition of these mechanisms, about 25.
# Velocities have ten times that; accelerations rest on differences of the Jacobian (see
# DIFFERENCES) and have 1e-12 times the speed squared.
FULL_TURN = np.linspace(0.0, 2.0 * np.pi, 73)


def tilt():
    """A rotation matrix far from all axes."""
    axis, angle = np.array([3.0, 4.0, 5.0]) / math.sqrt(50.0), 0.7
    S = np.cross(np.eye(3), -axis)
    return np.eye(3) + math.sin(angle) * S + (1.0 - math.cos(angle)) * S @ S


@pytest.mark.parametrize("reverse", [False, True])
def test_tilted_fourbar_of_four_revolutes_over_a_turn(reverse):
    """Crank 0.3, coupler 0.9, rocker 0.6 on a base of 1; C is where the circles about B and D
    meet.
    """
    R, start = tilt(), 0.3

    def pins(angle):
        B = 0.3 * np.exp(1j * angle)
        base = np.abs(1.0 - B)
        cosine = (0.9**2 - 0.6**2 + base**2) / (2.0 * 0.9 * base)
        C = B + 0.9 * (1.0 - B) / base * np.exp(1j * np.arccos(cosine))
        return [np.stack([P.real, P.imag, 0.0 * angle], axis=1) @ R.T for P in (B, C)]

    (B,), (C,) = pins(np.array([start]))
    D, axis = R @ [1.0, 0.0, 0.0], tuple(R @ [0.0, 0.0, 1.0])
    joints = [
        Revolute("A", "ground", "crank", (0.0, 0.0, 0.0), axis),
        Revolute("B", "crank", "coupler", tuple(B), axis),
        Revolute("C", "coupler", "rocker", tuple(C), axis),
        Revolute("D", "rocker", "ground", tuple(D), axis),
    ]
    points = {"B": ("crank", B), "C": ("coupler", C), "C2": ("rocker", C)}
    sign = -1.0 if reverse else 1.0
    case = case_of(
        ["crank", "coupler", "rocker"],
        turned(joints, reverse),
        points,
        [JointAngle("t", "A")],
        sign * FULL_TURN,
    )
    found = solved(case)
    for name, P in zip(points, [*pins(start + FULL_TURN), pins(start + FULL_TURN)[1]], strict=True):
        assert np.abs(found[name].position - P).max() <= 1e-14


def test_rssr_over_a_turn():
    arm, axis_x, reach = 0.1, np.array([0.6, 0.3, 0.1]), 0.4
    B = arm * np.stack([np.cos(FULL_TURN), np.sin(FULL_TURN), 0.0 * FULL_TURN], axis=1)
    C0 = axis_x + [0.0, 0.0, reach]
    rod = math.dist(B[0], C0)
    # |C - B|^2 = rod^2 with C = axis_x + reach (0, -sin f, cos f) is  a cos f + b sin f = c
    u = axis_x - B
    a, b, c = 2.0 * reach * u[:, 2], -2.0 * reach * u[:, 1], rod**2 - reach**2 - (u**2).sum(axis=1)
    branches = [np.arctan2(b, a) + s * np.arccos(c / np.hypot(a, b)) for s in (1.0, -1.0)]
    f = min(branches, key=lambda angle: abs(angle[0]))
    C = axis_x + reach * np.stack([0.0 * f, -np.sin(f), np.cos(f)], axis=1)
    joints = [
        Revolute("A", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 2.0)),
        Revolute("D", "ground", "rocker", tuple(axis_x), (1.0, 0.0, 0.0)),
        Distance("rod", "crank", "rocker", (tuple(B[0]), tuple(C0))),
    ]
    case = case_of(
        ["crank", "rocker"], joints, {"C": ("rocker", C0)}, [JointAngle("t", "A")], FULL_TURN
    )
    assert np.abs(solved(case)["C"].position - C).max() <= 1e-14


@pytest.mark.parametrize("reverse", [False, True])
def test_angle_driven_two_and_a_half_turns(reverse):
    rate, values = 6.0, np.linspace(-np.pi, 5.0 * np.pi, 61)
    joints = turned([Revolute("A", "ground", "arm", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))], reverse)
    P = solved(
        case_of(
            ["arm"], joints, {"P": ("arm", (1.0, 0.0, 0.5))}, [JointAngle("t", "A")], values, rate
        )
    )["P"]
    t, w, zero = (-values, -rate, 0.0 * values) if reverse else (values, rate, 0.0 * values)
    assert np.abs(P.position - np.stack([np.cos(t), np.sin(t), zero + 0.5], axis=1)).max() <= 1e-14
    assert np.abs(P.velocity - w * np.stack([-np.sin(t), np.cos(t), zero], axis=1)).max() <= 1e-13
    assert (
        np.abs(P.acceleration + w**2 * np.stack([np.cos(t), np.sin(t), zero], axis=1)).max()
        <= 1e-10
    )


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("rounding", [0.0, 8e-3])
def test_universal_joint_turns_as_hooke_found(reverse, rounding):
    """Shaft 1 along x, shaft 2 at angle b to it; the cross holds the angle of its arms, rounded or
    not.
    """
    b, values = 0.6, np.linspace(0.0, np.pi, 145)
    first, second = np.array([0.0, 0.0, 1.0]), np.array([-math.sin(b), math.cos(b), rounding])
    joints = [
        Revolute("in", "ground", "driving", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        Revolute("out", "ground", "driven", (0.0, 0.0, 0.0), (math.cos(b), math.sin(b), 0.0)),
        *turned(
            [
                Universal(
                    "cross", "driving", "driven", (0.0, 0.0, 0.0), (tuple(first), tuple(second))
                )
            ],
            reverse,
        ),
    ]
    tip = second / np.linalg.norm(second)
    points = {"first": ("driving", first), "second": ("driven", tip)}
    found = solved(
        case_of(["driving", "driven"], joints, points, [JointAngle("t", "in")], values, 6.0)
    )
    cosine = (found["first"].position * found["second"].position).sum(axis=1)
    assert np.abs(cosine - tip @ first).max() <= 1e-14
    for motion in found.values():
        assert_consistent(motion, (values[1] - values[0]) / 6.0)
    if rounding == 0.0:
        angle = np.arctan2(np.sin(values) * math.cos(b), np.cos(values))
        path = np.outer(np.cos(angle), tip) + np.outer(np.sin(angle), [0.0, 0.0, 1.0])
        assert np.abs(found["second"].position - path).max() <= 1e-14


@pytest.mark.parametrize("reverse", [False, True])
def test_displacement_of_a_cylinder_that_turns(reverse):
    """An arm on a hinge at the origin, pushed by a cylinder hinged at D: the law of cosines gives
    the arm's angle.
    """
    D, arm, start = np.array([0.6, -0.2, 0.0]), 0.5, 0.9
    tip = arm * np.array([math.cos(start), math.sin(start), 0.0])
    length, base = float(np.linalg.norm(tip - D)), float(np.linalg.norm(D))
    joints = [
        Revolute("hinge", "ground", "arm", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        Revolute("foot", "ground", "cylinder", tuple(D), (0.0, 0.0, 1.0)),
        Translational("piston", "cylinder", "rod", tuple(D), tuple(tip - D)),
        Spherical("pin", "rod", "arm", tuple(tip)),
    ]
    values, rate, sign = np.linspace(-0.1, 0.1, 51), 2.0, -1.0 if reverse else 1.0
    bodies, points = (
        ["arm", "cylinder", "rod"],
        {"tip": ("rod", tip), "away": ("rod", (0.1, 0.2, 0.3))},
    )
    drivers = [JointDisplacement("push", "piston")]
    found = solved(
        case_of(bodies, turned(joints, reverse), points, drivers, sign * values, sign * rate)
    )
    angle = np.arccos(
        (arm**2 + base**2 - (length + values) ** 2) / (2.0 * arm * base)
    ) + math.atan2(D[1], D[0])
    path = arm * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    assert np.abs(found["tip"].position - path).max() <= 1e-14
    for motion in found.values():
        assert_consistent(motion, (values[1] - values[0]) / rate)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("point", [None, (0.2, 0.5, 0.1)])
def test_fixed_joint_and_a_driver_that_holds(reverse, point):
    """Two arms in a row; the second angle is held, so a plate fixed to the second arm circles the
    first hinge.
    """
    axis = tuple(tilt()[:, 2])
    arms = [
        Revolute("first", "ground", "arm", (0.0, 0.0, 0.0), axis),
        Revolute("second", "arm", "forearm", (0.3, 0.1, 0.0), (1.0, 0.0, 0.0)),
        Fixed("weld", *(("plate", "forearm") if reverse else ("forearm", "plate")), point),
    ]
    P, values = np.array([0.7, 0.2, 0.4]), np.linspace(-3.0, 3.0, 13)
    drivers = [JointAngle("sweep", "first"), JointAngle("hold", "second")]
    bodies = [
        Body("arm"),
        Body("forearm", (0.1, 0.2, 0.3)),
        Body("plate", (0.7, 0.0, 0.1), (0.5, 0.5, -0.5, 0.5)),
    ]
    motion = solved(case_of(bodies, arms, {"P": ("plate", P)}, drivers, values, 2.0))["P"]
    along = axis @ P * np.array(axis)
    circle = (
        along + np.outer(np.cos(values), P - along) + np.outer(np.sin(values), np.cross(axis, P))
    )
    assert np.abs(motion.position - circle).max() <= 1e-14
    assert np.abs(motion.velocity - 2.0 * np.cross(axis, circle)).max() <= 1e-13
    assert np.abs(motion.acceleration + 4.0 * (circle - along)).max() <= 1e-11
