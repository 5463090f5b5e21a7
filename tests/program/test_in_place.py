"""Programs run in place over a block of slots; what is not a number is handed on."""

import math

import numpy as np
import pytest
from kincheck.core.algebra import root
from kincheck.core.program import (
    Tape,
    maximum,
    minimum,
    program,
    where_larger,
)

from ..support.running import numpy_executor
from .test_program import run, traced

# Executing in place


def test_outputs_may_overwrite_inputs():
    """All inputs are read before any output is written."""
    tape = Tape()
    x, y, z = (tape.input(k) for k in range(3))
    block = np.array([[1.0, 10.0], [2.0, 20.0], [3.0, 30.0]])
    run({0: y, 1: x, 2: x + y * z}, block)
    assert block.tolist() == [[2.0, 20.0], [1.0, 10.0], [7.0, 610.0]]


def test_one_scalar_may_go_to_many_slots():
    tape = Tape()
    x, y = tape.input(0), tape.input(1)
    block = run({0: x + y, 1: x + y, 2: x, 3: 5.0}, np.array([[1.0], [2.0], [0.0], [0.0]]))
    assert block[:, 0].tolist() == [3.0, 3.0, 1.0, 5.0]


def test_programs_share_a_block():
    tape = Tape()
    x, y = tape.input(0), tape.input(1)
    block = np.array([[1.0], [2.0]])
    executor = numpy_executor(
        [program("sum", tape, {0: x + y}), program("product", tape, {1: x * y})], block
    )
    for name in ("sum", "product", "sum"):
        executor.run(name)
    assert executor.get([0, 1])[:, 0].tolist() == [9.0, 6.0]


def test_lanes_choose_for_themselves():
    a, b = [1.0, -3.0, 2.0, np.nan], [2.0, 1.0, -2.0, 1.0]
    p, q = [10.0, 20.0, 30.0, 40.0], [-10.0, -20.0, -30.0, -40.0]
    _, found = traced(
        lambda a, b, p, q: [where_larger(a, b, p, q), where_larger(a, b, p, 0.0)], a, b, p, q
    )
    assert found.tolist() == [[-10.0, 20.0, -30.0, -40.0], [0.0, 20.0, 0.0, 0.0]]


NAN = float("nan")


@pytest.mark.parametrize("extreme", [minimum, maximum])
@pytest.mark.parametrize(("a", "b"), [(NAN, 1.0), (1.0, NAN)])
def test_nan_is_not_lost(extreme, a, b):
    """Of two lanes, of a lane and a number, of two numbers: a NaN residual must never look
    converged.
    """
    _, found = traced(lambda x, y: [extreme(x, y), extreme(x, b), extreme(a, y)], [a], [b])
    assert np.isnan(found).all()
    assert math.isnan(extreme(a, b))


def test_division_by_zero_is_a_value():
    _, found = traced(lambda x, y: [x / y, x / 0.0, root(-x)], [1.0, -1.0], [0.0, 0.0])
    assert found[0].tolist() == [np.inf, -np.inf]
    assert found[1].tolist() == [np.inf, -np.inf]
    assert np.isnan(found[2, 0])
