"""Drivers that give a coordinate itself, not its change from the design: one arm, whose tip is
driven, against its closed form.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    Case,
    Cylindrical,
    JointDisplacement,
    Mechanism,
    Point,
    PointCoordinate,
    Ramp,
    Revolute,
    Sine,
    SolveError,
    solve,
)
from kincheck.core.case.case import Output, Sweep, Truth
from kincheck.core.mechanism.motions import Absolute

from ..support.mechanisms import ORIGIN, X, Y, Z

DESIGNS = "kincheck.core.extensions.designs.design_batch"

ARM = Mechanism(
    "arm",
    [Body("arm")],
    [Revolute("hinge", "ground", "arm", ORIGIN, Z)],
    [Point("tip", "arm", (0.8, 0.6, 0.0))],
    [PointCoordinate("y", "tip", (0.0, 2.0, 0.0), relative=False)],
)
HEIGHTS = np.array([0.7, 0.6, 0.2, 0.3])
# numbers below one, a few operations
ROUND_OFF = 4e-16


def test_absolute_driver_values_are_coordinates():
    found = solve(ARM, "y", HEIGHTS, rate=2.0)
    tip = found.points["tip"]
    assert found.solved.all()
    assert tip.position[:, :2] == pytest.approx(
        np.stack([np.sqrt(1.0 - HEIGHTS**2), HEIGHTS], axis=1), abs=ROUND_OFF
    )
    assert tip.velocity[:, 1] == pytest.approx(2.0, abs=ROUND_OFF)
    assert "beyond y = 1 (wanted y = 1.2)" in solve(ARM, "y", [1.2]).message


def test_absolute_motion_of_second_driver():
    """A sleeve that turns and slides: the driven height is 0.5 at design."""
    sleeve = Mechanism(
        "sleeve",
        [Body("sleeve")],
        [Cylindrical("sleeve", "ground", "sleeve", ORIGIN, Z)],
        [Point("tip", "sleeve", (0.8, 0.6, 0.5))],
        [PointCoordinate("y", "tip", Y), PointCoordinate("z", "tip", Z, relative=False)],
    )
    times = np.linspace(0.0, 0.2, 5)
    wave = Sine(0.5, 1.0, np.pi / 2.0)  # 0.5 at time zero
    for motion in (wave, Absolute(wave, 0.5)):  # as case files have it: not wrapped again
        found = solve(sleeve, "y", times, motions={"z": motion})
        assert found.points["tip"].position[:, 2] == pytest.approx(
            0.5 * np.cos(2.0 * np.pi * times), abs=ROUND_OFF
        )
    slide = replace(sleeve, drivers=[sleeve.drivers[0], JointDisplacement("z", "sleeve")])
    found = solve(slide, "y", times, motions={"z": Ramp(1.0)})
    assert found.points["tip"].position[:, 2] == pytest.approx(0.5 + times, abs=ROUND_OFF)


def test_designs_moving_driven_point_are_refused():
    solve_designs = pytest.importorskip(DESIGNS).solve_designs
    at = {"points.tip.position": np.array([[0.8, 0.6, 0.0], [0.8, 0.5, 0.0]])}
    with pytest.raises(
        SolveError,
        match=(
            r"'y' gives the absolute position of a point that varies, points\.tip\.position; drive"
        ),
    ):
        solve_designs(ARM, "y", HEIGHTS, at)
    hinge = {"joints.hinge.point": np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])}
    found = solve_designs(ARM, "y", HEIGHTS, hinge).points["tip"].position
    assert found[:, :, 1] == pytest.approx(np.broadcast_to(HEIGHTS, (2, 4)), abs=ROUND_OFF)


def test_sensitivity_of_absolute_and_relative_drivers():
    """x = sqrt(X^2 + Y^2 - y^2): by Y it is Y / x, at a height that is given; relative, it moves
    along: (Y - y) / x.
    """
    diagnose = pytest.importorskip("kincheck.core.extensions.explain.diagnose").diagnose
    outputs = tuple(
        Output(name, "tip", along, False, 1e-9, 0.0, "test") for name, along in (("x", X), ("y", Y))
    )
    for relative, expected in ((False, {"x": 0.6, "y": 0.0}), (True, {"x": 0.6 - 0.7, "y": 1.0})):
        mechanism = replace(ARM, drivers=[replace(ARM.drivers[0], relative=relative)])
        design = mechanism.design_value("y")
        sweep = Sweep("y", np.array([0.7 - 0.6 + design]), design=design)
        found = diagnose(
            Case("arm", "test", Truth.CONSENSUS_ONLY, mechanism, sweep, outputs),
            samples=1,
            tol=1e-12,
        )
        known = {
            each.output: each.by_sample[0]
            for each in found.sensitivities
            if each.number == "points.tip.position y"
        }
        x = np.sqrt(1.0 - 0.7**2)
        assert known["x"] == pytest.approx(expected["x"] / x, abs=1e-14)
        assert known.get("y", 0.0) == pytest.approx(expected["y"], abs=1e-14)


def test_residual_without_solved_sample_is_nan():
    """Of residuals zero would be the best there is."""
    found = solve(ARM, "y", [1.2])
    assert not found.solved.any()
    details = [found.details[name] for name in ("redundant_residual", "smallest_singular_value")]
    assert np.isnan([found.residual, *details]).all()
    assert np.isnan(solve(ARM, "y", []).residual)
