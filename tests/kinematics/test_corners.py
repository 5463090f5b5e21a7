"""Corners and gaps that are narrower than a step: turned round, or told as the end of the motion,
and never stepped over.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck import (
    Body,
    ConstantVelocity,
    Distance,
    Inline,
    JointAngle,
    Mechanism,
    Point,
    Revolute,
    solve,
)
from kincheck.core.kinematics import styles

from ..support.examples import examples
from ..support.mechanisms import ORIGIN, X, Z, circles_meet, planar_four_bar, solve_all

(NEARLY_KITES,) = examples(__file__, "nearly_kites")

ROD = 0.8


def pin(angle):
    return np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)


def corner(angle, beside, rod=ROD, rocker=ROD):
    """Where rod and rocker meet, on the left from the rocker's pivot to the crank's pin."""
    return circles_meet((1.0 - beside, 0.0, 0.0), rocker, pin(angle), rod)


def loop(start, beside, rod=ROD, rocker=ROD, loops=1):
    """A crank of one metre, whose pin passes the rocker's pivot at a distance; or several such
    rockers, alike.
    """
    start = np.float64(start)
    meet = tuple(corner(start, beside, rod, rocker).tolist())
    rockers = ["rocker", "twin"][:loops]
    rests = [
        Revolute(f"rest of {each}", "ground", each, (1.0 - beside, 0.0, 0.0), Z) for each in rockers
    ]
    rods = [
        Distance(f"rod of {each}", "crank", each, (tuple(pin(start).tolist()), meet))
        for each in rockers
    ]
    return Mechanism(
        "loop",
        [Body("crank"), *map(Body, rockers)],
        [Revolute("pivot", "ground", "crank", ORIGIN, Z), *rests, *rods],
        [Point("meet", rockers[-1], meet)],
        [JointAngle("turn", "pivot")],
    )


def latin(rows, columns, others):
    """Every row with every column, and with each pair one of the others in turn."""
    return [
        (row, column, others[(i + j) % len(others)])
        for i, row in enumerate(rows)
        for j, column in enumerate(columns)
    ]


@pytest.mark.by_day(3)
@pytest.mark.parametrize(
    ("beside", "count", "loops"), latin([1e-2, 1e-3, -1e-4, 1e-5, -3e-6], [2, 3, 8, 400], [1, 2])
)
def test_corner_is_turned(beside, count, loops):
    """The rocker makes half a turn while the crank's pin passes its pivot."""
    turn = np.linspace(0.0, 2.0, count)
    found = solve_all(loop(-1.0, beside, loops=loops), "turn", turn, order=loops - 1)
    # one over the distance of the two is the condition there, and all that follows goes through it
    assert np.abs(found.points["meet"].position - corner(turn - 1.0, beside)).max() <= 1e-13 / abs(
        beside
    )
    assert "notes" not in found.details


@pytest.mark.parametrize(("beside", "loops"), [(1e-6, 1), (1e-9, 2), (-1e-12, 1), (1e-6, 2)])
def test_narrow_corner_ends_motion(beside, loops):
    turn = np.linspace(0.0, 2.0, 9)
    found = solve(loop(-1.0, beside, loops=loops), "turn", turn)
    assert found.solved[:4].all()
    assert not found.solved[5:].any()
    assert "there is a singular pose ahead" in found.message
    assert "smallest singular value" in found.message


# Crank and pivots in line, the pin two metres from the rocker's pivot: rod and rocker are too short
# to reach it by this. Of two loops alike the determinants change their signs together, and that of
# the whole keeps it.
@pytest.mark.by_day(3)
@pytest.mark.parametrize(
    ("short", "count", "loops"), latin([1e-2, 1e-5, 1e-8, 1e-10], [2, 5, 9, 300], [1, 2])
)
def test_gap_ends_motion(short, count, loops):
    turn = np.linspace(0.0, 2.0, count)
    mechanism = loop(np.pi - 1.0, 0.0, rod=1.2 - short, rocker=0.8, loops=loops)
    found = solve(mechanism, "turn", turn, order=0)
    end = np.pi - 2.0 * np.arcsin(1.0 - 0.5 * short)  # by the triangle, from where all is in line
    assert (found.solved == (turn < 1.0 - end)).all()
    assert f"the limit of travel is turn = {1.0 - end:.6g}"[:-1] in found.message


