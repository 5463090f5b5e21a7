"""Beside a singular pose that it misses a motion turns sharply: it is followed there as far as rounding does not turn it.

A linkage that is nearly a kite: crank and ground are of one length but for a little, coupler and rocker of another. Where the
crank's pin passes the rocker's pivot, coupler and rocker turn over together while the crank hardly moves.
"""

import numpy as np
import pytest
from kincheck.core import Body, JointAngle, Mechanism, Point, Revolute, solve

GROUND, LINK, UP = 0.4, 1.0, 1.2
AXIS = (0.0, 0.0, 1.0)


def kite(turns, off):
    """B and C of the linkage, C by the bisector of B and the rocker's pivot, on the side where it was at first."""
    b = GROUND * (1.0 - off) * np.column_stack([np.cos(UP + turns), np.sin(UP + turns)])
    half = 0.5 * (np.array([GROUND, 0.0]) - b)
    apart = (half * half).sum(axis=1)
    away = np.sqrt(LINK**2 - apart) / np.sqrt(apart)
    return b, b + half + away[:, None] * np.column_stack([-half[:, 1], half[:, 0]])


def mechanism(off, loops):
    (b,), (c,) = kite(np.zeros(1), off)
    pin, tip, rest = ((*map(float, x), 0.0) for x in (b, c, (GROUND, 0.0)))
    return Mechanism(
        "nearly a kite",
        [Body("crank"), *(Body(f"{name} {k}") for k in range(loops) for name in ("coupler", "rocker"))],
        [
            Revolute("A", "ground", "crank", (0.0, 0.0, 0.0), AXIS),
            *(Revolute(f"B {k}", "crank", f"coupler {k}", pin, AXIS) for k in range(loops)),
            *(Revolute(f"C {k}", f"coupler {k}", f"rocker {k}", tip, AXIS) for k in range(loops)),
            *(Revolute(f"D {k}", "ground", f"rocker {k}", rest, AXIS) for k in range(loops)),
        ],
        [Point(f"C {k}", f"rocker {k}", tip) for k in range(loops)],
        [JointAngle("turn", "A")],
    )


TURNS = np.linspace(0.0, -2.4, 25) + 0.05


@pytest.mark.parametrize("loops", [1, 2])
@pytest.mark.parametrize("off", [1e-2, 1e-4, 1e-5, 3e-6])
def test_a_corner_is_followed(off, loops):
    found = solve(mechanism(off, loops), "turn", TURNS)
    assert found.solved.all(), found.message
    _, expected = kite(TURNS, off)
    for k in range(loops):
        # where the pin is nearest to the pivot, a hundredth of a link from it, round-off of both turns the coupler a hundredfold
        assert np.abs(found.points[f"C {k}"].position[:, :2] - expected).max() <= 1e-13


@pytest.mark.parametrize("loops", [1, 2])
@pytest.mark.parametrize("off", [1e-8, 1e-10])
def test_a_corner_that_rounding_could_turn_is_refused(off, loops):
    found = solve(mechanism(off, loops), "turn", TURNS)
    assert found.solved.any()
    assert not found.solved.all()
    assert "singular pose" in found.message
    _, expected = kite(TURNS, off)
    assert np.abs(found.points["C 0"].position[:, :2] - expected)[found.solved].max() <= 1e-14
