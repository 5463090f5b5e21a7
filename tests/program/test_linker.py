"""Programs of many lanes and eliminations as one table: the numbers that programs give one by one,
and dense factors give.
"""

from __future__ import annotations

import numpy as np
import pytest
from kincheck.core.algebra import root
from kincheck.core.program import NumpyExecutor, Plan, Tape, cos, program, where_larger
from kincheck.core.program.linker import MOST, Linker, Memory, joined, numbers
from kincheck.core.program.llvm.compiler import available, vector_width
from kincheck.core.program.memory import address, aligned
from kincheck.core.program.static_lu import FixedOrder

if not available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

from kincheck.core.program.llvm.jit import interpreter

WIDTH = vector_width()


def gone_through(parts, memory: Memory, given: dict[int, np.ndarray]) -> np.ndarray:
    """The rows after a table."""
    rows, words = aligned(memory.count * WIDTH).reshape(-1, WIDTH), joined(parts)
    rows[:] = np.nan  # nothing is read that was not written
    for row, values in given.items():
        rows[row] = values
    interpreter(WIDTH)(address(rows), address(words))
    return rows


@pytest.mark.parametrize("lanes", [1, 3, 8, 9, 21])
def test_lanes_of_a_program_read_and_write_rows_of_their_own(lanes):
    tape = Tape()
    a, b, c = (tape.input(k) for k in range(3))
    product = a * b
    values = {
        3: root(product * product) + c,
        4: where_larger(a, c, product - 0.1, cos(b)),
        5: 7.25,
        6: product,
    }
    traced, memory, rng = program("f", tape, values), Memory(), np.random.default_rng(lanes)
    # the lanes share their third input, and stand in any order
    inputs, shared, outputs = memory.take(2 * lanes), memory.take(1).start, memory.take(4 * lanes)
    places = (
        rng.permutation(numbers(inputs)).reshape(2, lanes),
        rng.permutation(numbers(outputs)).reshape(4, lanes),
    )
    slots = np.concatenate([places[0], np.full((1, lanes), shared), places[1]])
    parts = [Linker(WIDTH).lanes(traced, slots, memory)]
    given = {k: rng.normal(size=WIDTH) for k in (*numbers(inputs), shared)}
    found = gone_through(parts, memory, given)
    one = NumpyExecutor(Plan({"f": traced}, {str(k): k for k in range(7)}), WIDTH)
    for lane in range(lanes):
        one.put(range(3), np.array([given[row] for row in slots[:3, lane]]))
        one.run("f")
        np.testing.assert_allclose(found[slots[3:, lane]], one.get(range(3, 7)), rtol=1e-15)


def test_operations_are_done_in_their_order_and_stage_by_stage():
    link, memory, width = Linker(WIDTH), Memory(), np.ones(WIDTH)
    x, y = memory.take(3), memory.take(3)
    at, to = numbers(x), numbers(y)
    parts = [
        link.operations("+", at, at, np.roll(at, 1)),  # the second takes what the first has become
        link.operations("copy", to, at),
        link.operations("copy", to[:0], at[:0]),
        link.staged(
            3, ("*", np.array([2, 0, 0]), (to, to, to)), ("+", np.array([1, 2, 0]), (to, to, at[0]))
        ),
    ]
    found = gone_through(parts, memory, {0: 1.0 * width, 1: 10.0 * width, 2: 100.0 * width})
    assert found[:3, 0].tolist() == [101.0, 111.0, 211.0]
    assert found[3:, 0].tolist() == [202.0**2, 111.0**2 + 101.0, 211.0**2 + 101.0]


@pytest.mark.parametrize("n", [1, 2, 7, 30])
def test_factors_in_a_given_order_solve_what_dense_ones_do(n):
    rng = np.random.default_rng(n)
    pattern = rng.random((n, n)) < 3.0 / n
    pattern |= np.eye(n, dtype=bool)
    rows, columns = np.nonzero(pattern)
    order = rng.permutation(len(rows))  # entries may come in any order
    rows, columns = rows[order], columns[order]
    matrices = np.zeros((WIDTH, n, n))
    values = rng.normal(size=(len(rows), WIDTH)) + 4.0 * (rows == columns)[:, None]
    matrices[:, rows, columns] = values.T
    link, memory, fixed = Linker(WIDTH), Memory(), FixedOrder(rows.tolist(), columns.tolist(), n)
    zero, one = memory.take(1).start, memory.take(1).start
    matrix, factors, inverse, right = (memory.take(k) for k in (len(rows), fixed.count, n, n))
    factor = fixed.factor(link, numbers(matrix), factors, inverse, (zero, one))
    b = rng.normal(size=(n, WIDTH))
    given = {
        zero: np.zeros(WIDTH),
        one: np.ones(WIDTH),
        **dict(zip(numbers(matrix), values, strict=True)),
    }
    given |= dict(zip(numbers(right), b, strict=True))
    found = gone_through([*factor, *fixed.solve(link, factors, inverse, right)], memory, given)
    np.testing.assert_allclose(
        found[right], np.linalg.solve(matrices, b.T[..., None])[..., 0].T, rtol=1e-10
    )
    there = gone_through(
        [*factor, *fixed.solve(link, factors, inverse, right, transposed=True)], memory, given
    )
    transposed = np.linalg.solve(matrices.swapaxes(1, 2), b.T[..., None])[..., 0].T
    np.testing.assert_allclose(there[right], transposed, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(
        found[factors][fixed.pivots].prod(axis=0), np.linalg.det(matrices), rtol=1e-10
    )
    np.testing.assert_array_equal(found[matrix], values)
    # that of L is what elimination by hand has
    lower = matrices[0].copy()
    for k in range(n):
        lower[k + 1 :, k] /= lower[k, k]
        lower[k + 1 :, k + 1 :] -= np.outer(lower[k + 1 :, k], lower[k, k + 1 :])
    largest = np.abs(np.tril(lower, -1)).max(initial=0.0)
    assert np.abs(found[factors][fixed.multipliers][:, 0]).max(initial=0.0) == pytest.approx(
        largest, rel=1e-12
    )


def test_a_pivot_that_cannot_be_anything_but_zero_is_refused():
    with pytest.raises(ValueError, match="pivot 1 of 2"):
        FixedOrder([0, 0], [0, 1], 2)


def test_rows_that_words_cannot_name_are_refused():
    memory = Memory()
    assert memory.take(MOST).stop == MOST
    with pytest.raises(MemoryError, match=f"{MOST + 1} rows"):
        memory.take(1)
