"""The MuJoCo adapter against closed forms, a published strut, and itself with the loops cut
elsewhere.
"""

import ctypes
import re
from dataclasses import replace

import numpy as np
import pytest
from kincheck.adapters.mujoco import mujoco as adapter
from kincheck.core.joints import (
    Distance,
    Joint,
    Revolute,
    Spherical,
    Translational,
)
from kincheck.core.mechanism.motions import Driver, JointAngle, PointCoordinate

from ..support.mujoco_cases import (
    C0,
    CRANK_PIN,
    RATE,
    RSSR,
    TOL,
    TURN,
    assert_motion,
    case,
    change,
    periodic,
    rocker,
    slider_crank,
    solve,
)

pytest.importorskip("mujoco", reason="MuJoCo is not installed")


def four_bar(angle):
    """B and C of a four-bar of ground 1, crank 0.3, coupler 0.9, rocker 0.8; C lies on two circles,
    above the line B-D.
    """
    B = 0.3 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    e = np.array([1.0, 0.0, 0.0]) - B
    s = np.linalg.norm(e, axis=1, keepdims=True)
    along = (s**2 + 0.9**2 - 0.8**2) / (2 * s)
    return B, B + along * e / s + np.sqrt(0.9**2 - along**2) * np.cross([0.0, 0.0, 1.0], e) / s


@pytest.mark.parametrize("failing", [False, True])
def test_solving_again_gives_the_same_numbers(failing):
    """Nothing is left in the model by what it solved before, reached or not."""
    if failing:
        whole = strut(np.linspace(-0.08, 0.08, 5))
        before = replace(whole, sweep=replace(whole.sweep, values=np.linspace(0.0, 0.6, 13)))
    else:
        whole = before = slider_crank()
    engine = adapter.MuJoCo()
    model = engine.build(whole)
    first = engine.solve(model, whole, TOL)
    assert engine.solve(model, before, TOL).solved.all() != failing
    again = engine.solve(model, whole, TOL)
    for name, motion in again.points.items():
        # made of all before it
        np.testing.assert_array_equal(motion.acceleration, first.points[name].acceleration)


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
