"""Rows of joint coordinates: weighted sums, and polynomials of one of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ...algebra import Scalar
from ...primitives.base import Drive


@dataclass(frozen=True)
class Relation:
    """A row of coordinates: their weighted sum is the drive's value (zero unless driven).

    Attributes:
        curve: coefficients of a polynomial in the last coordinate, the constant first, that is
            added to the sum; empty for a linear row.
    """

    owner: str
    weights: Mapping[str, Scalar]
    drive: Drive = field(default_factory=Drive)
    curve: Sequence[Scalar] = ()

    def value(self, x: Sequence[Scalar]) -> Scalar:
        """Return the residual at values of the coordinates."""
        linear = sum((k * each for k, each in zip(self.weights.values(), x, strict=True)), 0.0)
        return linear + _polynomial(self.curve, x[-1]) - self.drive.c

    def slopes(self, x: Sequence[Scalar]) -> dict[str, Scalar]:
        """Return the derivatives by the coordinates."""
        found = dict(self.weights)
        if self.curve:
            last = [*found][-1]
            found[last] = found[last] + _polynomial(_derived(self.curve), x[-1])
        return found

    def gamma(self, x: Sequence[Scalar], rates: Sequence[Scalar]) -> Scalar:
        """Return the right-hand side of the accelerations at values and rates."""
        bend = _polynomial(_derived(_derived(self.curve)), x[-1])
        return self.drive.c_tt - bend * (rates[-1] * rates[-1])


def _polynomial(coefficients: Sequence[Scalar], x: Scalar) -> Scalar:
    """Return the value of a polynomial, the constant first."""
    found: Scalar = 0.0
    for c in reversed(coefficients):
        found = c + x * found
    return found


def _derived(coefficients: Sequence[Scalar]) -> Sequence[Scalar]:
    """Return the coefficients of the derivative of a polynomial."""
    return [float(k) * c for k, c in enumerate(coefficients)][1:]
