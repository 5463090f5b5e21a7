"""A truncated Taylor scalar: a value with its first and second derivative by time; floats or arrays
of lanes.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np


def _lift(a):
    return (
        a
        if isinstance(a, Jet)
        else Jet(a, 0.0, 0.0)
        if isinstance(a, float | int | np.ndarray)
        else None
    )


@dataclass(frozen=True)
class Jet:
    """x, x', x''."""

    __array_ufunc__: ClassVar[None] = None
    x: object
    x_t: object
    x_tt: object

    def __add__(self, other):
        b = _lift(other)
        return (
            NotImplemented if b is None else Jet(self.x + b.x, self.x_t + b.x_t, self.x_tt + b.x_tt)
        )

    def __neg__(self):
        return Jet(-self.x, -self.x_t, -self.x_tt)

    def __sub__(self, other):
        b = _lift(other)
        return NotImplemented if b is None else self + (-b)

    def __rsub__(self, other):
        return _lift(other) - self

    def __mul__(self, other):
        b = _lift(other)
        if b is None:
            return NotImplemented
        second = self.x_tt * b.x + 2.0 * (self.x_t * b.x_t) + self.x * b.x_tt
        return Jet(self.x * b.x, self.x_t * b.x + self.x * b.x_t, second)

    __radd__, __rmul__ = __add__, __mul__


def cos_sin(a):
    """Cosine and sine of a jet."""
    c, s = np.cos(a.x), np.sin(a.x)
    return (
        Jet(c, -s * a.x_t, -s * a.x_tt - c * a.x_t * a.x_t),
        Jet(s, c * a.x_t, c * a.x_tt - s * a.x_t * a.x_t),
    )
