"""Derivatives of traced scalars, traced themselves: the chain rule over the operations of a tape.

Zeros and ones fold as in all traces, so the program of a Jacobian holds only the operations of its
entries. Constants of the tape stay operands: folding would round them to doubles, and balls have to
prove bounds of the result.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeAlias

from ..algebra import Scalar, root
from .tape import Tape, Traced, absolute, cos, maximum, minimum, operands, sin, where_larger

Gradient: TypeAlias = dict[int, Scalar]
"""Derivatives by position of the input; zero derivatives are left out."""


def _weights(smooth: bool, op: str, y: Traced, a: Scalar, b: Scalar = 0.0) -> tuple[Scalar, ...]:
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
        case "min" | "max" if smooth:
            sign = 1.0 if op == "max" else -1.0
            first = where_larger(a - b + 1.0, a - b - 1.0, 0.5 + 0.5 * sign, 0.5 - 0.5 * sign)
            return first, 1.0 - first
        case _:
            raise TypeError(
                f"operation {op!r} has a kink and no derivative; leave it out of equations to be"
                " differentiated"
            )


def jacobian(
    tape: Tape, values: Sequence[Scalar], inputs: Sequence[Traced], *, smooth: bool = False
) -> list[Gradient]:
    """Return the derivatives of each value by the inputs, without zeros.

    Args:
        smooth: "min" and "max" are parts of smooth functions, such as the pieces of a curve; at the
            kink itself, where they need a derivative of one side, it is that of the second operand.

    Raises:
        TypeError: a value depends on an input through an operation with a kink ("abs", "min",
            "max", "larger", "where").
    """
    gradients: dict[int, Gradient] = {each.number: {k: 1.0} for k, each in enumerate(inputs)}
    # the tape grows as the derivatives are traced
    for number, node in enumerate(tuple(tape.nodes)):
        read = operands(node)
        if any(gradients.get(k) for k in read):
            weights = _weights(
                smooth, node[0], tape.scalars[number], *(tape.scalars[k] for k in read)
            )
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


def folded(tape: Tape, values: Sequence[Scalar], known: Mapping[int, float]) -> list[Scalar]:
    """Return scalars with numbers in place of some inputs, by slot: all operations fold again."""
    new: dict[int, Scalar] = {}
    waiting = [each.number for each in values if isinstance(each, Traced)]
    live = set[int]()
    while waiting:
        if (number := waiting.pop()) not in live:
            live.add(number)
            waiting += operands(tape.nodes[number])
    for number in sorted(live):
        op, *rest = tape.nodes[number]
        if op == "input":
            new[number] = known.get(int(rest[0]), tape.scalars[number])
        elif op == "const":
            new[number] = float(rest[0])
        elif op == "where":
            _, *sizes = tape.nodes[int(rest[0])]
            new[number] = where_larger(*(new[int(k)] for k in (*sizes, *rest[1:])))
        elif op != "larger":  # which "where" reads itself
            new[number] = _AGAIN[str(op)](*(new[int(k)] for k in rest))
    return [new[each.number] if isinstance(each, Traced) else each for each in values]


def _over(a: Scalar, b: Scalar) -> Scalar:
    return a / b


_AGAIN: Mapping[str, Any] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": _over,
    "neg": operator.neg,
    "sqrt": root,
    "sin": sin,
    "cos": cos,
    "abs": absolute,
    "min": minimum,
    "max": maximum,
}
