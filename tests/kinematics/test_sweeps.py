"""Marching over a sweep: grids of all kinds, closed forms over several turns."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from kincheck import (
    Body,
    Distance,
    JointAngle,
    Mechanism,
    Point,
    PointCoordinate,
    Ramp,
    Revolute,
    Spherical,
    solve,
)
from kincheck.core.kinematics import Method, NativeSolver
from kincheck.core.kinematics.compiled.compiled_model import compile_model
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.continuation.sweep import sweep
from kincheck.core.kinematics.continuation.walk import FINER, ROOM, SideWalk
from kincheck.core.mechanism.motions import Path

from ..support.examples import examples
from ..support.mechanisms import (
    CRANK,
    ORIGIN,
    ROD,
    X,
    Y,
    Z,
    errors,
    four_bar,
    four_bar_motion,
    mcpherson,
    pushed,
    slider_crank,
    slider_crank_motion,
    solve_all,
)

(FEW,) = examples(__file__, "few")

STROKES = np.linspace(-0.08, 0.08, 33)


def wheel(values=STROKES):
    return solve_all(mcpherson(), "stroke", values).points["wheel"]


# Grids


def test_samples_in_any_order():
    shuffled = np.random.default_rng(1).permutation(STROKES)
    back = np.argsort(shuffled)
    expected, found = wheel(), wheel(shuffled)
    for each in ("position", "velocity", "acceleration"):
        assert (getattr(found, each)[back] == getattr(expected, each)).all()
    assert (wheel(list(STROKES[::-1])).position[::-1] == expected.position).all()


@pytest.mark.parametrize(
    "values",
    FEW,
    ids=str,
)
def test_few_samples(values):
    """Without zero, on one side, alone, repeated: all the same pose at the same stroke."""
    k = [round((value + 0.08) / 0.005) for value in values]
    expected = wheel()
    found = wheel(values)
    assert np.abs(found.position - expected.position[k]).max() <= 2e-16
    assert np.abs(found.acceleration - expected.acceleration[k]).max() <= 2e-14


def test_more_samples_than_lanes():
    """1200 samples pass in several blocks; every hundredth is one of a short sweep."""
    many = np.linspace(-0.08, 0.08, 1201)
    found, short = wheel(many), wheel(many[::100])
    assert np.abs(found.position[::100] - short.position).max() <= 2e-16
    assert np.abs(found.acceleration[::100] - short.acceleration).max() <= 2e-14


# Closed forms


TURNS = 2.0 * np.pi * np.linspace(-3.0, 3.0, 31)
"""Three turns either way, five samples a turn."""


def along_x(x, z=None):
    """Position, velocity and acceleration in the plane of x and z, by jets."""
    zero = np.zeros_like(x.x)
    columns = [(x.x, x.v, x.a), (zero,) * 3, (zero,) * 3 if z is None else (z.x, z.v, z.a)]
    return [np.column_stack(each) for each in zip(*columns, strict=True)]


@pytest.mark.parametrize("angles", [TURNS, np.linspace(-7.0, 7.0, 301)], ids=["coarse", "fine"])
@pytest.mark.parametrize("rate", [1.0, -3.0])
def test_slider_crank_closed_form(angles, rate):
    found = solve_all(slider_crank(), "turn", angles, rate=rate)
    limits = 1e-15, 1e-15 * abs(rate), 5e-15 * rate**2
    assert (errors(found.points["end"], along_x(slider_crank_motion(angles, rate))) <= limits).all()
    assert not found.points["end"].position[:, 1:].any()
    pin = found.points["pin"]
    assert pin.position[:, 0] == pytest.approx(CRANK * np.cos(angles), abs=1e-15)
    assert pin.position[:, 2] == pytest.approx(-CRANK * np.sin(angles), abs=1e-15)


def test_whole_turns_return_to_design():
    found = solve(slider_crank(), "turn", 2.0 * np.pi * np.arange(-20, 21), bodies=["crank"])
    # the angle itself rounds at 126 rad
    assert np.abs(found.points["end"].position[:, 0] - (CRANK + ROD)).max() <= 1e-14
    sign = found.bodies["crank"].p[:, 0]  # Euler parameters know odd from even turns
    assert sign == pytest.approx((-1.0) ** np.arange(-20, 21), abs=1e-14)


def test_four_bar_closed_form():
    found = solve_all(four_bar(), "turn", TURNS)
    expected = along_x(*four_bar_motion(TURNS))
    assert (errors(found.points["C"], expected) <= [2e-15, 4e-15, 2e-14]).all()


@pytest.mark.parametrize("rod", [0.8, 0.999, 1.3])
def test_rod_of_other_length(rod):
    """The design is closed first: the slider moves to where the rod reaches."""
    found = solve_all(slider_crank(rod), "turn", TURNS)
    expected = along_x(slider_crank_motion(TURNS, rod=rod))
    assert (errors(found.points["end"], expected) <= [1e-15, 2e-15, 1e-14]).all()


def test_driven_slider():
    """A joint displacement from an open angle: the crank angle by the cosine rule."""
    mechanism, design, _ = pushed()
    guide = mechanism.joint("guide").changed(axis=(-2.0, 0.0, 0.0))
    mechanism = replace(mechanism, joints=[*mechanism.joints[:2], guide])
    values = np.linspace(-0.1, 0.1, 21)  # along -x
    found = solve(mechanism, "push", values)
    x = design - values
    cosine = (x * x + CRANK**2 - ROD**2) / (2.0 * x * CRANK)
    assert found.points["pin"].position[:, 0] == pytest.approx(CRANK * cosine, abs=1e-15)


def test_relative_angle_of_moving_bodies():
    """Two arms in line: the second driven against the first, which is held."""
    arms = Mechanism(
        "arms",
        [Body("upper"), Body("lower")],
        [
            Revolute("shoulder", "ground", "upper", ORIGIN, Z),
            Revolute("elbow", "lower", "upper", X, (0.0, 0.0, 2.0)),
        ],
        [Point("hand", "lower", (2.0, 0.0, 0.0))],
        [JointAngle(name, name) for name in ("shoulder", "elbow")],
    )
    angles = np.linspace(-5.0, 5.0, 21)
    for driver, expected in (
        ("shoulder", [2.0 * np.cos(angles), 2.0 * np.sin(angles)]),
        ("elbow", [1.0 + np.cos(angles), -np.sin(angles)]),  # of the upper relative to the lower
    ):
        hand = solve(arms, driver, angles).points["hand"]
        assert pytest.approx(np.array(expected), abs=2e-15) == hand.position[:, :2].T


def test_open_chain():
    """Three links in line, without a loop: the middle hinge swept, the others held."""
    links = ["ground", "link 0", "link 1", "link 2"]
    hinges = [Revolute(f"hinge {k}", *links[k : k + 2], (float(k), 0.0, 0.0), Y) for k in range(3)]
    drivers = [JointAngle(f"turn {k}", f"hinge {k}") for k in range(3)]
    tip = Point("tip", "link 2", (3.0, 0.0, 0.0))
    m = Mechanism("chain", map(Body, links[1:]), hinges, [tip], drivers)
    angles = np.linspace(-3.0, 3.0, 13)
    tip = solve(m, "turn 1", angles).points["tip"]
    assert tip.position[:, 0] == pytest.approx(1.0 + 2.0 * np.cos(angles), abs=2e-15)
    assert tip.position[:, 2] == pytest.approx(-2.0 * np.sin(angles), abs=2e-15)
    assert tip.acceleration[:, 0] == pytest.approx(-2.0 * np.cos(angles), abs=5e-15)


def test_arm_on_ball_and_rods():
    """No joint with an axis: the arm swings about the line through the ball and where the rods
    meet, driven at its tip.
    """
    m = Mechanism(
        "fork",
        [Body("arm")],
        [
            Spherical("ball", "ground", "arm", ORIGIN),
            Distance("stay", "ground", "arm", ((0.0, 2.0, 1.0), (0.0, 2.0, 0.0))),
            Distance("brace", "ground", "arm", ((1.0, 2.0, 0.0), (0.0, 2.0, 0.0))),
        ],
        [Point("tip", "arm", (0.5, 0.0, 0.0))],
        [PointCoordinate("lift", "tip", Z)],
    )
    heights = np.linspace(-0.45, 0.45, 19)
    tip = solve(m, "lift", heights).points["tip"]
    assert tip.position[:, 0] == pytest.approx(np.sqrt(0.25 - heights**2), abs=1e-15)
    assert tip.velocity[:, 0] == pytest.approx(-heights / np.sqrt(0.25 - heights**2), abs=2e-14)


# Sweeps to the ends of travel and beyond, and steps of many turns


IN_BLOCKS = pytest.mark.needs("blocks")


@pytest.mark.parametrize(
    ("way", "turn", "solved"),
    [
        (Method.ONE_PROGRAM, 1000.0, True),
        (Method.ONE_PROGRAM, 1e6, False),
        pytest.param(Method.BY_COMPONENTS, 1000.0, True, marks=IN_BLOCKS),
        pytest.param(Method.BY_COMPONENTS, 1e6, False, marks=IN_BLOCKS),
        # a part takes it a hundred times as long
        pytest.param(Method.SPARSE, 100.0, True, marks=IN_BLOCKS),
    ],
)
def test_step_of_many_turns(way, turn, solved):
    m = slider_crank()
    path = Path({"turn": Ramp(1.0)}, np.array([0.0, turn]))
    found = NativeSolver(method=way).prepare(m, path, ("end",))(1e-12)
    assert found.solved.tolist() == [True, solved], found.message
    assert ("give samples in between" in found.message) is not solved
    assert "assembly" not in found.message
    if solved:
        x = slider_crank_motion(turn).x
        # a thousand radians round at 1e-13
        assert np.abs(found.points["end"].position[1, 0] - x) <= 1e-12


@pytest.mark.parametrize(("far", "limit"), [(0.4, 0.29337), (-0.4, -0.31674)])
@pytest.mark.parametrize("steps", [401, 9])
def test_lock_up_of_strut(far, limit, steps):
    """Formulation section 10: the first extrema of the wheel's height along the branch, to the
    digits given there.
    """
    values = np.linspace(0.0, far, steps)
    found = solve(mcpherson(), "stroke", values)
    within = np.abs(values) < abs(limit)
    assert (found.solved == within).all()
    assert np.isnan(found.points["wheel"].position[~within]).all()
    assert np.isfinite(found.points["wheel"].acceleration[within]).all()
    pattern = (
        r"cannot be followed beyond stroke = (\S+) \(wanted stroke = (\S+)\): .*; smallest singular"
        r" value there about (\S+) .*lock-up.*last reachable sample at stroke = (\S+); shorten the"
        " sweep"
    )
    beyond, wanted, pivot, last = map(float, re.match(pattern, found.message).groups())
    assert beyond == pytest.approx(limit, abs=1e-4)
    assert wanted == pytest.approx(values[~within][0], rel=1e-8)
    assert last == pytest.approx(values[within][-1], rel=1e-8)
    assert 0.0 < pivot < 0.02


def test_samples_beyond_dead_centre():
    """Past a dead centre the crank could be assembled again, but not without passing where it
    cannot.
    """
    turn = np.linspace(0.0, np.pi, 61)
    # shorter than the crank: the pin cannot pass overhead
    found = solve(slider_crank(rod=0.1), "turn", turn)
    assert (found.solved == (turn < np.arcsin(0.1 / CRANK))).all()
    assert "cannot be followed" in found.message


@pytest.mark.parametrize("samples", [3, 5, 9, 20])
def test_both_directions_end(samples):
    """Both fronts divide their steps at once, in one block of lanes."""
    found = solve(mcpherson(), "stroke", np.linspace(-1.5, 1.5, samples))
    assert found.message.count("cannot be followed beyond stroke = ") == 2
    assert not found.solved.all()


# Coarse sweeps are gone in parts of their steps: to the samples of a closed form, by whichever


COARSE = {
    "a turn in six": np.linspace(0.0, 2.0 * np.pi, 7),
    "turns of three radians": np.linspace(-12.0, 12.0, 9),
    "one step of six turns": np.array([12.0 * np.pi]),
    "a step in parts of more than a radian": np.array([1.2 * FINER[1]]),
    "in no order, and twice the same": np.array([5.0, -4.0, 0.0, 2.5, 5.0, -1.0]),
    "small steps, then large": np.concatenate(
        [np.linspace(0.0, 0.1, 40), np.linspace(2.0, 9.0, 5)]
    ),
}
"""Angles of the crank, measured from the design position."""


@cache
def model(compiled):
    return compile_model(slider_crank(), Request(("turn",), ("end",), compiled=compiled))


def swept(values, *, compiled=True):
    """Along a route of its own: what is made ready for one that was solved before is kept with
    it.
    """
    return sweep(model(compiled), Path({"turn": Ramp(1.0)}, np.asarray(values)), 1e-12)


def assert_right(found, values):
    """Every sample is there, with position, velocity and acceleration of the closed form."""
    assert found.solved.all()
    assert not found.message
    assert found.residual <= 1e-15
    x = slider_crank_motion(values)
    expected = [np.column_stack([each, 0.0 * x.x, 0.0 * x.x]) for each in (x.x, x.v, x.a)]
    assert (errors(found.points["end"], expected) <= 1e-14).all()


@pytest.fixture
def divided(monkeypatch):
    """The steps of which parts were looked for one by one."""
    aims, divide = list[float](), SideWalk._divide_step
    monkeypatch.setattr(
        SideWalk,
        "_divide_step",
        lambda self, anchor, aim: aims.append(aim) or divide(self, anchor, aim),
    )
    return aims


@pytest.mark.parametrize("compiled", [True, False])
@pytest.mark.parametrize("values", COARSE.values(), ids=COARSE)
def test_coarse_sweep_in_equal_parts(values, compiled, divided):
    assert_right(swept(values, compiled=compiled), values)
    assert not divided


@pytest.mark.parametrize("values", COARSE.values(), ids=COARSE)
def test_coarse_sweep_in_searched_parts(values, divided):
    """After so many samples that equal parts of all of them are not kept ready."""
    values = np.append(np.linspace(0.0, 1e-3, 1 + ROOM // FINER[0]), values)
    assert_right(swept(values), values)
    assert divided


def test_worst_sigma_is_of_samples():
    """Not of the poses between, which are nearer to singular."""
    whole, least = 2.0 * np.pi, "smallest_singular_value"
    assert swept(np.linspace(0.0, whole, 41)).details[least] < 0.97
    assert swept([0.0, whole]).details[least] == pytest.approx(1.0, abs=1e-12)
    assert swept([0.0, 2.5 * np.pi]).details[least] < 0.97
