"""Slopes: a number with its derivatives by many parameters at once, for varied geometry.

A joint chooses its auxiliary axes by comparing components; here the value decides, as it does for
the plain number, so the rows keep the axes they have and their derivatives are exact. Differences
between neighbouring designs would jump with the choice.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from ...algebra import Scalar, Vec3, arc_tangent, power, root, where_larger
from ...trajectory import Array


@dataclass(frozen=True, slots=True, eq=False)
class Slope:
    """x: the value, or lanes; d: its derivatives, shape (parameters, *lanes)."""

    __array_ufunc__: ClassVar[None] = None
    x: Any
    d: Array

    def __add__(self, b: Any) -> Slope:
        return (
            Slope(self.x + b.x, self.d + b.d) if isinstance(b, Slope) else Slope(self.x + b, self.d)
        )

    __radd__ = __add__

    def __neg__(self) -> Slope:
        return Slope(-self.x, -self.d)

    def __sub__(self, b: Any) -> Slope:
        return self + -b

    def __rsub__(self, a: Any) -> Slope:
        return -self + a

    def __mul__(self, b: Any) -> Slope:
        if isinstance(b, Vec3):
            return NotImplemented
        return (
            Slope(self.x * b.x, self.d * b.x + self.x * b.d)
            if isinstance(b, Slope)
            else Slope(self.x * b, self.d * b)
        )

    __rmul__ = __mul__

    def __truediv__(self, b: Any) -> Slope:
        if not isinstance(b, Slope):
            return self * (1.0 / b)
        x = self.x / b.x
        return Slope(x, (self.d - x * b.d) / b.x)

    def __rtruediv__(self, a: float) -> Slope:
        return Slope(a / self.x, (-a / (self.x * self.x)) * self.d)

    __pow__ = power

    def __abs__(self) -> Slope:
        return -self if self.x < 0.0 else self

    def __lt__(self, b: Any) -> bool:
        return self.x < value(b)

    def __gt__(self, b: Any) -> bool:
        return self.x > value(b)

    def sqrt(self) -> Slope:
        """The square root."""
        x = root(self.x)
        return Slope(x, self.d / (2.0 * x))

    @staticmethod
    def arc_tangent(y: Scalar, x: Scalar) -> Slope:
        """Return the angle of the direction (x, y) [rad]."""
        b, a = value(y), value(x)
        turned = (a * derivatives(y) - b * derivatives(x)) / (a * a + b * b)
        return Slope(arc_tangent(b, a), turned)

    @staticmethod
    def where_larger(a: Scalar, b: Scalar, p: Scalar, q: Scalar) -> Slope:
        """Return p if |a| > |b|, else q; the values decide."""
        a, b = value(a), value(b)
        return Slope(*(where_larger(a, b, of(p), of(q)) for of in (value, derivatives)))


def value(a: Any) -> Any:
    """The number without its derivatives."""
    return a.x if isinstance(a, Slope) else a


def derivatives(a: Any) -> Array | float:
    """Return the derivatives of a number; zero for a plain number."""
    return a.d if isinstance(a, Slope) else 0.0
