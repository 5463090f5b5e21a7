"""Derivatives of an equation along with its values, over scalars of any kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, TypeAlias

from ..algebra import Scalar, Vec3, power
from .tape import OPERATIONS, no_derivative, weights

Changes: TypeAlias = Mapping[Any, Scalar]
"""Derivatives by some inputs, each by its key; zero derivatives may be left out."""


class Moving:
    """A number with its derivatives by some inputs. If the inputs move too, so do the derivatives:
    second derivatives are derivatives of these.

    A derivative sums all uses of an input. Its product with the change of the input by the unknowns
    comes last, once, as in equations written by hand.
    """

    __slots__ = ("by", "value")
    __array_ufunc__: ClassVar[None] = None  # an array of lanes times a number is a number of arrays

    def __init__(self, value: Scalar, by: Changes) -> None:
        self.value, self.by = value, by

    @staticmethod
    def of(op: str, *operands: Scalar) -> Moving:
        """Return the result of an operation of `Tape`."""
        values = [x.value if isinstance(x, Moving) else x for x in operands]
        value, by = OPERATIONS[op](*values), dict[Any, Scalar]()
        for x, weight in zip(operands, weights(False, op, value, *values), strict=True):
            for key, slope in x.by.items() if isinstance(x, Moving) else ():
                by[key] = by[key] + weight * slope if key in by else weight * slope
        return Moving(value, by)

    def __add__(self, b: Scalar) -> Moving:
        return self.of("+", self, b)

    def __radd__(self, a: Scalar) -> Moving:
        return self.of("+", a, self)

    def __sub__(self, b: Scalar) -> Moving:
        return self.of("-", self, b)

    def __rsub__(self, a: Scalar) -> Moving:
        return self.of("-", a, self)

    def __mul__(self, b: Scalar) -> Moving:
        # Vec3.__rmul__ computes the product with a vector
        return NotImplemented if isinstance(b, Vec3) else self.of("*", self, b)

    def __rmul__(self, a: Scalar) -> Moving:
        return self.of("*", a, self)

    def __truediv__(self, b: Scalar) -> Moving:
        return self.of("/", self, b)

    def __rtruediv__(self, a: Scalar) -> Moving:
        return self.of("/", a, self)

    def __neg__(self) -> Moving:
        return self.of("neg", self)

    def __abs__(self) -> Moving:
        return self.of("abs", self)

    __pow__ = power

    def sqrt(self) -> Moving:
        """Return the square root."""
        return self.of("sqrt", self)

    @staticmethod
    def arc_tangent(y: Scalar, x: Scalar) -> Moving:
        """Return the angle of the direction (x, y) [rad], in -pi..pi."""
        return Moving.of("atan2", y, x)

    @staticmethod
    def where_larger(a: Scalar, b: Scalar, p: Scalar, q: Scalar) -> Moving:
        """Refuse a choice: its derivative jumps."""
        raise no_derivative("where")


def changes_of(value: Scalar) -> Changes:
    """Return the derivatives of a number of any kind."""
    return value.by if isinstance(value, Moving) else {}
