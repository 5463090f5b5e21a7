"""Large mechanisms by the front door: how they are solved, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core import Body, Gear, Point, Revolute, SolveError, solve
from kincheck.core.harness.bench.ring import ring

Z = (0.0, 0.0, 1.0)


@pytest.mark.parametrize("cranks", [12, 24])
def test_a_large_mechanism_that_is_not_driven_is_told_what_can_move(cranks):
    with pytest.raises(SolveError, match=r"1 degree of freedom .* but 0 drivers; .*crank"):
        solve(replace(ring(cranks), drivers=()), "turn", [0.0])


def test_a_gear_leaves_a_large_mechanism_a_sparse_system():
    """As one program 47 bodies take seventeen seconds to be made ready."""
    whole, cranks = ring(24), 24
    at = (-2.0, 0.0, 0.0)
    joints = [*whole.joints, Revolute("shaft", "ground", "wheel", at, Z)]
    points = [*whole.points, Point("rim", "wheel", (-1.0, 0.0, 0.0))]
    gear = Gear("gear", ("shaft", f"pivot{cranks // 2}"), ratio=-2.0)
    turn = np.linspace(-0.4, 0.4, 9)
    found = solve(
        replace(whole, bodies=[*whole.bodies, Body("wheel")], joints=joints, points=points, couplers=[gear]), "turn", turn
    )
    assert found.solved.all(), found.message
    assert "factor_entries" in found.details
    s, c, o = np.sin(-2.0 * turn), np.cos(-2.0 * turn), 0.0 * turn
    assert np.abs(found.points["rim"].position - np.column_stack([c - 2.0, s, o])).max() <= 1e-14
    assert np.abs(found.points["rim"].velocity - -2.0 * np.column_stack([-s, c, o])).max() <= 1e-13
