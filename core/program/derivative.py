"""Derivatives of traced scalars, traced themselves: the chain rule over the operations of a tape.

Zeros and ones fold as everywhere, so the program of a Jacobian holds what its entries need and nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

from ..algebra import Scalar
from .trace import Tape, Traced, cos, operands, sin

Gradient: TypeAlias = dict[int, Scalar]
"""Derivatives by the inputs that matter, by place of the input."""

_RULES: Mapping[str, Callable[..., tuple[Scalar, ...]]] = {
    "+": lambda y, a, b: (1.0, 1.0),
    "-": lambda y, a, b: (1.0, -1.0),
    "*": lambda y, a, b: (b, a),
    "/": lambda y, a, b: (1.0 / b, -(y / b)),
    "neg": lambda y, a: (-1.0,),
    "sqrt": lambda y, a: (0.5 / y,),
    "sin": lambda y, a: (cos(a),),
    "cos": lambda y, a: (-sin(a),),
}
"""Derivatives of an operation by its operands, from its value y and the operands."""


def jacobian(tape: Tape, values: Sequence[Scalar], inputs: Sequence[Traced]) -> list[Gradient]:
    """The derivative of each value by each input; zeros are left out.

    Raises:
        TypeError: a value depends on an input through an operation with a kink ("abs", "min", "max", "larger", "where").
    """
    gradients: dict[int, Gradient] = {each.number: {k: 1.0} for k, each in enumerate(inputs)}
    for number, node in enumerate(tuple(tape.nodes)):  # the tape grows as the derivatives are traced
        read = [k for k in operands(node) if gradients.get(k)]
        if not read:
            continue
        if node[0] not in _RULES:
            raise TypeError(f"operation {node[0]!r} has a kink and no derivative; leave it out of equations to be differentiated")
        weights = _RULES[node[0]](Traced(tape, number), *(Traced(tape, k) for k in operands(node)))
        gradients[number] = _sum(zip(weights, (gradients.get(k, {}) for k in operands(node)), strict=True))
    return [gradients.get(value.number, {}) if isinstance(value, Traced) else {} for value in values]


def _sum(terms: Any) -> Gradient:
    """The weighted sum of gradients, without what cancels."""
    total: Gradient = {}
    for weight, gradient in terms:
        for k, value in gradient.items():
            total[k] = total.get(k, 0.0) + weight * value
    return {k: value for k, value in total.items() if isinstance(value, Traced) or value != 0.0}
