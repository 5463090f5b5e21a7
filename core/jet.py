"""Jets: a number with its first and second time derivative, so any formula gives exact rates of its
result.

The numbers are scalars of any kind: lanes, balls, traced scalars. Vectors of jets are
`algebra.Vec3`. An unknown derivative is NaN, and propagates.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from .algebra import Scalar, Vec3, arc_tangent, is_array, root, where_larger

VANISHING = 2.0**-20
"""A length below this part of the numbers it is made of has lost six digits of its direction, and
so of its rates: they keep the nine to ten that tolerances ask for.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Jet:
    """Value, first and second derivative by time; lanes are of shape (n,) or (). Operators follow
    the rules of differentiation.
    """

    __array_ufunc__: ClassVar[None] = None  # an array plus a jet is a jet, not an array of jets
    x: Scalar
    v: Scalar
    a: Scalar

    @property
    def dot(self) -> Jet:
        """The time derivative as a jet; its second derivative is unknown (NaN)."""
        unknown = np.full_like(self.a, np.nan) if is_array(self.a) else math.nan
        return Jet(self.v, self.a, unknown)

    def __add__(self, b: Jet | Scalar) -> Jet:
        return (
            Jet(self.x + b.x, self.v + b.v, self.a + b.a)
            if isinstance(b, Jet)
            else Jet(self.x + b, self.v, self.a)
        )

    __radd__ = __add__

    def __neg__(self) -> Jet:
        return Jet(-self.x, -self.v, -self.a)

    def __sub__(self, b: Jet | Scalar) -> Jet:
        return self + -b

    def __rsub__(self, b: Scalar) -> Jet:
        return -self + b

    def __mul__(self, b: Any) -> Jet:
        if isinstance(b, Jet):
            return Jet(
                self.x * b.x,
                self.v * b.x + self.x * b.v,
                self.a * b.x + 2.0 * self.v * b.v + self.x * b.a,
            )
        if isinstance(b, Vec3):
            return NotImplemented
        return Jet(self.x * b, self.v * b, self.a * b)

    __rmul__ = __mul__

    def __truediv__(self, b: Jet | float) -> Jet:
        if not isinstance(b, Jet):
            return self * (1.0 / b)
        x = self.x / b.x  # x b = self, differentiated once and twice
        v = (self.v - x * b.v) / b.x
        return Jet(x, v, (self.a - 2.0 * v * b.v - x * b.a) / b.x)


def sqrt(a: Jet) -> Jet:
    """Return the square root; a must be positive."""
    x = root(a.x)  # x x = a, differentiated once and twice
    v = a.v / (2.0 * x)
    return Jet(x, v, (a.a - 2.0 * v * v) / (2.0 * x))


def arctan2(y: Jet, x: Jet) -> Jet:
    """Return the angle of the direction (x, y) [rad], in -pi..pi; x and y must not both vanish.

    Its rate is (x y' - y x') / (x x + y y): a jet of jets' values and rates, differentiated once
    more by the quotient rule.
    """
    rate = (x * y.dot - y * x.dot) / (x * x + y * y)
    return Jet(arc_tangent(y.x, x.x), rate.x, rate.v)


def choose(a: Scalar, b: Scalar, p: Jet, q: Jet) -> Jet:
    """Return the jet p if |a| > |b|, else q."""
    pairs = ((p.x, q.x), (p.v, q.v), (p.a, q.a))
    return Jet(*(where_larger(a, b, *pair) for pair in pairs))


UNKNOWN = Jet(math.nan, math.nan, math.nan)


def known(a: Scalar, b: Scalar, value: Jet) -> Jet:
    """Return the jet if |a| > |b|; otherwise it is unknown."""
    return choose(a, b, value, UNKNOWN)


def sign(a: Scalar) -> Scalar:
    """Return 1 or -1, with the sign of a number that is not zero."""
    return abs(a) / a


def norm(a: Vec3, size: Scalar) -> Jet:
    """Return the length of a vector of jets. Its rates are NaN where it almost vanishes.

    Args:
        size: of the numbers that the vector is a sum of.
    """
    length = sqrt(a @ a)
    rates = known(length.x, VANISHING * size, length)
    return Jet(length.x, rates.v, rates.a)


def each(a: Vec3, do: Callable[[Jet], Jet]) -> Vec3:
    """Return a vector of jets, changed component by component."""
    return Vec3(do(a.x), do(a.y), do(a.z))
