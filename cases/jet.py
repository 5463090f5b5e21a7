"""Jets: a number with its first and second derivative by time, for exact velocities and
accelerations of closed forms.

The closed forms of the cases use jets alone; they share no code with any engine.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Lanes: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Jet:
    """Value, first and second derivative by time, each of shape (n,). Operators follow the rules of
    differentiation.
    """

    x: Lanes
    v: Lanes
    a: Lanes

    def __add__(self, b: Jet | float) -> Jet:
        return (
            Jet(self.x + b.x, self.v + b.v, self.a + b.a)
            if isinstance(b, Jet)
            else Jet(self.x + b, self.v, self.a)
        )

    __radd__ = __add__

    def __neg__(self) -> Jet:
        return Jet(-self.x, -self.v, -self.a)

    def __sub__(self, b: Jet | float) -> Jet:
        return self + -b

    def __rsub__(self, b: float) -> Jet:
        return -self + b

    def __mul__(self, b: Jet | float) -> Jet:
        if isinstance(b, float | int):
            return Jet(self.x * b, self.v * b, self.a * b)
        if not isinstance(b, Jet):  # pyright: ignore[reportUnnecessaryIsInstance]
            return NotImplemented  # a vector has its own product
        return Jet(
            self.x * b.x,
            self.v * b.x + self.x * b.v,
            self.a * b.x + 2.0 * self.v * b.v + self.x * b.a,
        )

    __rmul__ = __mul__

    def __truediv__(self, b: Jet | float) -> Jet:
        if not isinstance(b, Jet):
            return self * (1.0 / b)
        x = self.x / b.x  # x b = self, differentiated once and twice
        v = (self.v - x * b.v) / b.x
        return Jet(x, v, (self.a - 2.0 * v * b.v - x * b.a) / b.x)


def sqrt(a: Jet) -> Jet:
    """Return the square root; a must be positive."""
    x = np.sqrt(a.x)  # x x = a, differentiated once and twice
    v = a.v / (2.0 * x)
    return Jet(x, v, (a.a - 2.0 * v * v) / (2.0 * x))


def sin(a: Jet) -> Jet:
    """Return the sine of an angle [rad]."""
    s, c = np.sin(a.x), np.cos(a.x)
    return Jet(s, c * a.v, c * a.a - s * a.v * a.v)


def cos(a: Jet) -> Jet:
    """Return the cosine of an angle [rad]."""
    s, c = np.sin(a.x), np.cos(a.x)
    return Jet(c, -s * a.v, -s * a.a - c * a.v * a.v)


def constant(value: float, like: Jet) -> Jet:
    """Return a constant number as a jet."""
    zero = np.zeros_like(like.x)
    return Jet(zero + value, zero, zero)


def steady(values: Lanes, rate: float) -> Jet:
    """Return a coordinate with these values [rad or m] and a constant rate, shape (n,)."""
    return Jet(values, np.full_like(values, rate), np.zeros_like(values))


Motion: TypeAlias = Mapping[str, Iterable[Jet]]
"""Global x, y, z of each point by name [m]."""
