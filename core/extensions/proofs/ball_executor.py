"""Execution of programs in ball arithmetic: numbers are a midpoint and a radius; each result
contains the true value.

Balls are python-flint's `arb`. `arb_series` (polynomials in time with ball coefficients) run the
same programs and give time derivatives of all outputs. One lane without slots: balls do not fit
into doubles.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TypeAlias

from ...errors import KincheckError
from ...extras import library
from ...program.straight_line import Program
from ...program.tape import OPERATIONS

Ball: TypeAlias = Any
"""A `flint.arb`, or a `flint.arb_series`."""

ORDER = 3
"""Coefficients of a series: value, first and half the second derivative."""


class UndecidedError(KincheckError, ArithmeticError):
    """Two compared balls overlap."""


def flint() -> Any:
    """Return the module of the ball arithmetic.

    Raises:
        KincheckError: python-flint is not installed.
    """
    return library("a proof", "flint", "proofs")


@contextmanager
def precision(bits: int) -> Any:
    """Set the bits of midpoints, and series of `ORDER` coefficients, within the block."""
    context = flint().ctx
    before = context.prec, context.cap
    context.prec, context.cap = bits, ORDER
    try:
        yield
    finally:
        context.prec, context.cap = before


def _larger(a: Ball, b: Ball) -> bool:
    if abs(a) > abs(b):
        return True
    if abs(a) <= abs(b):
        return False
    raise UndecidedError(f"|{a}| and |{b}| cannot be told apart; raise the precision")


def _minimum(a: Ball, b: Ball) -> Ball:
    return a.min(b)


def _maximum(a: Ball, b: Ball) -> Ball:
    return a.max(b)


def _angle(y: Ball, x: Ball) -> Ball:
    return flint().arb.atan2(y, x)


def _where(m: bool, p: Ball, q: Ball) -> Ball:
    return p if m else q


_OPERATIONS: Mapping[str, Callable[..., Any]] = {
    **OPERATIONS,
    "sin": operator.methodcaller("sin"),
    "cos": operator.methodcaller("cos"),
    "atan2": _angle,
    "min": _minimum,
    "max": _maximum,
    "larger": _larger,
    "where": _where,
}


def evaluate(program: Program, inputs: Sequence[Ball]) -> dict[int, Ball]:
    """Return the outputs of a program by slot, from its inputs by slot, at the current `precision`.

    Division by a ball around zero gives a ball that is not finite, as in the other executors.

    Raises:
        UndecidedError: two balls compared by "larger" overlap.
    """
    return program.run(_OPERATIONS, inputs, flint().arb)
