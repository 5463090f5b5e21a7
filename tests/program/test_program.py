"""Traced programs: folding, sharing, dead code, executing in place."""

import math
import re
from dataclasses import dataclass
from operator import add, mul, neg, sub, truediv
from pathlib import Path

import kincheck.core.program
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from kincheck.core.algebra import root
from kincheck.core.program import Tape, absolute, maximum, minimum, program, where_larger

from ..support.examples import examples
from ..support.program_blocks import numpy_executor, run_on

(FOLDS,) = examples(__file__, "folds")

INPUTS = 4


def run(outputs, block):
    """Run a program that puts out these scalars (slot -> scalar) over a block, in place."""
    tape = next(value.tape for value in outputs.values() if hasattr(value, "tape"))
    run_on([program("p", tape, outputs)], block)
    return block


def traced(function, *columns):
    """The program of function(inputs...) -> sequence of scalars, and what it gives for the inputs'
    lanes.
    """
    tape = Tape()
    values = function(*(tape.input(k) for k in range(len(columns))))
    compiled = program("p", tape, {len(columns) + k: value for k, value in enumerate(values)})
    block = np.vstack(
        [np.array(columns, dtype=float), np.full((len(values), len(columns[0])), np.nan)]
    )
    run_on([compiled], block)
    return compiled, block[len(columns) :]


# Random expressions: what is folded while tracing must not change a bit of the result


CONSTANTS = st.sampled_from([0.0, 1.0, -1.0, 2.0, -2.0, 0.5, -0.25, 3.0])
LEAVES = st.one_of(st.integers(0, INPUTS - 1), CONSTANTS)


@dataclass(frozen=True)
class Operation:
    """An operation on expressions: integers are inputs, floats are constants."""

    name: str
    operands: tuple


def expressions():
    def extend(smaller):
        binary = st.builds(
            lambda op, a, b: Operation(op, (a, b)), st.sampled_from("+-*/<>"), smaller, smaller
        )
        unary = st.builds(
            lambda op, a: Operation(op, (a,)),
            st.sampled_from(["neg", "neg", "sqrt", "abs"]),
            smaller,
        )
        select = st.builds(
            lambda *each: Operation("where", each), smaller, smaller, smaller, smaller
        )
        twice = st.builds(lambda op, a: Operation(op, (a, a)), st.sampled_from("+-*<>"), smaller)
        return binary | unary | select | twice

    return st.recursive(LEAVES, extend, max_leaves=25)


KINDS = {
    "+": (add, add),
    "-": (sub, sub),
    "*": (mul, mul),
    "/": (truediv, truediv),
    "<": (minimum, min),
    ">": (maximum, max),
    "neg": (neg, neg),
    "sqrt": (root, math.sqrt),
    "abs": (absolute, abs),
    "where": (where_larger, lambda a, b, p, q: p if abs(a) > abs(b) else q),
}
"""The function under test, and the same of plain floats."""
TESTED, PLAIN = 0, 1


def evaluate(expression, inputs, of):
    """The expression; in plain floats nothing is folded: ArithmeticError or ValueError where it is
    not defined.
    """
    if isinstance(expression, int):
        return inputs[expression]
    if isinstance(expression, float):
        return expression
    values = (evaluate(each, inputs, of) for each in expression.operands)
    return KINDS[expression.name][of](*values)


numbers = st.floats(-8.0, 8.0).map(lambda x: round(x, 3)) | CONSTANTS


@settings(max_examples=150, deadline=None)
@given(
    st.lists(expressions(), min_size=1, max_size=INPUTS),
    st.lists(st.tuples(*[numbers] * INPUTS), min_size=1, max_size=5),
)
def test_traced_random_expressions_are_exact(wanted, samples):
    """Outputs go where inputs stand, lane by lane; all folds are exact in floating-point
    arithmetic.
    """
    try:
        expected = np.array(
            [[evaluate(each, sample, PLAIN) for sample in samples] for each in wanted]
        )
    except (ZeroDivisionError, ValueError):
        assume(False)
    tape = Tape()
    inputs = [tape.input(k) for k in range(INPUTS)]
    try:
        outputs = {k: evaluate(each, inputs, TESTED) for k, each in enumerate(wanted)}
    except (ZeroDivisionError, ValueError):  # folded first, where the plain one takes the other way
        assume(False)
    block = np.array(samples).T.copy()
    run_on([program("p", tape, outputs)], block)
    np.testing.assert_array_equal(block[: len(wanted)], expected)
    np.testing.assert_array_equal(block[len(wanted) :], np.array(samples).T[len(wanted) :])


# Folding, one rule at a time


