"""Samples of a sparse system solved together: what they are one by one, and never what cannot be
believed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from kincheck.core.kinematics.sparse import batched_newton as module
from kincheck.core.kinematics.sparse.batched_newton import Batch
from kincheck.core.kinematics.sparse.sparse_model import SparseModel
from kincheck.core.kinematics.sparse.step_state import Stand
from kincheck.core.kinematics.sparse.sweep import solve_sparse
from kincheck.core.kinematics.sparse.tables import SparseTables
from kincheck.core.kinematics.structure import sparse_lu
from kincheck.core.studies.bench.ring import ring

from ..support.mechanisms import four_bar
from .test_cascade import assert_alike
from .test_chain import chain
from .test_corners import loop
from .test_sparse import CRANK, WAYS, turning

pytest.importorskip("llvmlite", reason="llvmlite is not installed")
POINTS = tuple(point.name for point in ring(9).points)


@pytest.fixture
def alone(monkeypatch):
    """The samples that were reached one by one."""
    found, reach = list[float](), SparseModel.reach

    def counted(self: SparseModel, here: Stand, time: float, drives, tol: float) -> Stand:
        found.append(time)
        return reach(self, here, time, drives, tol)

    monkeypatch.setattr(SparseModel, "reach", counted)
    return found


def one_by_one(mechanism, path, points=POINTS):
    return solve_sparse(SparseModel(mechanism, compiled=False), path, points)


@pytest.mark.parametrize("count", [4, 9, 65])
def test_a_smooth_sweep_needs_no_sample_alone(count, alone):
    model, path = (
        SparseModel(ring(20)),
        turning(*np.linspace(-0.4, 0.4, count)) if count > 4 else turning(0.0, 0.05, 0.1, 0.15),
    )
    found = solve_sparse(model, path, POINTS)
    assert not alone
    assert_alike(found, one_by_one(ring(20), path))


def test_samples_after_the_first_eight_take_one_iteration():
    found = solve_sparse(SparseModel(ring(12)), turning(*np.linspace(0.0, 0.8, 33)))
    assert (found.iterations[16:] == 1).all()  # none of the group that the eighth is in


def test_samples_in_any_order_at_any_distance_and_twice():
    times = np.random.default_rng(3).uniform(-0.9, 0.9, 40)
    times = np.concatenate([times, times[:3], [0.0, 0.0]])
    assert_alike(
        solve_sparse(SparseModel(ring(9)), turning(*times), POINTS),
        one_by_one(ring(9), turning(*times)),
    )


def test_samples_that_come_twice_are_solved_together_too(alone):
    solve_sparse(SparseModel(ring(9)), turning(*np.repeat(np.linspace(0.0, 0.4, 20), 2)))
    assert not alone


def test_few_samples_are_not_worth_making_it_ready():
    model = SparseModel(ring(9))
    solve_sparse(model, turning(0.1, 0.2, 0.3))
    assert "together" not in vars(model)
    solve_sparse(model, turning(0.1, 0.2, 0.3, 0.4))
    assert "together" in vars(model)


def test_an_order_that_serves_no_longer_is_renewed(monkeypatch, alone):
    # rows are exchanged, and not kept for as long as they may
    monkeypatch.setattr(sparse_lu, "PIVOT_THRESHOLD", 1.0)
    ordered, order = list[float](), Batch.order
    monkeypatch.setattr(
        Batch, "order", lambda self, model: order(self, model) or ordered.append(self._sign[0])
    )
    monkeypatch.setattr(module, "GROWTH", 1.5)
    path = turning(*np.linspace(0.0, 1.5, 100))
    found = solve_sparse(SparseModel(ring(13)), path, POINTS)
    assert {*ordered} == {-1.0, 1.0}
    assert len(alone) < 35
    assert_alike(found, one_by_one(ring(13), path))


def stood(model: SparseModel, turn: float = 0.0) -> Stand:
    return model.moving(model.design, turn, model.drives(turning(turn), np.array([turn]))[:, 0])


def reached(model: SparseModel, here: Stand, times, tol: float = 1e-12) -> int:
    found = np.array(times)
    assert model.together is not None
    return len(model.together.reach([here], found, model.drives(turning(*times), found), tol))


def test_what_cannot_be_believed_is_refused():
    model = SparseModel(four_bar())
    here, times = stood(model), [0.01, 0.02, 0.03]
    assert reached(model, here, times) == 3
    assert reached(model, replace(here, orientation=bytes(len(here.orientation))), times) == 0
    # as if it were next to singular
    assert reached(model, replace(here, largest_pivot=1e12), times) == 0
    assert reached(model, here, times, tol=-1.0) == 0
    # further than can be told from another motion
    assert reached(model, here, [0.01, 0.02, 1.2, 1.21]) == 2
    assert reached(model, here, [0.01, float("nan"), 0.03]) == 1
    # the way is not what the rates say
    assert reached(model, replace(here, rates=2.0 * here.rates), times) == 0
    assert reached(model, here, times) == 3


def test_a_step_that_is_longer_than_can_be_told_from_another_is_refused():
    model = SparseModel(CRANK)
    assert reached(model, stood(model), [1.03]) == 1
    # half of it is more than 0.5 in Euler parameters
    assert reached(model, stood(model), [1.06]) == 0


def changed(monkeypatch, quantity: str, change) -> None:
    """All poses have other numbers than they have."""
    get = SparseTables.__getitem__

    def got(self: SparseTables, name: str):
        return change(get(self, name)) if name == quantity else get(self, name)

    monkeypatch.setattr(SparseTables, "__getitem__", got)


def test_rows_that_contradict_the_others_are_refused(monkeypatch):
    model = SparseModel(four_bar())
    here = stood(model)
    assert len(model.dropped)

    def contradicting(phi):
        found = phi.copy()
        found[model.dropped[0], 1] = 1e-6
        return found

    changed(monkeypatch, "phi", contradicting)
    assert reached(model, here, [0.01, 0.02, 0.03]) == 1


def test_another_branch_is_refused(monkeypatch):
    model = SparseModel(four_bar())
    here = stood(model)
    assert reached(model, here, [0.01, 0.02, 0.03]) == 3
    changed(monkeypatch, "branch", np.negative)
    assert reached(model, here, [0.01, 0.02, 0.03]) == 0


@WAYS
def test_a_singular_pose_is_not_stepped_over(compiled):
    found = solve_sparse(
        SparseModel(chain(3), compiled=compiled), turning(*np.linspace(0.0, 2.4, 7)), ["end"]
    )
    assert found.solved.tolist() == [True] * 5 + [False] * 2
    assert "cannot be followed beyond turn = 1.8707" in found.message
    assert "there is a singular pose ahead" in found.message


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
        SparseModel(
            loop(np.pi - 1.0, 0.0, rod=1.2 - short, rocker=0.8, loops=loops), compiled=compiled
        ),
        turning(*turn),
    )
    assert (found.solved == (turn < 1.0 - np.pi + 2.0 * np.arcsin(1.0 - 0.5 * short))).all()
