"""Exudyn's adapter against closed forms, a published strut solved elsewhere, and differences of its
own positions.
"""

import importlib
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from kincheck.adapters.exudyn.exudyn import Exudyn
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.joints import Distance, Fixed, Revolute, Spherical, Translational, Universal
from kincheck.core.mechanism.drivers import Driver, JointAngle, JointDisplacement, PointCoordinate
from kincheck.core.mechanism.mechanism import Body, Mechanism, Point

pytest.importorskip("exudyn")

TOL = 1e-12
# Positions are held to 1e-14: round-off 1e-16 times the condition of these mechanisms, about 25.
# Velocities have ten times that; accelerations rest on differences of the Jacobian (see
# DIFFERENCES) and have 1e-12 times the speed squared.
FULL_TURN = np.linspace(0.0, 2.0 * np.pi, 73)


def case_of(bodies, joints, points, drivers, values, rate=1.0, design=0.0):
    """A case that sweeps the first driver and asks for all points; points: name -> (body,
    position).
    """
    places = [Point(name, body, tuple(position)) for name, (body, position) in points.items()]
    mechanism = Mechanism(
        "m",
        [body if isinstance(body, Body) else Body(body) for body in bodies],
        joints,
        places,
        drivers,
    )
    outputs = tuple(Output(name, name, (1.0, 0.0, 0.0), False, 1e-9, 0.0, "") for name in points)
    sweep = Sweep(drivers[0].name, np.asarray(values, dtype=float), rate, design)
    return Case("m", "test", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs)


def solve(case):
    assert Exudyn().unsupported(case) is None
    return Exudyn().solve(Exudyn().build(case), case, TOL)


def solved(case):
    """The motion of the case's points, by name; every sample must be there."""
    trajectory = solve(case)
    assert trajectory.solved.all(), trajectory.message
    assert trajectory.residual <= TOL
    return trajectory.points


def turned(joints, reverse):
    return [joint.reversed() for joint in joints] if reverse else joints


def tilt():
    """A rotation matrix far from all axes."""
    axis, angle = np.array([3.0, 4.0, 5.0]) / math.sqrt(50.0), 0.7
    S = np.cross(np.eye(3), -axis)
    return np.eye(3) + math.sin(angle) * S + (1.0 - math.cos(angle)) * S @ S


def assert_consistent(motion, dt):
    """Velocity and acceleration against eighth-order differences over uniform samples."""
    weights = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])
    n = len(motion.position)
    for values, derivative in (
        (motion.position, motion.velocity),
        (motion.velocity, motion.acceleration),
    ):
        found = (
            sum(
                w * (values[4 + k : n - 4 + k] - values[4 - k : n - 4 - k])
                for k, w in enumerate(weights, 1)
            )
            / dt
        )
        # differences: round-off 1e-16 / dt of values about 1, times the mechanism's amplification
        assert np.abs(found - derivative[4:-4]).max() <= 1e-10 * (1.0 + np.abs(derivative).max())


# The strut of SAE 943745, Tables 4 and 5: stroke, x, y, vx, vy, ax, ay of the wheel centre, solved
# in 40 digits in two ways.
STRUT = """
-0.08 0.97842168471408306 0.70460211685198040 -0.054481022483195316 0.24805044455095479 0.29813886646731178 -3.1424653530748702
0.0 0.975 0.715 -0.031003511378626193 0.017471831311365218 0.30211302579786471 -2.7188261285528537
0.06 0.97370967558646865 0.71118281263366510 -0.011452786334599021 -0.14495967106551738 0.35783512574344430 -2.7454181124862098
0.08 0.97355412312042348 0.70772961924558403 -0.0039997890548572158 -0.20064514629978514 0.38865414362756019 -2.8313008695458348
"""  # noqa: E501
ROD = ((1.115, 0.665, 0.118), (1.14, 0.355, 0.1455))


def strut(values, direction=(0.0, 0.0, 1.0), reverse=False, rate=1.0, design=0.0, rod_length=None):
    bodies = [
        Body("rack", (1.14, 0.0, 0.1455), fixed=True),
        "lca",
        Body("knuckle", (0.975, 0.715, 0.101)),
        "strut",
    ]
    joints = [
        Revolute("pivot", "ground", "lca", (1.17, 0.353, 0.005), (1.0, 0.0, 0.0)),
        Spherical("ball", "lca", "knuckle", (0.9676, 0.66, -0.01)),
        Translational("slide", "knuckle", "strut", (0.97772, 0.605, 0.18), (0.02228, -0.055, 0.42)),
        Spherical("top", "strut", "ground", (1.0, 0.55, 0.6)),
        Distance("rod", "knuckle", "rack", ROD, rod_length),
    ]
    points = {
        "wheel": ("knuckle", (0.975, 0.715, 0.101)),
        "rod_end": ("knuckle", ROD[0]),
        "rack": ("rack", (1.14, 0.0, 0.1)),
    }
    driver = PointCoordinate("stroke", "wheel", direction)
    return case_of(bodies, turned(joints, reverse), points, [driver], values, rate, design)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize("rate", [1.0, -40.0])
def test_strut_agrees_with_a_solution_in_40_digits(reverse, rate):
    table = np.array([line.split() for line in STRUT.strip().splitlines()], dtype=float)
    found = solved(strut(np.linspace(-0.08, 0.08, 41), reverse=reverse, rate=rate))
    for motion in found.values():
        assert_consistent(motion, 4e-3 / rate)
    wheel = found["wheel"]
    at = np.rint((table[:, 0] + 0.08) / 4e-3).astype(int)
    assert np.abs(wheel.position[at, :2] - table[:, 1:3]).max() <= 1e-14
    assert np.abs(wheel.velocity[at, :2] / rate - table[:, 3:5]).max() <= 1e-13
    assert np.abs(wheel.acceleration[at, :2] / rate**2 - table[:, 5:]).max() <= 2e-12
    assert np.abs(wheel.velocity[:, 2] - rate).max() <= 1e-13 * abs(rate)
    assert (found["rack"].position == [1.14, 0.0, 0.1]).all()