@pytest.mark.parametrize("rule", FOLDS)
def test_tape_folding_rules(rule):
    """Both ways of writing it are the same node of the tape, or the same number."""
    tape = Tape()
    names = {"x": tape.input(0), "y": tape.input(1)}
    written, folded = (eval(text, globals(), names) for text in (rule, FOLDS[rule]))
    assert getattr(written, "number", written) == getattr(folded, "number", folded)


def test_tape_functions_of_plain_numbers():
    assert (root(4.0), absolute(-3.0), minimum(1.0, 2.0), maximum(1.0, 2.0)) == (2.0, 3.0, 1.0, 2.0)
    assert where_larger(-2.0, 1.0, 5.0, 6.0) == 5.0


def test_equal_operations_share_node():
    tape = Tape()
    x, y = tape.input(0), tape.input(1)
    first = root(x * y + 2.0)
    count = len(tape.nodes)
    assert root(2.0 + y * x).number == first.number
    assert len(tape.nodes) == count


def test_unused_operations_are_dropped():
    tape = Tape()
    x, y = tape.input(0), tape.input(1)
    _, live = (x * y) * (x + y), x * y
    compiled = program("p", tape, {2: live})
    assert compiled.operations == {"input": 2, "*": 1}
    assert compiled.flops == 1
    assert program("p", tape, {2: 0.0 * (x / y)}).flops == 0


def test_flops_of_program():
    tape = Tape()
    x, y = tape.input(0), tape.input(1)
    z = root(x * x + y * y)
    compiled = program(
        "p", tape, {2: where_larger(x, y, z, -z), 3: maximum(z, absolute(x)) / (z - 1.0)}
    )
    # but the two inputs and the one constant
    assert compiled.flops == sum(compiled.operations.values()) - 2 - 1
    assert compiled.flops == 11


def test_program_docstring_names_modules():
    page = kincheck.core.program.__doc__ or ""
    folder = Path(kincheck.core.program.__file__).parent
    modules = {
        ".".join(file.relative_to(folder).with_suffix("").parts)
        for file in folder.rglob("*.py")
        if file.stem != "__init__"
    }
    named = {name for name in re.findall(r"`([\w.]+)`", page) if name in modules}
    assert sorted(modules - named) == []


def test_whole_powers_and_refused_powers():
    tape = Tape()
    x, block = tape.input(0), np.array([[1.5, -2.0]] + 7 * [[0.0, 0.0]])
    run({n: x**n for n in range(1, 8)}, block)
    assert np.array_equal(block[1:], [[1.5**n, (-2.0) ** n] for n in range(1, 8)])
    for n in (0.5, 0, -1):
        with pytest.raises(TypeError, match=r"only whole powers from 1; write / or root"):
            x**n


# Executing in place


def test_programs_share_block():
    tape = Tape()
    x, y = tape.input(0), tape.input(1)
    block = np.array([[1.0], [2.0]])
    executor = numpy_executor(
        [program("sum", tape, {0: x + y}), program("product", tape, {1: x * y})], block
    )
    for name in ("sum", "product", "sum"):
        executor.run(name)
    assert executor.get([0, 1])[:, 0].tolist() == [9.0, 6.0]


def test_where_larger_by_lane():
    a, b = [1.0, -3.0, 2.0, np.nan], [2.0, 1.0, -2.0, 1.0]
    p, q = [10.0, 20.0, 30.0, 40.0], [-10.0, -20.0, -30.0, -40.0]
    _, found = traced(
        lambda a, b, p, q: [where_larger(a, b, p, q), where_larger(a, b, p, 0.0)], a, b, p, q
    )
    assert found.tolist() == [[-10.0, 20.0, -30.0, -40.0], [0.0, 20.0, 0.0, 0.0]]


NAN = float("nan")


@pytest.mark.parametrize("extreme", [minimum, maximum])
@pytest.mark.parametrize(("a", "b"), [(NAN, 1.0), (1.0, NAN)])
def test_extremes_propagate_nan(extreme, a, b):
    """Of two lanes, of a lane and a number, of two numbers: a NaN residual must never look
    converged.
    """
    _, found = traced(lambda x, y: [extreme(x, y), extreme(x, b), extreme(a, y)], [a], [b])
    assert np.isnan(found).all()
    assert math.isnan(extreme(a, b))


def test_division_by_zero_gives_infinity():
    _, found = traced(lambda x, y: [x / y, x / 0.0, root(-x)], [1.0, -1.0], [0.0, 0.0])
    assert found[0].tolist() == [np.inf, -np.inf]
    assert found[1].tolist() == [np.inf, -np.inf]
    assert np.isnan(found[2, 0])
