"""A mechanism with exact numbers.

Coordinates, axes and lengths are fractions: their doubles, or the decimals that print them.
Quantities that joints derive from them (differences, directions, lengths) stay fractions up to the
first root and are balls from there on, so no rounding is ignored. A joint type that calls `math`
itself rounds to a double; the joint types of kincheck do not. Pi of a screw's lead is its double.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace
from fractions import Fraction
from typing import Any

from ...algebra import Vec3
from ...errors import SolveError
from ...mechanism.loads import Law
from ...mechanism.mechanism import Mechanism
from ...program.ball_executor import Ball, flint
from .exact_forces import converted

Reading = Callable[[float], Fraction]
"""Interpretation of a float of a description as a fraction."""


def as_double(x: float) -> Fraction:
    """Return the double itself, the number given to every engine."""
    return Fraction(x)


def as_decimal(x: float) -> Fraction:
    """Return the shortest decimal that denotes the double.

    It is the number of a case file with 15 digits or fewer in SI units.
    """
    return Fraction(repr(float(x)))


class Exact:
    """A fraction, or a ball after the first root."""

    __slots__ = ("value",)

    def __init__(self, value: Any) -> None:
        self.value = value

    @staticmethod
    def of(x: Fraction) -> Exact:
        """Return the number of a fraction."""
        return Exact(flint().fmpq(x.numerator, x.denominator))

    @property
    def ball(self) -> Ball:
        """The number at the precision of the enclosing block."""
        return flint().arb(self.value)

    @property
    def trivial(self) -> float | None:
        """The number as a float if it is 0, 1 or -1, else None.

        Products with these numbers, and their sums, are exact in double precision.
        """
        return next(
            (x for x in (0.0, 1.0, -1.0) if not self._is_ball and self.value == int(x)), None
        )

    @property
    def _is_ball(self) -> bool:
        return isinstance(self.value, flint().arb)

    def __add__(self, b: Any) -> Exact:
        return Exact(self.value + _value(b))

    def __sub__(self, b: Any) -> Exact:
        return Exact(self.value - _value(b))

    def __mul__(self, b: Any) -> Any:
        return NotImplemented if isinstance(b, Vec3) else Exact(self.value * _value(b))

    def __truediv__(self, b: Any) -> Exact:
        return Exact(self.value / _value(b))

    def __rsub__(self, a: Any) -> Exact:
        return Exact(_value(a) - self.value)

    def __rtruediv__(self, a: Any) -> Exact:
        return Exact(_value(a) / self.value)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Exact:
        return Exact(-self.value)

    def __abs__(self) -> Exact:
        return Exact(abs(self.value))

    # choices of a description (the axis nearest to perpendicular) may fall either way if balls
    # overlap
    def __lt__(self, b: Any) -> bool:
        return bool((self - b).ball < 0)

    def __gt__(self, b: Any) -> bool:
        return bool((self - b).ball > 0)

    def __le__(self, b: Any) -> bool:
        return bool((self - b).ball <= 0)

    def __ge__(self, b: Any) -> bool:
        return bool((self - b).ball >= 0)

    def __bool__(self) -> bool:
        return bool(self.value != 0)

    def __float__(self) -> float:
        return float(self.value)

    def sqrt(self) -> Exact:
        """Return the square root, a fraction if possible; of a ball, that of its part >= 0."""
        if not self._is_ball and self.value.p.is_square() and self.value.q.is_square():
            return Exact(self.value.sqrt())
        return Exact(self.ball.nonnegative_part().sqrt())

    def arctan2(self, x: Any) -> Exact:
        """Return the angle of the direction (x, self) [rad]; numpy calls this name."""
        return Exact(flint().arb.atan2(self.ball, flint().arb(_value(x))))


def _value(b: Any) -> Any:
    if isinstance(b, Exact):
        return b.value
    if isinstance(b, float) and math.isfinite(b):
        return flint().fmpq(*b.as_integer_ratio())
    return Exact.of(Fraction(b)).value if math.isfinite(b) else flint().arb(b)


def exact_mechanism(mechanism: Mechanism, reading: Reading) -> Mechanism:
    """Return the mechanism with `Exact` numbers.

    Raises:
        SolveError: a force element has a law without an enclosure.
    """
    for force in mechanism.forces:
        if getattr(force, "curve", None) or getattr(force, "law", None) is Law.CARDAN:
            raise SolveError(
                f"{force} has a curve or Cardan angles, and proofs know neither; give a stiffness"
                " and the law 'euler_parameters'"
            )

    def read(value: Any) -> Any:
        if isinstance(value, float):
            return Exact.of(reading(value))
        if isinstance(value, tuple):
            return tuple(map(read, value))  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
        return (
            Exact.of(Fraction(value))
            if isinstance(value, int) and not isinstance(value, bool)
            else value
        )

    def each(item: Any) -> Any:
        return replace(item, **{f.name: read(getattr(item, f.name)) for f in fields(item)})

    return mechanism.with_joints(
        each,
        points=[*map(each, mechanism.points)],
        drivers=[*map(each, mechanism.drivers)],
        couplers=[*map(each, mechanism.couplers)],
        bodies=[converted(body, read) for body in mechanism.bodies],
        gravity=read(mechanism.gravity),
        forces=[converted(force, read) for force in mechanism.forces],
    )
