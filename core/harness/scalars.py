"""Programs run over any kind of scalar: lanes of real or complex numbers, jets, numbers of any precision.

A kind is a table of what the operations of a program are for it.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..program import Program
from ..trajectory import Array

# Complex numbers are ordered by their real parts, so that their imaginary parts stay derivatives.
NUMBERS: Mapping[str, Callable[..., Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "neg": operator.neg,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "abs": lambda a: np.where(np.real(a) < 0.0, -a, a),
    "min": lambda a, b: np.where(np.real(a) <= np.real(b), a, b),
    "max": lambda a, b: np.where(np.real(a) >= np.real(b), a, b),
    "larger": lambda a, b: abs(np.real(a)) > abs(np.real(b)),
    "where": lambda m, p, q: np.where(m, p, q),
}


def _product(a: Array, b: Array) -> Array:
    return np.stack([a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]])


def _quotient(a: Array, b: Array) -> Array:
    x = a[0] / b[0]  # x b = a, differentiated once and twice
    v = (a[1] - x * b[1]) / b[0]
    return np.stack([x, v, (a[2] - 2.0 * v * b[1] - x * b[2]) / b[0]])


def _chain(f: Callable[[Array], tuple[Array, Array, Array]]) -> Callable[[Array], Array]:
    def of(a: Array) -> Array:
        y, slope, bend = f(a[0])
        return np.stack([y, slope * a[1], slope * a[2] + bend * a[1] * a[1]])

    return of


JETS: Mapping[str, Callable[..., Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": _product,
    "/": _quotient,
    "neg": operator.neg,
    "sqrt": _chain(lambda x: (np.sqrt(x), 0.5 / np.sqrt(x), -0.25 / (x * np.sqrt(x)))),
    "sin": _chain(lambda x: (np.sin(x), np.cos(x), -np.sin(x))),
    "cos": _chain(lambda x: (np.cos(x), -np.sin(x), -np.cos(x))),
    "abs": lambda a: np.where(a[0] < 0.0, -a, a),
    "min": lambda a, b: np.where(a[0] <= b[0], a, b),
    "max": lambda a, b: np.where(a[0] >= b[0], a, b),
    "larger": lambda a, b: abs(a[0]) > abs(b[0]),
    "where": lambda m, p, q: np.where(m, p, q),
}


def execute(
    traced: Program, kind: Mapping[str, Callable[..., Any]], inputs: Any, lift: Callable[[float], Any] = float
) -> list[Any]:
    """Run a program over a kind of scalar: inputs by slot; the outputs in order. Constants are lifted to the kind."""
    values: list[Any] = []
    for op, *rest in traced.nodes:
        if op in ("input", "const"):
            values.append(inputs[int(rest[0])] if op == "input" else lift(rest[0]))
        else:
            values.append(kind[op](*(values[int(k)] for k in rest)))
    return [values[traced.outputs[slot]] for slot in sorted(traced.outputs)]


def precise(digits: int) -> tuple[Mapping[str, Callable[..., Any]], Callable[[Any], Any]]:
    """Numbers of that many digits in arrays of objects, and what makes them of floats; needs mpmath.

    Raises:
        ModuleNotFoundError: mpmath is not installed.
    """
    import mpmath

    context: Any = mpmath.MPContext()
    context.dps = digits
    functions = {name: np.frompyfunc(getattr(context, name), 1, 1) for name in ("sqrt", "sin", "cos")}
    return {**NUMBERS, **functions}, np.frompyfunc(context.mpf, 1, 1)
