"""Run programs in ball arithmetic: every number is a midpoint and a radius, and what comes out contains the true result.

Balls are python-flint's `arb`; `arb_series` (polynomials in time with balls as coefficients) run the same way, which gives the
derivatives by time of whatever a program computes. One lane, no layout: balls do not fit into slots of doubles.
"""

from __future__ import annotations

import importlib
import operator
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TypeAlias

from ..errors import KincheckError
from .trace import Program

Ball: TypeAlias = Any
"""A `flint.arb`, or a `flint.arb_series`."""

ORDER = 3
"""Coefficients kept of a series: value, first and half the second derivative."""


class UndecidedError(KincheckError, ArithmeticError):
    """Balls that are to be compared overlap."""


def flint() -> Any:
    """The module of the ball arithmetic.

    Raises:
        KincheckError: it is not installed.
    """
    try:
        return importlib.import_module("flint")
    except ImportError as error:
        raise KincheckError("proofs need python-flint, which is not installed; pip install python-flint") from error


@contextmanager
def precision(bits: int) -> Any:
    """Midpoints of that many bits, and series of `ORDER` coefficients, within the block."""
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


_OPERATIONS: Mapping[str, Callable[..., Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "neg": operator.neg,
    "sqrt": lambda a: a.sqrt(),
    "sin": lambda a: a.sin(),
    "cos": lambda a: a.cos(),
    "abs": abs,
    "min": lambda a, b: a.min(b),
    "max": lambda a, b: a.max(b),
    "larger": _larger,
    "where": lambda m, p, q: p if m else q,
}


def evaluate(program: Program, inputs: Sequence[Ball]) -> dict[int, Ball]:
    """The outputs of a program by slot, from its inputs by slot, at the precision of the block around it.

    A division by a ball that contains zero gives a ball that is not finite, as in the other executors.

    Raises:
        UndecidedError: a comparison ("larger") of balls that overlap.
    """
    arb = flint().arb
    values: list[Any] = []
    for op, *rest in program.nodes:
        if op == "input":
            values.append(inputs[int(rest[0])])
        elif op == "const":
            values.append(arb(rest[0]))
        else:
            values.append(_OPERATIONS[op](*[values[int(k)] for k in rest]))
    return {slot: values[k] for slot, k in program.outputs.items()}
