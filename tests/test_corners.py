"""Corners and gaps that are narrower than a step: turned round, or told as the end of the motion, and never stepped over."""

import numpy as np
import pytest
from kincheck.core import Body, Distance, JointAngle, Mechanism, Point, Revolute, solve

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
    """A crank of one metre, whose pin passes the rocker's pivot at a distance; or several such rockers, alike."""
    start = np.float64(start)
    meet = tuple(corner(start, beside, rod, rocker).tolist())
    rockers = ["rocker", "twin"][:loops]
    rests = [Revolute(f"rest of {each}", "ground", each, (1.0 - beside, 0.0, 0.0), Z) for each in rockers]
    rods = [Distance(f"rod of {each}", "crank", each, (tuple(pin(start).tolist()), meet)) for each in rockers]
    return Mechanism(
        "loop",
        [Body("crank"), *map(Body, rockers)],
        [Revolute("pivot", "ground", "crank", ORIGIN, Z), *rests, *rods],
        [Point("meet", rockers[-1], meet)],
        [JointAngle("turn", "pivot")],
    )


@pytest.mark.parametrize("loops", [1, 2])
@pytest.mark.parametrize("order", [0, 2])
@pytest.mark.parametrize("count", [2, 3, 8, 400])
@pytest.mark.parametrize("beside", [1e-2, 1e-3, -1e-4, 1e-5, -3e-6])
def test_a_corner_is_turned_round(beside, count, order, loops):
    """The rocker makes half a turn while the crank's pin passes its pivot."""
    turn = np.linspace(0.0, 2.0, count)
    found = solve(loop(-1.0, beside, loops=loops), "turn", turn, order=order)
    assert found.solved.all(), found.message
    # one over the distance of the two is the condition there, and all that follows goes through it
    assert np.abs(found.points["meet"].position - corner(turn - 1.0, beside)).max() <= 1e-13 / abs(beside)
    assert "notes" not in found.details


@pytest.mark.parametrize("loops", [1, 2])
@pytest.mark.parametrize("beside", [1e-6, 1e-9, -1e-12])
def test_a_corner_that_is_too_narrow_is_no_straight_way(beside, loops):
    turn = np.linspace(0.0, 2.0, 9)
    found = solve(loop(-1.0, beside, loops=loops), "turn", turn)
    assert found.solved[:4].all()
    assert not found.solved[5:].any()
    assert "there is a singular pose ahead" in found.message
    assert "smallest singular value" in found.message


# Crank and pivots in line, the pin two metres from the rocker's pivot: rod and rocker are too short to reach it by this.
# Of two loops alike the determinants change their signs together, and that of the whole keeps it.
@pytest.mark.parametrize("loops", [1, 2])
@pytest.mark.parametrize("short", [1e-2, 1e-5, 1e-8, 1e-10])
@pytest.mark.parametrize("count", [2, 5, 9, 300])
def test_a_gap_is_the_end(short, count, loops):
    turn = np.linspace(0.0, 2.0, count)
    mechanism = loop(np.pi - 1.0, 0.0, rod=1.2 - short, rocker=0.8, loops=loops)
    found = solve(mechanism, "turn", turn, order=0)
    end = np.pi - 2.0 * np.arcsin(1.0 - 0.5 * short)  # by the triangle, from where all is in line
    assert (found.solved == (turn < 1.0 - end)).all()
    assert f"the limit of travel is turn = {1.0 - end:.6g}"[:-1] in found.message