# Each pair of a base, a lack and a start: a Latin square of the 27.
KITES = [
    (ground, short, (-0.2, -0.4, -0.7)[(row + column) % 3])
    for row, ground in enumerate((1.1, 1.4, 2.0))
    for column, short in enumerate((1e-3, 1e-5, 1e-7))
]


COUNTS = [2, 3, 5, 9, 300]


# every kite with two or three of the counts
@pytest.mark.by_day(3)
@pytest.mark.parametrize(
    ("ground", "short", "start", "count"),
    [(*kite, count) for k, kite in enumerate(KITES) for count in COUNTS[k % 2 :: 2]],
)
def test_kite_gap_ends_motion(ground, short, start, count):
    """A kite that lies on its side: the rod is shorter than the crank, and cannot fold. Beyond,
    what crosses there is as near.
    """
    turn = np.linspace(0.0, -2.0 * start, count)
    found = solve(loop(start, 1.0 - ground, rod=1.0 - short, rocker=ground), "turn", turn, order=0)
    # where rod and rocker are in line
    end = np.arccos((1.0 + ground**2 - (ground - 1.0 + short) ** 2) / (2.0 * ground))
    assert (found.solved == (turn < -start - end)).all()


def test_singular_pose_verdict_ignores_order():
    """The rates interpolated at the pose are worse than the pose; they are not wanted, and what is
    beyond is solved as anywhere.
    """
    joints = [
        Revolute("hinge", "ground", "crank", (0.9, -0.2, 0.0), (-0.9, -0.1, -1.6)),
        ConstantVelocity(
            "joint", "crank", "shaft", (0.1, -1.0, 0.0), ((0.1, 0.6, -0.1), (-0.5, 2.2, 1.3))
        ),
        Inline("groove", "shaft", "ground", (0.4, -1.0, 0.5), (-0.9, 0.9, -0.3)),
    ]
    point = Point("tip", "shaft", (-0.1, 1.7, 1.3))
    mechanism = Mechanism(
        "groove", [Body("crank"), Body("shaft")], joints, [point], [JointAngle("turn", "hinge")]
    )
    found = [solve_all(mechanism, "turn", [0.0, 1.0], order=order) for order in range(3)]
    assert all("crosses a singular pose" in each.details["notes"][0] for each in found)
    for each in found[1:]:
        np.testing.assert_allclose(
            each.points["tip"].position, found[0].points["tip"].position, rtol=0.0, atol=1e-12
        )


def test_gap_verdict_ignores_wanted_points():
    """The crank's own motion is smooth, whatever the rocker does."""
    mechanism = loop(np.pi - 1.0, 1e-7, rod=1.2 - 1e-10, rocker=0.8)
    turn = np.linspace(0.0, 2.0, 300)
    pinned = replace(mechanism, points=[Point("pin", "crank", X)])
    whole, crank = (solve(each, "turn", turn) for each in (mechanism, pinned))
    assert not whole.solved.all()
    np.testing.assert_array_equal(crank.solved, whole.solved)


# Four-bars that nearly fold, with more rows than they need: no choice of rows hides a corner


# and nearly parallelograms: pin, end of the rod, rest of the rocker, last turn, samples


def side_of_the_line(pin, rest, turn, found):
    """By its sign on which side of the line from the pin to the rocker's pivot the rod's end is:
    there it stays.
    """
    (x, y), cos, sin = pin, np.cos(turn), np.sin(turn)
    across = np.stack([rest - (x * cos - y * sin), -(x * sin + y * cos)], axis=-1)
    d = found.points["meet"].position[:, :2] - (np.array([rest, 0.0]) - across)
    return across[:, 0] * d[:, 1] - across[:, 1] * d[:, 0]


