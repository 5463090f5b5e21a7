"""Programs run over any kind of scalar: lanes of real or complex numbers, jets, numbers
of any precision.

A kind is a table of the operations of a program for its scalars.
"""

from __future__ import annotations

import importlib
import operator
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from ...program import Program
from ...trajectory import Array

Operation: TypeAlias = Callable[..., Any]


def _ordered(key: Operation) -> dict[str, Operation]:
    """Return the operations that compare, by a key of the scalars."""
    where: Operation = np.where

    def absolute(a: Any) -> Any:
        return where(key(a) < 0.0, -a, a)

    def smaller(a: Any, b: Any) -> Any:
        return where(key(a) <= key(b), a, b)

    def greater(a: Any, b: Any) -> Any:
        return where(key(a) >= key(b), a, b)

    def larger(a: Any, b: Any) -> Any:
        return abs(key(a)) > abs(key(b))

    return {"abs": absolute, "min": smaller, "max": greater, "larger": larger, "where": where}


_SUMS: dict[str, Any] = {"+": operator.add, "-": operator.sub, "neg": operator.neg}
_PRODUCTS: dict[str, Any] = {
    "*": operator.mul,
    "/": np.true_divide,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
}

NUMBERS: Mapping[str, Operation] = {**_SUMS, **_PRODUCTS, **_ordered(np.real)}
"""Operations of arrays of numbers. Complex numbers are ordered by their real parts, so the
imaginary parts stay derivatives.
"""


def _product(a: Array, b: Array) -> Array:
    return np.stack(
        [a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]]
    )


def _quotient(a: Array, b: Array) -> Array:
    x = a[0] / b[0]  # x b = a, differentiated once and twice
    v = (a[1] - x * b[1]) / b[0]
    return np.stack([x, v, (a[2] - 2.0 * v * b[1] - x * b[2]) / b[0]])


def _chain(f: Callable[[Array], tuple[Array, Array, Array]]) -> Operation:
    """Return a function of a jet, from its value and first two derivatives."""

    def of(a: Array) -> Array:
        y, slope, bend = f(a[0])
        return np.stack([y, slope * a[1], slope * a[2] + bend * a[1] * a[1]])

    return of


JETS: Mapping[str, Operation] = {
    **_SUMS,
    "*": _product,
    "/": _quotient,
    "sqrt": _chain(lambda x: (np.sqrt(x), 0.5 / np.sqrt(x), -0.25 / (x * np.sqrt(x)))),
    "sin": _chain(lambda x: (np.sin(x), np.cos(x), -np.sin(x))),
    "cos": _chain(lambda x: (np.cos(x), -np.sin(x), -np.cos(x))),
    **_ordered(operator.itemgetter(0)),
}
"""Operations of arrays (3, ...): value, first and second derivative by time."""


def precise(digits: int) -> tuple[Mapping[str, Operation], Operation]:
    """Return the operations of numbers with the given digits, in arrays of objects, and the
    function that converts floats to them.

    Raises:
        ModuleNotFoundError: mpmath is not installed.
    """
    mpmath: Any = importlib.import_module("mpmath")
    context = mpmath.MPContext()
    context.dps = digits
    array_of: Any = np.frompyfunc
    functions: dict[str, Operation] = {
        name: array_of(getattr(context, name), 1, 1) for name in ("sqrt", "sin", "cos")
    }
    return {**NUMBERS, **functions}, array_of(context.mpf, 1, 1)


def execute(
    program: Program,
    kind: Mapping[str, Operation],
    inputs: Any,
    lift: Callable[[float], Any] = float,
) -> list[Any]:
    """Run a program over a kind of scalar and return its outputs in order.

    Args:
        inputs: values by slot.
        lift: conversion of constants to the kind.
    """
    values: list[Any] = []
    for op, *rest in program.nodes:
        if op == "input":
            values.append(inputs[int(rest[0])])
        elif op == "const":
            values.append(lift(rest[0]))
        elif len(rest) == 2:  # most operations; a call with any number takes twice as long
            values.append(kind[op](values[int(rest[0])], values[int(rest[1])]))
        else:
            values.append(kind[op](*(values[int(k)] for k in rest)))
    return [values[program.outputs[slot]] for slot in sorted(program.outputs)]
