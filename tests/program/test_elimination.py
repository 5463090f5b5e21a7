"""Elimination written into programs, against numpy.linalg, lane by lane."""

from functools import reduce

import numpy as np
import pytest
from kincheck.core.program import Elimination, Tape, absolute, minimum, program

from ..support.program_blocks import run_on

LITERALS = [1.0, -1.0, 1.0, -1.0, 0.5, 0.3, -2.0]


def random_matrix(rng, n, lanes, density, literal):
    """Values of a random matrix, shape (lanes, n, n), and which of its entries are literals."""
    values = rng.normal(size=(lanes, n, n))
    values[:, rng.random((n, n)) > density] = 0.0
    where = rng.permutation(n)  # a full transversal: structurally regular
    values[:, np.arange(n), where] = rng.normal(size=(lanes, n))
    literals = (rng.random((n, n)) < literal) & (values[0] != 0.0)
    values[:, literals] = rng.choice(LITERALS, size=literals.sum())
    return values, literals


def eliminate(values, literals, right, solve=Elimination.solve):
    """Solutions by a traced elimination, shape (lanes, n); the smallest pivot of each lane; the
    elimination.
    """
    lanes, n, _ = values.shape
    tape = Tape()
    used = np.any(values != 0.0, axis=0)

    def entry(i, j):
        return float(values[0, i, j]) if literals[i, j] else tape.input(n * i + j)

    rows = [{j: entry(i, j) for j in range(n) if used[i, j]} for i in range(n)]
    elimination = Elimination(rows)
    b = [tape.input(n * n + i) if np.any(right[:, i]) else 0.0 for i in range(n)]
    smallest = reduce(minimum, (absolute(x) for x in elimination.pivots), 1e300)
    outputs = {n * (n + 1) + i: x for i, x in enumerate(solve(elimination, b))} | {
        n * (n + 2): smallest
    }
    block = np.zeros((n * (n + 2) + 1, lanes))
    block[: n * n], block[n * n : n * (n + 1)] = values.reshape(lanes, -1).T, right.T
    run_on([program("p", tape, outputs)], block)
    return block[n * (n + 1) : -1].T, block[-1], elimination


@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize("density", [0.15, 0.4, 1.0])
@pytest.mark.parametrize("literal", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("n", [1, 2, 5, 9])
def test_elimination_equals_numpy_solve(n, density, literal, transposed):
    """In each lane by its own pivots, with several blocks where entries are few; the same factors
    solve the transposed system.
    """
    solve = Elimination.solve_transposed if transposed else Elimination.solve
    rng = np.random.default_rng([n, int(10 * density), int(10 * literal)])
    for _ in range(3):
        values, literals = random_matrix(rng, n, 20, density, literal)
        right = rng.normal(size=(20, n)) * (rng.random(n) < 0.6)
        if np.linalg.cond(values).max() > 1e6 and literals.all():
            continue
        found, _, _ = eliminate(values, literals, right, solve)
        matrices = values.swapaxes(1, 2) if transposed else values
        expected = np.linalg.solve(matrices, right[:, :, None])[:, :, 0]
        # the growth of the free pivots, beside the condition, limits what may be asked
        error = np.abs(found - expected).max(axis=1) / (np.abs(expected).max(axis=1) + 1e-300)
        assert (error <= 1e-13 * np.linalg.cond(values)).all()


def test_elimination_pivots_by_lane():
    """Each lane is another permutation matrix: a pivot order that serves one lane is zero in
    another.
    """
    rng = np.random.default_rng(5)
    values = np.array([np.eye(5)[rng.permutation(5)] for _ in range(60)])
    right = rng.normal(size=(60, 5))
    found, pivots, elimination = eliminate(values, np.zeros((5, 5), dtype=bool), right)
    assert [len(core.rows) for core in elimination.cores] == [5]
    np.testing.assert_array_equal(found, np.linalg.solve(values, right[:, :, None])[:, :, 0])
    assert (pivots == 1.0).all()


@pytest.mark.parametrize("known", [False, True])
def test_elimination_avoids_small_pivots(known):
    """The classic: without exchange the answer is lost to round-off; a literal is no safer."""
    values = np.array([[[1e-20, 1.0], [1.0, 1.0]], [[1.0, 1.0], [1e-20, 1.0]]])[: 2 - known]
    literals = np.array([[known, False], [False, False]])
    found, _, _ = eliminate(values, literals, np.array([[1.0, 2.0], [2.0, 1.0]])[: 2 - known])
    assert found == pytest.approx(np.ones((2 - known, 2)), rel=1e-15)


def test_elimination_uses_constant_blocks_first():
    """The +-I blocks of the simplified rows leave a core of the rest only, whatever stands beside
    them.
    """
    tape = Tape()
    rows = [{k: 1.0, 3: tape.input(3 * k), 4: tape.input(3 * k + 1)} for k in range(3)]
    rows += [
        {0: tape.input(9), 1: tape.input(10), 3: tape.input(11)},
        {2: tape.input(12), 4: tape.input(13)},
    ]
    assert max(len(core.rows) for core in Elimination(rows).cores) <= 2
    identity = Elimination([{k: -1.0} for k in range(6)])
    assert identity.cores == identity.pivots == []
    assert identity.solve([1.0, 0.0, 2.0, 0.0, 0.0, 3.0]) == [-1.0, 0.0, -2.0, 0.0, 0.0, -3.0]


def test_elimination_with_singular_lanes():
    rng = np.random.default_rng(6)
    values = rng.normal(size=(6, 4, 4))
    values[2, 3] = values[2, 0] + values[2, 1]  # dependent to round-off
    values[4, 1] = 0.0  # exactly
    right = rng.normal(size=(6, 4))
    found, pivots, _ = eliminate(values, np.zeros((4, 4), dtype=bool), right)
    assert pivots[2] < 1e-13
    assert pivots[4] == 0.0 or np.isnan(pivots[4])
    assert not np.isfinite(found[4]).all()
    sound = [0, 1, 3, 5]
    assert pivots[sound].min() > 1e-3
    assert found[sound] == pytest.approx(
        np.linalg.solve(values[sound], right[sound, :, None])[:, :, 0], rel=1e-10
    )


TAPE = Tape()
SINGULAR = {
    "dependent literals": [{0: 1.0, 1: 1.0}, {0: 1.0, 1: 1.0}],
    "empty row": [{0: TAPE.input(0), 1: TAPE.input(1)}, {}],
    "empty column": [{0: TAPE.input(0)}, {0: TAPE.input(1)}],
    "three rows in two columns": [{j: TAPE.input(3 * k + j) for j in range(2)} for k in range(3)],
}


@pytest.mark.parametrize("name", SINGULAR)
def test_structurally_singular_matrix_is_refused(name):
    with pytest.raises(ZeroDivisionError, match="singular whatever the pose"):
        Elimination(SINGULAR[name])
