"""Marching over a sweep: grids of all kinds, closed forms over several turns, the ends of travel, size and place of a mechanism."""

import re
from dataclasses import replace

import numpy as np
import pytest
from kincheck.core import Body, Distance, JointDisplacement, Mechanism, Point, PointCoordinate, Revolute, Spherical, Translational
from kincheck.core.analysis.solve import solve

from .mechanisms import (
    CRANK,
    ROD,
    four_bar,
    four_bar_motion,
    mcpherson,
    placed,
    slider_crank,
    slider_crank_motion,
    swapped,
    without_fixed_bodies,
)

STROKES = np.linspace(-0.08, 0.08, 33)


def wheel(mechanism=None, values=STROKES, **options):
    found = solve(mechanism or mcpherson(), "stroke", values, **options)
    assert found.solved.all(), found.message
    return found.points["wheel"]


def assert_same(found, expected, position=2e-16, velocity=2e-15, acceleration=2e-14):
    """Two motions of a point that differ by round-off: numbers near one, amplified by the condition (36)."""
    assert np.abs(found.position - expected.position).max() <= position
    assert np.abs(found.velocity - expected.velocity).max() <= velocity
    assert np.abs(found.acceleration - expected.acceleration).max() <= acceleration


# Grids


def test_order_of_the_samples_does_not_matter():
    shuffled = np.random.default_rng(1).permutation(STROKES)
    back = np.argsort(shuffled)
    expected, found = wheel(), wheel(values=shuffled)
    for each in ("position", "velocity", "acceleration"):
        assert (getattr(found, each)[back] == getattr(expected, each)).all()
    assert (wheel(values=list(STROKES[::-1])).position[::-1] == expected.position).all()


@pytest.mark.parametrize(
    "values",
    [[0.0], [0.05], [-0.08], [0.05, 0.08], [-0.08, -0.03], [0.08, -0.08], [0.02, 0.02, -0.02, 0.02]],
    ids=str,
)
def test_few_samples(values):
    """Without zero, on one side, alone, repeated: all the same pose at the same stroke."""
    k = [round((value + 0.08) / 0.005) for value in values]
    expected = wheel()
    found = wheel(values=values)
    assert np.abs(found.position - expected.position[k]).max() <= 2e-16
    assert np.abs(found.acceleration - expected.acceleration[k]).max() <= 2e-14


def test_no_sample():
    found = solve(mcpherson(), "stroke", [])
    assert found.solved.shape == (0,)
    assert found.points["wheel"].position.shape == (0, 3)


def test_more_samples_than_lanes():
    """1200 samples pass in several blocks; every hundredth is one of a short sweep."""
    many = np.linspace(-0.08, 0.08, 1201)
    found, short = wheel(values=many), wheel(values=many[::100])
    assert np.abs(found.position[::100] - short.position).max() <= 2e-16
    assert np.abs(found.acceleration[::100] - short.acceleration).max() <= 2e-14


# Closed forms


TURNS = 2.0 * np.pi * np.linspace(-3.0, 3.0, 31)
"""Three turns either way, five samples a turn."""


@pytest.mark.parametrize("angles", [TURNS, np.linspace(-7.0, 7.0, 301)], ids=["coarse", "fine"])
@pytest.mark.parametrize("rate", [1.0, -3.0])
def test_slider_crank(angles, rate):
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


def test_several_turns_come_back_to_the_design():
    found = solve(slider_crank(), "turn", 2.0 * np.pi * np.arange(-20, 21), bodies=["crank"])
    assert np.abs(found.points["end"].position[:, 0] - (CRANK + ROD)).max() <= 1e-14  # the angle itself rounds at 126 rad
    sign = found.bodies["crank"].p[:, 0]  # Euler parameters know odd from even turns
    assert sign == pytest.approx((-1.0) ** np.arange(-20, 21), abs=1e-14)


def test_four_bar():
    found = solve(four_bar(), "turn", TURNS)
    assert found.solved.all(), found.message
    x, z = four_bar_motion(TURNS)
    C = found.points["C"]
    for column, jet in ((0, x), (2, z)):
        assert np.abs(C.position[:, column] - jet.x).max() <= 2e-15
        assert np.abs(C.velocity[:, column] - jet.v).max() <= 4e-15
        assert np.abs(C.acceleration[:, column] - jet.a).max() <= 2e-14


@pytest.mark.parametrize("rod", [0.8, 0.999, 1.3])
def test_a_rod_of_another_length_than_designed(rod):
    """The design is closed first: the slider moves to where the rod reaches."""
    found = solve(slider_crank(rod), "turn", TURNS)
    assert found.solved.all(), found.message
    expected, end = slider_crank_motion(TURNS, rod=rod), found.points["end"]
    assert np.abs(end.position[:, 0] - expected.x).max() <= 1e-15
    assert np.abs(end.velocity[:, 0] - expected.v).max() <= 2e-15
    assert np.abs(end.acceleration[:, 0] - expected.a).max() <= 1e-14


