"""The MuJoCo adapter against closed forms, a published strut, and itself with the loops cut
elsewhere.
"""

import ctypes
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from kincheck.adapters.mujoco import mujoco as adapter
from kincheck.core.case.case import Case, Output, Sweep, Truth
from kincheck.core.joints import (
    Distance,
    Fixed,
    Joint,
    Revolute,
    Spherical,
    Translational,
    Universal,
)
from kincheck.core.mechanism.drivers import Driver, JointAngle, JointDisplacement, PointCoordinate
from kincheck.core.mechanism.mechanism import Body, Mechanism, Point
from numpy.polynomial import Chebyshev

pytest.importorskip("mujoco", reason="MuJoCo is not installed")

TOL = 1e-12
RATE = 3.0
# One crank turn, the last sample left out: periodic, so that differentiation by FFT is exact to
# round-off.
TURN = np.linspace(-math.pi, math.pi, 100, endpoint=False)


def case(joints, points, drivers, values, rate=1.0, design=0.0, fixed=()):
    """Bodies are those of the joints; points: name -> (body, position); the first driver is
    swept.
    """
    bodies = dict.fromkeys(body for joint in joints for body in joint.bodies if body != "ground")
    places = [Point(name, *place) for name, place in points.items()]
    mechanism = Mechanism(
        "test", [Body(name, fixed=name in fixed) for name in bodies], joints, places, drivers
    )
    outputs = tuple(Output(name, name, (1.0, 0.0, 0.0), False, 1e-9, 0.0, "") for name in points)
    return Case(
        "test",
        "test",
        Truth.CONSENSUS_ONLY,
        mechanism,
        Sweep(drivers[0].name, np.array(values), rate, design),
        outputs,
    )


def change(case, *joints, **others):
    """The case with joints added in front, instead of those of the same names."""
    kept = [
        each for each in case.mechanism.joints if each.name not in {joint.name for joint in joints}
    ]
    return replace(case, mechanism=replace(case.mechanism, joints=(*joints, *kept), **others))


def solve(case, complete=True):
    """Solved twice with one model, to the same numbers; complete: every sample is there."""
    engine = adapter.MuJoCo()
    assert engine.unsupported(case) is None
    model = engine.build(case)
    first, again = (engine.solve(model, case, TOL) for _ in range(2))
    for name, motion in again.points.items():
        # made of all before it
        np.testing.assert_array_equal(motion.acceleration, first.points[name].acceleration)
    assert again.solved.all() or not complete, again.message
    assert again.residual <= TOL or not again.solved.any()
    return again


def assert_motion(motion, *expected, atol=(1e-13, 1e-11, 1e-9)):
    """Position, velocity and acceleration as expected. The last two are usually known by numerical
    differentiation only.
    """
    for found, wanted, error in zip(
        (motion.position, motion.velocity, motion.acceleration), expected, atol, strict=True
    ):
        np.testing.assert_allclose(found, wanted, rtol=0, atol=error)


def periodic(x, rate=RATE):
    """Samples over a crank turn with their first and second derivative by time."""
    k = 1j * np.fft.fftfreq(len(x), 1.0 / len(x))[:, None]
    return x, *(np.fft.ifft((rate * k) ** n * np.fft.fft(x, axis=0), axis=0).real for n in (1, 2))


def slider_crank():
    """The spatial slider-crank of the IFToMM benchmarks, with a peg on the rod."""
    joints = [
        Revolute("pivot", "ground", "crank", (0.0, 0.1, 0.12), (1.0, 0.0, 0.0)),
        Spherical("pin", "crank", "rod", (0.0, 0.1, 0.2)),
        Universal(
            "gudgeon", "rod", "slider", (0.2, 0.0, 0.0), ((0.48, 0.6, -0.64), (0.0, 0.64, 0.6))
        ),
        Translational("guide", "ground", "slider", (0.2, 0.0, 0.0), (2.0, 0.0, 0.0)),
        Fixed("glue", "rod", "peg"),
    ]
    points = {"slider": ("slider", (0.2, 0.0, 0.0)), "peg": ("peg", (0.1, 0.05, 0.2))}
    return case(joints, points, [JointAngle("crank", "pivot")], TURN, RATE)


# The slider's x = sqrt(l^2 - y^2 - z^2) for the crank pin's y, z.
SLIDER = np.outer(
    np.sqrt(0.09 - (0.1 - 0.08 * np.sin(TURN)) ** 2 - (0.12 + 0.08 * np.cos(TURN)) ** 2),
    [1.0, 0.0, 0.0],
)


