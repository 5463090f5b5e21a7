"""Exudyn's adapter against closed forms, a published strut solved elsewhere, and differences of its
own positions.
"""

import importlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from kincheck.adapters.exudyn.exudyn import Exudyn
from kincheck.core.joints import Distance, Revolute, Spherical, Translational
from kincheck.core.mechanism.mechanism import Body
from kincheck.core.mechanism.motions import Driver, PointCoordinate

from ..support.exudyn_cases import TOL, assert_consistent, case_of, solve, solved, turned

pytest.importorskip("exudyn")


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
