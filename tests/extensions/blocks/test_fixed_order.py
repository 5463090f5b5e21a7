"""Factors of eight sparse matrices at once against dense ones of numpy."""

import numpy as np
import pytest

pytest.importorskip("llvmlite")
from kincheck.core.extensions.blocks import fixed_order
from kincheck.core.extensions.blocks.fixed_order import LANES, FixedOrder

EPSILON = float(np.finfo(float).eps)


def matrices(n, seed, share=0.2):
    """Return a random pattern with the diagonal, and diagonally dominant matrices, dense too."""
    random = np.random.default_rng(seed)
    rows, columns = np.nonzero((random.random((n, n)) < share) | np.eye(n, dtype=bool))
    mixed = random.permutation(len(rows))
    rows, columns = rows[mixed], columns[mixed]
    entries = random.normal(size=(len(rows), LANES))
    entries[rows == columns] += 2.0 * n
    dense = np.zeros((LANES, n, n))
    dense[:, rows, columns] = entries.T
    return rows, columns, entries, dense


@pytest.mark.parametrize("n", [1, 2, 7, 40])
def test_fixed_order_factors_solve_as_dense(n):
    rows, columns, entries, dense = matrices(n, seed=n)
    order = FixedOrder(rows, columns, n, np.arange(len(rows)))
    order.factor(entries)
    b = np.random.default_rng(0).normal(size=(n, LANES))
    for transposed in (False, True):
        found = order.solve(b, transposed=transposed)
        matrix = dense.swapaxes(1, 2) if transposed else dense
        expected = np.linalg.solve(matrix, b.T[..., None])[..., 0].T
        # round-off by the condition, below 10 of matrices so dominant, times their rows
        assert np.abs(found - expected).max() <= 100.0 * n * EPSILON
    assert (order.inverse < np.inf).all()
    assert (order.odd == (np.linalg.det(dense) < 0.0)).all()


def test_fixed_order_reports_growth_and_zeros():
    rows, columns = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
    entries = np.tile([[2.0], [1.0], [1.0], [-3.0]], LANES)
    entries[0, 1], entries[0, 2], entries[3, 3], entries[1, 4] = 1e-3, 0.0, 0.5, np.nan
    order = FixedOrder(rows, columns, 2, np.arange(4))
    order.factor(entries)
    assert order.growth[:2] == pytest.approx([0.5, 1e3])
    assert not order.growth[2] <= 1e300
    finite = [True, True, False, False, False, True, True, True]
    assert (order.inverse < np.inf).tolist() == finite
    assert order.odd[[0, 1]].all()


def test_fixed_order_factors_are_replaced():
    rows, columns, entries, dense = matrices(13, seed=3)
    order = FixedOrder(rows, columns, 13, np.arange(len(rows)))
    for scale in (1.0, -4.0):
        order.factor(scale * entries)
        found = order.solve(np.ones((13, LANES)))
        assert np.abs(scale * np.einsum("kij,jk->ik", dense, found) - 1.0).max() <= 1e-13
    assert order.odd.all()


def test_code_is_kept_by_text(monkeypatch):
    keys = list[str]()
    monkeypatch.setattr(fixed_order, "load", lambda key, *_: keys.append(key))
    fixed_order.load_loops.__wrapped__()
    monkeypatch.setattr(fixed_order, "_factor", lambda: "; another text")
    fixed_order.load_loops.__wrapped__()
    assert len({*keys}) == 2