def four_bar(angle):
    """B and C of a four-bar of ground 1, crank 0.3, coupler 0.9, rocker 0.8; C lies on two circles,
    above the line B-D.
    """
    B = 0.3 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    e = np.array([1.0, 0.0, 0.0]) - B
    s = np.linalg.norm(e, axis=1, keepdims=True)
    along = (s**2 + 0.9**2 - 0.8**2) / (2 * s)
    return B, B + along * e / s + np.sqrt(0.9**2 - along**2) * np.cross([0.0, 0.0, 1.0], e) / s


def rocker(B, length):
    """C = D + 0.4 (0, cos f, sin f) at the distance of a rod from B: p cos f + q sin f = k."""
    d = np.array([0.6, 0.3, 0.1]) - B
    p, q, k = 0.8 * d[:, 1], 0.8 * d[:, 2], length**2 - 0.4**2 - (d * d).sum(axis=1)
    f = np.arctan2(q, p) + np.arccos(k / np.hypot(p, q))
    return np.stack([0.6 + 0 * f, 0.3 + 0.4 * np.cos(f), 0.1 + 0.4 * np.sin(f)], axis=1)


CRANK_PIN = 0.1 * np.stack([np.cos(TURN), np.sin(TURN), 0 * TURN], axis=1)
B0 = np.array([[0.1, 0.0, 0.0]])
C0 = tuple(rocker(B0, 0.76)[0])
RSSR = (
    Revolute("a", "ground", "crank", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    Revolute("c", "rocker", "ground", (0.6, 0.3, 0.1), (1.0, 0.0, 0.0)),
    Distance("rod", "crank", "rocker", (tuple(B0[0]), C0)),
)


def test_four_bar_of_spatial_revolutes_in_a_tilted_plane():
    """Three of the rows are too many."""
    R = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
    (B,), (C,) = (x @ R for x in four_bar(np.array([0.6])))
    places = {
        "A": ("ground", "crank", 0 * B),
        "B": ("crank", "coupler", B),
        "C": ("coupler", "rocker", C),
    }
    places["D"] = ("ground", "rocker", R[0])
    joints = [
        Revolute(name, i, j, tuple(point), tuple(R[2])) for name, (i, j, point) in places.items()
    ]
    trajectory = solve(
        case(
            joints, {"B": ("crank", B), "C": ("coupler", C)}, [JointAngle("crank", "A")], TURN, RATE
        )
    )
    for name, x in zip("BC", four_bar(TURN + 0.6), strict=True):
        assert_motion(trajectory.points[name], *periodic(x @ R))
    assert (
        trajectory.details["rank"]
        == trajectory.details["unknowns"]
        == trajectory.details["closure_rows"] + 1 - 3
    )


@pytest.mark.parametrize("length", [None, 0.78])
def test_rssr_with_a_rod_of_any_length(length):
    """A rod of another length than at design moves the rocker before the sweep starts."""
    rssr = case(
        [*RSSR[:2], replace(RSSR[2], length=length)],
        {"C": ("rocker", C0)},
        [JointAngle("crank", "a")],
        TURN,
        RATE,
    )
    assert_motion(solve(rssr).points["C"], *periodic(rocker(CRANK_PIN, length or 0.76)))


def test_drivers_without_a_sweep_hold():
    """The RSSR's rocker on a slide that is held."""
    slide = Translational("slide", "carriage", "ground", (0.0, 0.0, 0.0), (1.0, 1.0, 0.0))
    drivers = [JointAngle("crank", "a"), JointDisplacement("hold", "slide")]
    held = case(
        [RSSR[0], replace(RSSR[1], j="carriage"), RSSR[2], slide],
        {"C": ("rocker", C0)},
        drivers,
        TURN,
        RATE,
    )
    assert_motion(solve(held).points["C"], *periodic(rocker(CRANK_PIN, 0.76)))


def strut(values, relative=True, design=0.0):
    """The McPherson strut of SAE 943745."""
    K, U, W = (0.97772, 0.605, 0.18), (1.0, 0.55, 0.6), (0.975, 0.715, 0.101)
    joints = [
        Revolute("pivot", "chassis", "lca", (1.17, 0.353, 0.005), (1.0, 0.0, 0.0)),
        Spherical("ball", "lca", "knuckle", (0.9676, 0.66, -0.01)),
        Translational("slide", "knuckle", "strut", K, tuple(np.subtract(U, K))),
        Spherical("top", "strut", "chassis", U),
        Distance("tie", "knuckle", "rack", ((1.115, 0.665, 0.118), (1.14, 0.355, 0.1455))),
    ]
    stroke = PointCoordinate("stroke", "W", (0.0, 0.0, 2.0), relative)
    return case(
        joints, {"W": ("knuckle", W)}, [stroke], values, design=design, fixed=("chassis", "rack")
    )


@pytest.mark.parametrize("design", [0.0, 0.101])
def test_strut(design):
    """Two 40-digit solutions that share no equation, at strokes of -80 and 80 mm; the tolerances
    are a hundred round-offs.
    """
    values = np.array([-0.08, 0.08]) + design
    xy = [[0.9784216847140831, 0.7046021168519804], [0.9735541231204234, 0.7077296192455841]]
    v = [[-0.054481022483195314, 0.2480504445509548], [-0.003999789054857216, -0.20064514629978514]]
    a = [[0.2981388664673118, -3.1424653530748703], [0.3886541436275602, -2.8313008695458346]]
    expected = (
        np.column_stack(each)
        for each in ((xy, values - design + 0.101), (v, np.ones(2)), (a, np.zeros(2)))
    )
    assert_motion(
        solve(strut(values, design == 0.0, design)).points["W"],
        *expected,
        atol=(1e-14, 1e-13, 1e-12),
    )


def test_end_of_motion_is_told_and_nothing_is_written(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    values = np.arange(-10, 601) * 1e-3
    trajectory = solve(strut(values), complete=False)
    # the strut locks between 0.293 and 0.294 m
    np.testing.assert_array_equal(trajectory.solved, values < 0.2935)
    np.testing.assert_array_equal(
        np.isfinite(trajectory.points["W"].position), trajectory.solved[:, None] & [True] * 3
    )
    assert re.search(
        "beyond stroke = 0.293.* last reachable sample at stroke = 0.293;", trajectory.message
    )
    assert list(tmp_path.iterdir()) == []
    assert tuple(capfd.readouterr()) == ("", "")


def test_point_driven_along_an_oblique_direction():
    """r cos(t - t_d) = c: a pendulum of radius r pulled along the direction t_d in its plane."""
    r, t_d, c, rate = 0.5, math.atan2(4.0, 3.0), np.linspace(-0.2, 0.1, 13), 2.0
    pendulum = [replace(RSSR[0], j="arm")]
    pull = [PointCoordinate("pull", "tip", (3.0, 4.0, 0.0))]
    motion = solve(case(pendulum, {"tip": ("arm", (r, 0.0, 0.0))}, pull, c, rate)).points["tip"]
    s = -np.arccos((r * math.cos(t_d) + c) / r)[:, None]
    e, n = (
        np.cos(s + t_d + k) * [1, 0, 0] + np.sin(s + t_d + k) * [0, 1, 0]
        for k in (0.0, math.pi / 2)
    )
    s_t = -rate / (r * np.sin(s))
    assert_motion(
        motion, r * e, r * s_t * n, -r * s_t**2 * (n / np.tan(s) + e), atol=(1e-14, 1e-13, 1e-12)
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_displacement_of_a_slider(sign):
    """A slider, named second or first of its joint, pushes the rocker of the RSSR by the rod."""
    h, values, rate = np.array([2.0, 1.0, -2.0]) / 3.0, np.linspace(-0.05, 0.05, 9), 0.5
    guide = Translational("guide", "ground", "slider", (0.0, 0.0, 0.0), tuple(3.0 * h))
    joints = [guide if sign > 0 else guide.reversed(), RSSR[1], replace(RSSR[2], i="slider")]
    motion = solve(
        case(joints, {"C": ("rocker", C0)}, [JointDisplacement("push", "guide")], values, rate)
    ).points["C"]
    # interpolated on twice the range: at its ends the derivatives are poor
    fit = [
        Chebyshev.interpolate(
            lambda s, k=k: rocker(B0 + sign * np.outer(s, h), 0.76)[:, k], 40, [-0.1, 0.1]
        )
        for k in range(3)
    ]
    assert_motion(
        motion, *(rate**n * np.column_stack([x.deriv(n)(values) for x in fit]) for n in range(3))
    )


def test_a_missing_or_broken_mujoco_is_no_version(monkeypatch):
    assert adapter.MuJoCo().version()
    monkeypatch.setattr(
        adapter.importlib, "import_module", lambda name: ctypes.CDLL("there is no such library")
    )
    assert adapter.MuJoCo().version() is None


def test_unknown_joints_and_drivers_are_named(monkeypatch):
    monkeypatch.setattr(Joint, "registry", dict(Joint.registry))
    wobble = type("Wobble", (Revolute,), {"type": "wobble_of_test_mujoco"})(
        "pivot", "ground", "crank", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)
    )
    twist = type("Twist", (Driver,), {"type": "twist"})("crank")
    assert "'pivot' (wobble_of_test_mujoco)" in adapter.MuJoCo().unsupported(
        change(slider_crank(), wobble)
    )
    assert "'crank' (twist)" in adapter.MuJoCo().unsupported(
        change(slider_crank(), drivers=(twist,))
    )
