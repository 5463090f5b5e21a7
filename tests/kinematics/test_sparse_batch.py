"""Samples of a sparse system solved together, in an order of elimination found once: what they are
by pivots chosen for each, and never what cannot be believed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core.kinematics.blocks.sparse_lanes import SparseLanes
from kincheck.core.kinematics.compiled.request import Request
from kincheck.core.kinematics.sparse.poses import ChosenPivots, FixedOrder, error_bounds
from kincheck.core.kinematics.sparse.sparse_equations import SparseEquations
from kincheck.core.studies.bench.ring import ring

from ..support.block_structures import solve_sparse
from ..support.mechanisms import four_bar
from .test_cascade import assert_alike
from .test_chain import LEAN, chain
from .test_corners import loop
from .test_sparse import CRANK, WAYS, turning

pytest.importorskip("llvmlite", reason="llvmlite is not installed")
POINTS = tuple(point.name for point in ring(9).points)


@pytest.mark.parametrize("count", [4, 9, 65])
def test_fixed_order_agrees_with_chosen_pivots(count):
    path = turning(*np.linspace(-0.4, 0.4, count))
    assert_alike(
        solve_sparse(ring(20), path, POINTS), solve_sparse(ring(20), path, POINTS, compiled=False)
    )


def test_samples_after_the_first_eight_take_one_iteration():
    found = solve_sparse(ring(12), turning(*np.linspace(0.0, 0.8, 33)))
    assert (found.iterations[16:] == 1).all()  # none of the group that the eighth is in


def test_samples_in_any_order_at_any_distance_and_twice():
    times = np.random.default_rng(3).uniform(-0.9, 0.9, 40)
    path = turning(*np.concatenate([times, times[:3], [0.0, 0.0]]))
    assert_alike(
        solve_sparse(ring(9), path, POINTS), solve_sparse(ring(9), path, POINTS, compiled=False)
    )


def lanes_of(mechanism, *, compiled=True, tol=1e-12):
    """A mechanism as a sparse system at the beginning of a turn."""
    found = SparseLanes(SparseEquations(mechanism, compiled=compiled), Request(("turn",), ()))
    found.accept(tol)
    found.depart(0.0, turning(0.0))
    return found


def reached(lanes, *times):
    """How many neighbours are accepted, from the first one on."""
    table = lanes.sampled(np.array(times), turning(*times))
    good = lanes.attempt_at(table, neighbours=True) > 0.0
    return len(good) if good.all() else int(good.argmin())


def test_bounds_agree_in_both_orders():
    """Errors that residuals leave, by a fixed order and by chosen pivots, of more poses than are
    solved at once.
    """
    lanes = lanes_of(ring(13))
    model, here = lanes.model, lanes.here
    ways = FixedOrder(model, here.rows), ChosenPivots(model, here.rows)
    state = np.repeat(here.state[:, None], 11, axis=1)
    drives = np.repeat(here.drives[:, None], 11, axis=1)
    fixed, chosen = (error_bounds(way, state, drives, model.scale, 2) for way in ways)
    assert fixed.shape == (11,)
    assert (chosen > 0.0).all()
    assert (np.abs(np.log10(fixed / chosen)) < 1.0).all()


@pytest.mark.parametrize("compiled", [False, True])
def test_what_cannot_be_believed_is_refused(compiled):
    lanes, times = lanes_of(four_bar(), compiled=compiled), (0.01, 0.02, 0.03, 0.04)
    start = lanes.anchor(0.0)
    here = start.pose

    def reached_from(pose, *other):
        lanes.restore(replace(start, pose=pose))
        return reached(lanes, *(other or times))

    assert reached_from(here) == 4
    assert reached_from(replace(here, orientation=bytes(len(here.orientation)))) == 0
    # as if it were next to singular
    assert reached_from(replace(here, largest_pivot=1e12)) == 0
    # further than can be told from another motion
    assert reached_from(here, 0.01, 0.02, 1.2, 1.21) == 2
    assert reached_from(here, 0.01, float("nan"), 0.03, 0.04) == 1
    # the way is not what the rates say
    assert reached_from(replace(here, rates=2.0 * here.rates)) == 0
    lanes.accept(-1.0)
    assert reached_from(here) == 0
    lanes.accept(1e-12)
    assert reached_from(here) == 4


@WAYS
def test_step_too_long_to_tell_is_refused(compiled):
    assert reached(lanes_of(CRANK, compiled=compiled), 1.03) == 1
    # half of it is more than 0.5 in Euler parameters
    assert reached(lanes_of(CRANK, compiled=compiled), 1.06) == 0


@WAYS
def test_singular_pose_of_many_loops_is_told(compiled):
    turn = np.linspace(0.0, 2.4, 7)
    found = solve_sparse(chain(3), turning(*turn), ["end"], compiled=compiled)
    assert found.solved.all(), found.message
    (note,) = found.details["notes"]
    assert "crosses a singular pose near turn = 1.870" in note
    expected = np.column_stack([3.0 + np.sin(LEAN - turn), np.cos(LEAN - turn), 0.0 * turn])
    assert np.abs(found.points["end"].position - expected).max() <= 1e-13


@pytest.mark.parametrize(
    ("short", "count", "loops", "compiled"),
    [
        (1e-3, 9, 1, False),
        (1e-3, 50, 2, True),
        (1e-8, 2, 2, False),
        (1e-8, 9, 2, True),
        (1e-8, 50, 2, False),
        (1e-8, 50, 2, True),
    ],
)
def test_a_gap_is_the_end_also_of_two_loops_at_once(short, count, loops, compiled):
    """Their determinants change their signs together, and that of the whole keeps it."""
    turn = np.linspace(0.0, 2.0, count)
    found = solve_sparse(
        loop(np.pi - 1.0, 0.0, rod=1.2 - short, rocker=0.8, loops=loops),
        turning(*turn),
        compiled=compiled,
    )
    assert (found.solved == (turn < 1.0 - np.pi + 2.0 * np.arcsin(1.0 - 0.5 * short))).all()