def test_a_driven_slider():
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


def test_a_relative_angle_between_moving_bodies():
    """Two arms in line: the second driven against the first, which is held."""
    arms = Mechanism(
        "arms",
        [Body("upper"), Body("lower")],
        [
            Revolute("shoulder", "ground", "upper", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
            Revolute("elbow", "lower", "upper", (1.0, 0.0, 0.0), (0.0, 0.0, 2.0)),
        ],
        [Point("hand", "lower", (2.0, 0.0, 0.0))],
        [replace(slider_crank().driver("turn"), name=name, joint=name) for name in ("shoulder", "elbow")],
    )
    angles = np.linspace(-5.0, 5.0, 21)
    for driver, expected in (
        ("shoulder", [2.0 * np.cos(angles), 2.0 * np.sin(angles)]),
        ("elbow", [1.0 + np.cos(angles), -np.sin(angles)]),  # of the upper relative to the lower
    ):
        hand = solve(arms, driver, angles).points["hand"]
        assert pytest.approx(np.array(expected), abs=2e-15) == hand.position[:, :2].T


# The ends of travel


@pytest.mark.parametrize(("far", "limit"), [(0.4, 0.29337), (-0.4, -0.31674)])
@pytest.mark.parametrize("steps", [401, 9])
def test_lock_up(far, limit, steps):
    """Formulation section 10: the first extrema of the wheel's height along the branch, to the digits given there."""
    values = np.linspace(0.0, far, steps)
    found = solve(mcpherson(), "stroke", values)
    within = np.abs(values) < abs(limit)
    assert (found.solved == within).all()
    assert np.isnan(found.points["wheel"].position[~within]).all()
    assert np.isfinite(found.points["wheel"].acceleration[within]).all()
    beyond, wanted, pivot, last = (
        float(x)
        for x in re.match(
            r"driver 'stroke' cannot be followed beyond (\S+) \(wanted (\S+)\): .*; smallest pivot there (\S+) .*lock-up.*"
            r"last reachable sample (\S+); shorten the sweep",
            found.message,
        ).groups()
    )
    assert beyond == pytest.approx(limit, abs=1e-4)
    assert wanted == pytest.approx(values[~within][0], rel=1e-8)
    assert last == pytest.approx(values[within][-1], rel=1e-8)
    assert 0.0 < pivot < 0.02


def test_both_ends_are_told():
    found = solve(mcpherson(), "stroke", [-0.5, -0.1, 0.1, 0.5])
    assert found.solved.tolist() == [False, True, True, False]
    assert found.message.count("cannot be followed") == 2


def test_an_end_before_the_first_sample():
    found = solve(mcpherson(), "stroke", [0.4])
    assert not found.solved.any()
    assert "no sample reached on this side of the design" in found.message
    assert found.points["wheel"].position.shape == (1, 3)


def test_what_lies_beyond_an_end_is_not_reached_from_elsewhere():
    """Past a dead centre the crank could be assembled again, but not without passing where it cannot."""
    m = slider_crank(rod=0.1)  # shorter than the crank: the pin cannot pass overhead
    found = solve(m, "turn", np.linspace(0.0, np.pi, 61))
    limit = np.arcsin(0.1 / CRANK)
    assert (found.solved == (np.linspace(0.0, np.pi, 61) < limit)).all()
    assert "cannot be followed" in found.message


# The same mechanism written differently


@pytest.mark.parametrize("rate", [0.25, -2.0, 1e3])
def test_rate_scales_velocities_and_accelerations(rate):
    expected, found = wheel(), wheel(rate=rate)
    assert np.abs(found.position - expected.position).max() <= 2e-16
    assert found.velocity == pytest.approx(rate * expected.velocity, rel=1e-13, abs=1e-15 * abs(rate))
    assert found.acceleration == pytest.approx(rate**2 * expected.acceleration, rel=1e-13, abs=1e-14 * rate**2)


@pytest.mark.parametrize("number", range(6))
def test_order_of_the_bodies_of_a_joint_does_not_matter(number):
    """Each joint exchanged by itself, and all of them."""
    m = mcpherson()
    exchanged = [joint.reversed() if number in (k, 5) else joint for k, joint in enumerate(m.joints)]
    assert_same(wheel(replace(m, joints=exchanged)), wheel())


def test_order_of_the_bodies_of_a_driven_joint_turns_its_sign():
    forward, back = (solve(m, "turn", a) for m, a in ((slider_crank(), TURNS), (swapped(slider_crank()), -TURNS)))
    assert_same(forward.points["pin"], forward.points["pin"])
    assert np.abs(back.points["pin"].position - forward.points["pin"].position).max() <= 1e-15
    assert np.abs(back.points["pin"].velocity + forward.points["pin"].velocity).max() <= 1e-15


@pytest.mark.parametrize("seed", range(3))
def test_order_of_bodies_and_joints_does_not_matter(seed):
    rng, m = np.random.default_rng(seed), mcpherson()
    bodies, joints = ([m.bodies[k] for k in rng.permutation(5)], [m.joints[k] for k in rng.permutation(5)])
    assert_same(wheel(replace(m, bodies=bodies, joints=joints)), wheel(), acceleration=5e-14)


def test_fixed_bodies_or_ground():
    assert_same(wheel(without_fixed_bodies(mcpherson())), wheel(), 0.0, 0.0, 0.0)


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 7.0, 1e3])
def test_size_does_not_matter(factor):
    """All lengths, the stroke and the rate scaled: everything scales, to the same relative accuracy."""
    small = placed(mcpherson(), lambda point: tuple(factor * np.array(point)), factor=factor)
    found, expected = wheel(small, factor * STROKES, rate=factor), wheel()
    # scaling rounds every hardpoint once, which moves the result by the condition times 1e-16
    assert found.position / factor == pytest.approx(expected.position, abs=3e-15)
    assert found.velocity / factor == pytest.approx(expected.velocity, abs=3e-15)
    assert found.acceleration / factor == pytest.approx(expected.acceleration, abs=5e-14)