def test_any_direction_can_be_driven():
    direction, values = np.array([0.2, -0.3, 2.0]), np.linspace(-0.05, 0.05, 26)
    points = solved(strut(0.7 + values, tuple(direction), rate=3.0, design=0.7))
    along = (
        (points["wheel"].position - [0.975, 0.715, 0.101]) @ direction / np.linalg.norm(direction)
    )
    assert np.abs(along - values).max() <= 1e-14
    for motion in points.values():
        assert_consistent(motion, (values[1] - values[0]) / 3.0)


def test_unreachable_stroke_ends_with_a_message():
    case = strut([*np.linspace(-0.01, 0.28, 30), *np.linspace(0.281, 0.3, 20), 0.6])
    trajectory = solve(case)
    last = np.flatnonzero(trajectory.solved)[-1]
    assert trajectory.solved[: last + 1].all()
    assert case.sweep.values[last] == pytest.approx(0.293)
    assert "last reachable sample at stroke = 0.293;" in trajectory.message
    assert np.isfinite(trajectory.points["wheel"].acceleration[: last + 1]).all()
    assert np.isnan(trajectory.points["wheel"].position[last + 1 :]).all()


def test_solving_again_gives_the_same_numbers_even_after_a_failure():
    engine, case, far = (
        Exudyn(),
        strut(np.linspace(-0.08, 0.08, 17)),
        strut(np.linspace(0.0, 0.6, 61)),
    )
    model = engine.build(case)
    first = engine.solve(model, case, TOL)
    assert not engine.solve(model, far, TOL).solved.all()
    again = engine.solve(model, case, TOL)
    for kind in ("position", "velocity", "acceleration"):
        assert (getattr(first.points["wheel"], kind) == getattr(again.points["wheel"], kind)).all()


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


def test_rod_of_another_length_than_at_design():
    end = solved(strut([-0.01, 0.0, 0.01], rod_length=0.31))["rod_end"].position
    assert np.abs(np.linalg.norm(end - ROD[1], axis=1) - 0.31).max() <= 1e-14


def test_a_short_rod_takes_shorter_differences():
    """A slide x drives a slide y by a rod of 4 mm: y y = L L - x x, in a mechanism of one metre.

    The rod turns by a quarter while the slides go 3 mm, so differences over 1 mm are off by 1e-6.
    """
    length, x = 0.004, np.linspace(0.0, 0.0035, 8)
    joints = [
        Translational("a", "ground", "first", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        Translational("b", "ground", "second", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
        Distance("rod", "first", "second", ((0.0, 0.0, 0.0), (0.0, length, 0.0))),
    ]
    driver = PointCoordinate("x", "start", (1.0, 0.0, 0.0))
    points = {"start": ("first", (0.0, 0.0, 0.0)), "end": ("second", (0.0, length, 0.0))}
    end = solved(case_of(["first", "second"], joints, points, [driver], x))["end"]
    y = np.sqrt(length**2 - x**2)
    expected = -1.0 / y - x**2 / y**3
    assert np.abs(end.acceleration[:, 1] / expected - 1.0).max() <= 1e-10


def test_a_pose_that_exudyn_refuses_is_no_crash():
    """A diverged iteration gives a rod no length in Exudyn's arithmetic, which then raises."""
    joints = [
        Spherical("a", "ground", "first", (0.0, 0.0, 0.0)),
        Spherical("b", "ground", "second", (1.0, 0.0, 0.0)),
        Distance("rod", "first", "second", ((0.0, 0.5, 0.0), (1.0, 0.5, 0.0))),
    ]
    driver = PointCoordinate("x", "tip", (1.0, 0.0, 0.0))
    case = case_of(["first", "second"], joints, {"tip": ("first", (0, 0.5, 0))}, [driver], [0.0])
    model = Exudyn().build(case)
    model.move(np.full(model.unknowns, 1e25))
    assert np.isnan(model.residual(np.zeros(1))).all()
    model.reset()
    assert np.abs(model.residual(np.zeros(1))).max() < TOL


def test_nothing_is_printed_and_no_file_is_written(capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # the failure that Exudyn is loudest about
    assert not solve(strut(np.linspace(0.0, 0.6, 61))).solved.all()
    assert capfd.readouterr() == ("", "")
    assert list(Path(tmp_path).iterdir()) == []


class Ratchet(Revolute):
    """A subclass of a known joint that means something else."""


@dataclass(frozen=True)
class Wobble(Driver):
    type = "wobble"


def test_unknown_joints_and_drivers_are_unsupported_by_name():
    case = strut([0.0])
    ratchet = Ratchet("pawl", "ground", "knuckle", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    for change, who in (
        ({"joints": [ratchet]}, "'pawl'"),
        ({"drivers": [Wobble("shaker")]}, "'shaker' (wobble)"),
    ):
        assert who in (
            Exudyn().unsupported(replace(case, mechanism=replace(case.mechanism, **change))) or ""
        )


@pytest.mark.parametrize("error", [ImportError, RuntimeError, OSError])
def test_version_is_none_when_the_import_fails(monkeypatch, error):
    assert Exudyn().version() == importlib.import_module("exudyn").__version__

    def broken(name):
        raise error(name)

    monkeypatch.setattr(importlib, "import_module", broken)
    assert Exudyn().version() is None
