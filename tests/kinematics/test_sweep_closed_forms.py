"""Marching over a sweep: grids of all kinds, closed forms over several turns."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core import (
    Body,
    Distance,
    JointDisplacement,
    Mechanism,
    Point,
    PointCoordinate,
    Revolute,
    Spherical,
    Translational,
)
from kincheck.core.kinematics import solve

from ..support.mechanisms import (
    CRANK,
    ROD,
    four_bar,
    four_bar_motion,
    mcpherson,
    slider_crank,
    slider_crank_motion,
)

STROKES = np.linspace(-0.08, 0.08, 33)


def wheel(values=STROKES):
    found = solve(mcpherson(), "stroke", values)
    assert found.solved.all(), found.message
    return found.points["wheel"]


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
    [
        [0.0],
        [0.05],
        [-0.08],
        [0.05, 0.08],
        [-0.08, -0.03],
        [0.08, -0.08],
        [0.02, 0.02, -0.02, 0.02],
    ],
    ids=str,
)
def test_few_samples(values):
    """Without zero, on one side, alone, repeated: all the same pose at the same stroke."""
    k = [round((value + 0.08) / 0.005) for value in values]
    expected = wheel()
    found = wheel(values)
    assert np.abs(found.position - expected.position[k]).max() <= 2e-16
    assert np.abs(found.acceleration - expected.acceleration[k]).max() <= 2e-14


def test_no_sample():
    found = solve(mcpherson(), "stroke", [])
    assert found.solved.shape == (0,)
    assert found.points["wheel"].position.shape == (0, 3)


def test_more_samples_than_lanes():
    """1200 samples pass in several blocks; every hundredth is one of a short sweep."""
    many = np.linspace(-0.08, 0.08, 1201)
    found, short = wheel(many), wheel(many[::100])
    assert np.abs(found.position[::100] - short.position).max() <= 2e-16
    assert np.abs(found.acceleration[::100] - short.acceleration).max() <= 2e-14


# Closed forms


TURNS = 2.0 * np.pi * np.linspace(-3.0, 3.0, 31)
"""Three turns either way, five samples a turn."""


@pytest.mark.parametrize("angles", [TURNS, np.linspace(-7.0, 7.0, 301)], ids=["coarse", "fine"])
@pytest.mark.parametrize("rate", [1.0, -3.0])
def test_slider_crank_closed_form(angles, rate):
    found = solve(slider_crank(), "turn", angles, rate=rate)
    assert found.solved.all(), found.message
    expected, end = slider_crank_motion(angles, rate), found.points["end"]
    assert np.abs(end.position[:, 0] - expected.x).max() <= 1e-15
    assert np.abs(end.velocity[:, 0] - expected.v).max() <= 1e-15 * abs(rate)
    assert np.abs(end.acceleration[:, 0] - expected.a).max() <= 5e-15 * rate**2
    assert not end.position[:, 1:].any()
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
    found = solve(four_bar(), "turn", TURNS)
    assert found.solved.all(), found.message
    x, z = four_bar_motion(TURNS)
    C = found.points["C"]
    for column, jet in ((0, x), (2, z)):
        assert np.abs(C.position[:, column] - jet.x).max() <= 2e-15
        assert np.abs(C.velocity[:, column] - jet.v).max() <= 4e-15
        assert np.abs(C.acceleration[:, column] - jet.a).max() <= 2e-14


@pytest.mark.parametrize("rod", [0.8, 0.999, 1.3])
def test_rod_of_other_length(rod):
    """The design is closed first: the slider moves to where the rod reaches."""
    found = solve(slider_crank(rod), "turn", TURNS)
    assert found.solved.all(), found.message
    expected, end = slider_crank_motion(TURNS, rod=rod), found.points["end"]
    assert np.abs(end.position[:, 0] - expected.x).max() <= 1e-15
    assert np.abs(end.velocity[:, 0] - expected.v).max() <= 2e-15
    assert np.abs(end.acceleration[:, 0] - expected.a).max() <= 1e-14


def test_driven_slider():
    """A joint displacement from an open angle: the crank angle by the cosine rule."""
    angle = 1.0
    design = float(slider_crank_motion([angle]).x[0])
    pin = (CRANK * np.cos(angle), 0.0, -CRANK * np.sin(angle))
    m = slider_crank()
    bent = Distance("rod", "crank", "slider", (pin, (design, 0.0, 0.0)))
    guide = Translational("guide", "ground", "slider", (design, 0.0, 0.0), (-2.0, 0.0, 0.0))
    joints, points = [m.joint("pivot"), bent, guide], [Point("pin", "crank", pin)]
    pushed = replace(m, joints=joints, points=points, drivers=[JointDisplacement("push", "guide")])
    values = np.linspace(-0.1, 0.1, 21)  # along -x
    found = solve(pushed, "push", values)
    x = design - values
    cosine = (x * x + CRANK**2 - ROD**2) / (2.0 * x * CRANK)
    assert found.points["pin"].position[:, 0] == pytest.approx(CRANK * cosine, abs=1e-15)


def test_relative_angle_of_moving_bodies():
    """Two arms in line: the second driven against the first, which is held."""
    arms = Mechanism(
        "arms",
        [Body("upper"), Body("lower")],
        [
            Revolute("shoulder", "ground", "upper", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
            Revolute("elbow", "lower", "upper", (1.0, 0.0, 0.0), (0.0, 0.0, 2.0)),
        ],
        [Point("hand", "lower", (2.0, 0.0, 0.0))],
        [
            replace(slider_crank().driver("turn"), name=name, joint=name)
            for name in ("shoulder", "elbow")
        ],
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
    links = [Body(f"link {k}") for k in range(3)]
    hinges = [
        Revolute(
            f"hinge {k}",
            "ground" if k == 0 else f"link {k - 1}",
            f"link {k}",
            (float(k), 0.0, 0.0),
            (0.0, 1.0, 0.0),
        )
        for k in range(3)
    ]
    held = [
        replace(slider_crank().driver("turn"), name=f"turn {k}", joint=f"hinge {k}")
        for k in range(3)
    ]
    m = Mechanism("chain", links, hinges, [Point("tip", "link 2", (3.0, 0.0, 0.0))], held)
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
            Spherical("ball", "ground", "arm", (0.0, 0.0, 0.0)),
            Distance("stay", "ground", "arm", ((0.0, 2.0, 1.0), (0.0, 2.0, 0.0))),
            Distance("brace", "ground", "arm", ((1.0, 2.0, 0.0), (0.0, 2.0, 0.0))),
        ],
        [Point("tip", "arm", (0.5, 0.0, 0.0))],
        [PointCoordinate("lift", "tip", (0.0, 0.0, 1.0))],
    )
    heights = np.linspace(-0.45, 0.45, 19)
    tip = solve(m, "lift", heights).points["tip"]
    assert tip.position[:, 0] == pytest.approx(np.sqrt(0.25 - heights**2), abs=1e-15)
    assert tip.velocity[:, 0] == pytest.approx(-heights / np.sqrt(0.25 - heights**2), abs=2e-14)
