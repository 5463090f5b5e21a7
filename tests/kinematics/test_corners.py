"""Corners and gaps that are narrower than a step: turned round, or told as the end of the motion,
and never stepped over.
"""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core import (
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

Z, ORIGIN, ROD = (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 0.8


def pin(angle):
    return np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=-1)


def corner(angle, beside, rod=ROD, rocker=ROD):
    """Where rod and rocker meet, on the left from the rocker's pivot to the crank's pin."""
    pivot = np.array([1.0 - beside, 0.0, 0.0])
    d = pin(angle) - pivot
    square = (d * d).sum(axis=-1, keepdims=True)
    along = 0.5 * (square + rocker**2 - rod**2) / square
    left = np.stack([-d[..., 1], d[..., 0], d[..., 2]], axis=-1)
    return pivot + along * d + np.sqrt(rocker**2 / square - along**2) * left


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


@pytest.mark.parametrize(
    ("beside", "count", "loops"),
    latin([1e-2, 1e-3, -1e-4, 1e-5, -3e-6], [2, 3, 8, 400], [1, 2]),
)
def test_corner_is_turned(beside, count, loops):
    """The rocker makes half a turn while the crank's pin passes its pivot."""
    turn = np.linspace(0.0, 2.0, count)
    found = solve(loop(-1.0, beside, loops=loops), "turn", turn, order=loops - 1)
    assert found.solved.all(), found.message
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
    found = [solve(mechanism, "turn", [0.0, 1.0], order=order) for order in range(3)]
    assert [each.solved.all() for each in found] == [True] * 3
    assert all("crosses a singular pose" in each.details["notes"][0] for each in found)
    for each in found[1:]:
        np.testing.assert_allclose(
            each.points["tip"].position, found[0].points["tip"].position, rtol=0.0, atol=1e-12
        )


def test_gap_verdict_ignores_wanted_points():
    """The crank's own motion is smooth, whatever the rocker does."""
    mechanism, turn = (
        loop(np.pi - 1.0, 1e-7, rod=1.2 - 1e-10, rocker=0.8),
        np.linspace(0.0, 2.0, 300),
    )
    pinned = replace(mechanism, points=[Point("pin", "crank", (1.0, 0.0, 0.0))])
    whole, crank = (solve(each, "turn", turn) for each in (mechanism, pinned))
    assert not whole.solved.all()
    np.testing.assert_array_equal(crank.solved, whole.solved)