STYLES = styles()
# Each kite with both linkages, and with three of the styles, two of which are always the first and
# the last one.
CHOSEN = [
    (name, ("universals", "hinges")[(row + column) % 2], style)
    for row, name in enumerate(NEARLY_KITES)
    for column, style in enumerate((STYLES[0], STYLES[1 + row % (len(STYLES) - 1)], STYLES[-1]))
]


@pytest.mark.by_day(3)
@pytest.mark.parametrize(("name", "ends", "style"), CHOSEN)
def test_chosen_rows_do_not_hide_corner(name, ends, style):
    """A determinant of rows chosen from more changes its sign by a singular pose, and by one of the
    choice; not by both.
    """
    (x, y), meet, rest, last, count = NEARLY_KITES[name]
    turn = np.linspace(0.0, last, count)
    kite = planar_four_bar((x, y, 0.0), (*meet, 0.0), (rest, 0.0, 0.0), ends)
    found = solve(kite, "turn", turn, order=0, style=style)
    side = side_of_the_line((x, y), rest, turn, found)
    assert (side[found.solved] * side[0] > 0.0).all()
    assert found.solved.all() or "there is a singular pose ahead" in found.message
    assert found.solved.sum() >= 3


@pytest.mark.parametrize(
    ("ends", "beside", "style"),
    latin(["universals", "hinges"], [1e-2, -3e-3, 1e-3], [STYLES[0], STYLES[-1]]),
)
def test_nearly_singular_kite_exchanges_rows(ends, beside, style):
    """Those that were chosen at design depend on each other where it lies flat, or so nearly that
    it cannot be told from that.
    """
    start, turn = np.float64(-1.5), np.linspace(0.0, 3.3, 31)
    meet = corner(start, beside, 1.2, 1.2)
    mechanism = planar_four_bar(pin(start), meet, (1.0 - beside, 0.0, 0.0), ends)
    found = solve_all(mechanism, "turn", turn, style=style, order=0)
    expected = corner(start + turn, beside, 1.2, 1.2)
    assert np.abs(found.points["meet"].position - expected).max() <= 1e-13 / abs(beside)


# every count with the native style and another one
@pytest.mark.by_day(3)
@pytest.mark.parametrize(
    ("count", "style"),
    [
        (count, style)
        for k, count in enumerate([4, 7, 8, 10, 12, 15])
        for style in (STYLES[0], STYLES[1 + k % (len(STYLES) - 1)])
    ],
)
def test_small_loop_does_not_hide_corner(count, style):
    """Its singular values are the smaller ones all the way round, but where the large one folds."""
    x, y, rest, end = (
        -0.35245745516404536,
        -0.7148047631848835,
        2.802282190370843,
        (2.175441305403854, 0.49218148289661845),
    )
    across = np.cos(1.345), np.sin(1.345), 0.0
    large = planar_four_bar((x, y, 0.0), (*end, 0.0), (rest, 0.0, 0.0), "universals", across)
    pin, meet = (
        (-0.023472379164771337, -0.0056469601124647896, 0.0),
        (0.0017654205974588259, 0.11112362657419883, 0.0),
    )
    joints = [
        Revolute(
            "small rest", "ground", "small", (0.12433883023528294, 0.04634680743282863, 0.0), Z
        ),
        Distance("small rod", "crank", "small", (pin, meet)),
    ]
    both = replace(large, bodies=[*large.bodies, Body("small")], joints=[*large.joints, *joints])
    turn = np.linspace(0.0, 5.0379839, count)
    found = solve_all(both, "turn", turn, order=0, style=style)
    side = side_of_the_line((x, y), rest, turn, found)
    assert (side * side[0] > 0.0).all()
