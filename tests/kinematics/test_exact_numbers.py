"""Derivatives of tapes, balls and exact numbers, of which enclosures are made."""

import math
from dataclasses import fields, is_dataclass
from fractions import Fraction

import pytest
from kincheck.core.algebra import root
from kincheck.core.case.joint_probe import probes
from kincheck.core.kinematics.formulation.constraints import constraints, frames
from kincheck.core.kinematics.verified.exact import (
    Exact,
    as_decimal,
    as_double,
    exact_mechanism,
)
from kincheck.core.program import Tape, absolute, cos, program, sin, where_larger
from kincheck.core.program.ball_executor import UndecidedError, evaluate, precision
from kincheck.core.program.tape import jacobian

from .test_enclosure import BITS, flint

# Derivatives and balls


def test_tape_jacobian_equals_series_slopes():
    tape = Tape()
    inputs = [tape.input(slot) for slot in range(3)]
    x, y, z = inputs
    values = [x * y - z / (x + 2.0), root(x * x + y * y), sin(x * z) * cos(-y), 3.0 * z, 1.0]
    gradients = jacobian(tape, values, inputs)
    assert gradients[3].keys() == {2}
    assert gradients[4] == {}
    code = program("values", tape, dict(enumerate(values)))
    slopes = program(
        "slopes",
        tape,
        {3 * row + k: value for row, each in enumerate(gradients) for k, value in each.items()},
    )
    with precision(BITS):
        at = [flint.arb(x) for x in ("0.7", "-0.3", "1.9")]
        found = evaluate(slopes, at)
        for k in range(3):
            moving = [flint.arb_series([x, int(k == j)], prec=3) for j, x in enumerate(at)]
            for row, value in evaluate(code, moving).items():
                expected = value[1] if isinstance(value, flint.arb_series) else flint.arb(0)
                assert abs(found.get(3 * row + k, flint.arb(0)) - expected) < 1e-50


def test_tape_jacobian_of_kink_is_refused():
    tape = Tape()
    x = tape.input(0)
    with pytest.raises(TypeError, match="'abs' has a kink"):
        jacobian(tape, [absolute(x)], [x])


def test_comparison_of_overlapping_balls_is_undecided():
    tape = Tape()
    x, y = tape.input(0), tape.input(1)
    larger = program("larger", tape, {0: where_larger(x, y, 1.0, 2.0)})
    assert evaluate(larger, [flint.arb(-3), flint.arb(2)])[0] == 1
    assert evaluate(larger, [flint.arb(2), flint.arb(-3)])[0] == 2
    with pytest.raises(UndecidedError, match="cannot be told apart"):
        evaluate(larger, [flint.arb(2, 0.1), flint.arb(-2)])


def test_precision_context_is_restored():
    before = flint.ctx.prec
    with precision(BITS):
        assert before != flint.ctx.prec == BITS
    assert flint.ctx.prec == before


# Exact numbers


def test_exact_number_arithmetic():
    third = Exact.of(Fraction(1, 3))
    assert (third + 0.5 - Exact.of(Fraction(5, 6))).trivial == 0.0
    assert (Exact.of(Fraction(9, 16)).sqrt() - 0.75).trivial == 0.0
    with precision(BITS):
        root = Exact.of(Fraction(2)).sqrt()
        assert root.trivial is None
        assert abs(root.ball**2 - 2) < 1e-58
        assert abs((root * root - 2.0).ball) < 1e-58
    assert as_double(0.1) != Fraction(1, 10) == as_decimal(0.1)


@pytest.mark.parametrize(
    "case", [case for case in probes() if case.name != "spline"], ids=lambda case: case.name
)
def test_exact_joints_call_no_doubles(case, monkeypatch):
    """Nothing that reaches the primitives went through a function of doubles; checks and the choice
    of a length unit may.
    """

    def exactly(do):
        def call(*arguments):
            assert not any(isinstance(each, Exact) for each in arguments), (
                f"{do} rounds {arguments} to a double"
            )
            return do(*arguments)

        return call

    with precision(BITS):
        exact = exact_mechanism(case.mechanism, as_double)
        frame = frames(exact)
        for name in {name for name in dir(math) if callable(getattr(math, name))} - {
            "isfinite",
            "dist",
        }:
            monkeypatch.setattr(math, name, exactly(getattr(math, name)))
        for constraint in constraints(exact, frame, {}):
            assert {*_floats(constraint)} <= {0.0, 1.0, -1.0}, constraint


def _floats(value):
    if isinstance(value, float):
        yield value
    elif isinstance(value, dict):
        yield from (x for each in value.values() for x in _floats(each))
    elif is_dataclass(value):
        yield from (x for each in fields(value) for x in _floats(getattr(value, each.name)))