def snapped(point):
    """Rounded to 2^-30 m, so that whole numbers of metres up to 2^22 can be added without rounding."""
    return tuple(np.round(np.array(point) * 2.0**30) / 2.0**30)


@pytest.mark.parametrize("offset", [(1e6, 0.0, 0.0), (-1e6, 1e6, 2e6)])
def test_place_does_not_matter(offset):
    """A thousand kilometres away: only the sum with the position rounds, at 1e-10 m; the motion keeps all its digits."""
    here = placed(mcpherson(), snapped)
    away = placed(here, lambda point: tuple(np.add(point, offset)))
    found, expected = wheel(away), wheel(here)
    assert np.abs(found.position - (expected.position + offset)).max() <= 2.4e-10
    assert (found.velocity == expected.velocity).all()
    assert (found.acceleration == expected.acceleration).all()


def test_orientation_does_not_matter():
    """The strut turned in space, and the direction of its driver with it."""
    turn = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)

    def turned(point):
        return tuple(turn @ point)

    m = placed(mcpherson(), turned, turned)
    m = replace(m, drivers=[PointCoordinate("stroke", "wheel", turned((0.0, 0.0, 1.0)))])
    found, expected = wheel(m), wheel()
    # turning rounds every hardpoint, as scaling does
    assert found.position @ turn == pytest.approx(expected.position, abs=3e-15)
    assert found.velocity @ turn == pytest.approx(expected.velocity, abs=5e-15)
    assert found.acceleration @ turn == pytest.approx(expected.acceleration, abs=5e-14)


def test_units_of_axes_do_not_matter():
    m = mcpherson()
    long = placed(m, tuple, lambda axis: tuple(137.0 * np.array(axis)))
    assert_same(wheel(long), wheel())
    drawn = replace(m, drivers=[PointCoordinate("stroke", "wheel", (0.0, 0.0, 4.0))])
    assert_same(wheel(drawn), wheel(), 0.0, 0.0, 0.0)


def test_a_free_pendulum_of_many_bodies():
    """A chain of balls and rods pulled at its end: more bodies than joints carry, and a mechanism without a loop."""
    links = [Body(f"link {k}") for k in range(3)]
    hinges = [
        Revolute(f"hinge {k}", "ground" if k == 0 else f"link {k - 1}", f"link {k}", (float(k), 0.0, 0.0), (0.0, 1.0, 0.0))
        for k in range(3)
    ]
    held = [replace(slider_crank().driver("turn"), name=f"turn {k}", joint=f"hinge {k}") for k in range(3)]
    m = Mechanism("chain", links, hinges, [Point("tip", "link 2", (3.0, 0.0, 0.0))], held)
    angles = np.linspace(-3.0, 3.0, 13)
    tip = solve(m, "turn 1", angles).points["tip"]
    assert tip.position[:, 0] == pytest.approx(1.0 + 2.0 * np.cos(angles), abs=2e-15)
    assert tip.position[:, 2] == pytest.approx(-2.0 * np.sin(angles), abs=2e-15)
    assert tip.acceleration[:, 0] == pytest.approx(-2.0 * np.cos(angles), abs=5e-15)


def test_a_ball_in_a_fork():
    """Spherical pairs and rods only: an arm on two balls driven at its tip swings about the line through them."""
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
