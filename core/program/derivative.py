"""Derivatives of traced scalars, traced themselves: the chain rule over the operations of a tape.

Zeros and ones fold as in all traces, so the program of a Jacobian holds only the operations of its
entries. Constants of the tape stay operands: folding would round them to doubles, and balls have to
prove bounds of the result.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TypeAlias

from ..algebra import Scalar
from .tape import Tape, Traced, cos, operands, sin

Gradient: TypeAlias = dict[int, Scalar]
"""Derivatives by position of the input; zero derivatives are left out."""


def _weights(op: str, y: Traced, a: Scalar, b: Scalar = 0.0) -> tuple[Scalar, ...]:
    """Return the derivatives of an operation by its operands a and b; y is its value."""
    match op:
        case "+":
            return 1.0, 1.0
        case "-":
            return 1.0, -1.0
        case "*":
            return b, a
        case "/":
            return 1.0 / b, -(y / b)
        case "neg":
            return (-1.0,)
        case "sqrt":
            return (0.5 / y,)
        case "sin":
            return (cos(a),)
        case "cos":
            return (-sin(a),)
        case _:
            raise TypeError(
                f"operation {op!r} has a kink and no derivative; leave it out of equations to be"
                " differentiated"
            )


def jacobian(tape: Tape, values: Sequence[Scalar], inputs: Sequence[Traced]) -> list[Gradient]:
    """Return the derivatives of each value by the inputs, without zeros.

    Raises:
        TypeError: a value depends on an input through an operation with a kink ("abs", "min",
            "max", "larger", "where").
    """
    gradients: dict[int, Gradient] = {each.number: {k: 1.0} for k, each in enumerate(inputs)}
    # the tape grows as the derivatives are traced
    for number, node in enumerate(tuple(tape.nodes)):
        read = operands(node)
        if any(gradients.get(k) for k in read):
            weights = _weights(node[0], tape.scalars[number], *(tape.scalars[k] for k in read))
            gradients[number] = _sum(
                zip(weights, (gradients.get(k, {}) for k in read), strict=True)
            )
    return [
        gradients.get(value.number, {}) if isinstance(value, Traced) else {} for value in values
    ]


def _sum(terms: Iterable[tuple[Scalar, Gradient]]) -> Gradient:
    """Return the weighted sum of gradients, without terms that cancel."""
    total: Gradient = {}
    for weight, gradient in terms:
        for k, value in gradient.items():
            total[k] = total.get(k, 0.0) + weight * value
    return {k: value for k, value in total.items() if isinstance(value, Traced) or value != 0.0}
