"""Units of length, angle and time in files: conversion to SI, and back for messages."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction

# A double holds any decimal of 15 digits. Numbers with more digits are computed ones: 10 are shown.
DIGITS, ROUNDED = 15, 10


@dataclass(frozen=True)
class Unit:
    """A unit of length, angle or time; a call converts a number of it to SI.

    Attributes:
        size: one unit in SI [m, rad or s].
        convert: conversion of a number to SI.
    """

    name: str
    size: float
    convert: Callable[[float], float]

    def __call__(self, number: float) -> float:
        return self.convert(number)

    def power(self, number: float, exponent: int) -> float:
        """Return a number of a power of this unit in SI, rounded once."""
        if exponent == 1 or self.size == 1.0:
            return self.convert(number) if exponent else number
        return float(Fraction(number) * Fraction(repr(self.size)) ** exponent)

    def written(self, value: float, among: Iterable[float] = ()) -> str:
        """Return a value in SI as the file writes it, with the unit.

        Args:
            among: numbers of the file; the first one equal to the value is quoted. Otherwise the
                shortest exact decimal is used, or a rounded one if that is too long.
        """
        for number in among:
            if self.convert(number) == value:
                return f"{number!r} {self.name}"
        number = value / self.size
        decimals = (float(f"{number:.{digits}g}") for digits in range(1, DIGITS + 1))
        exact = next((each for each in decimals if self.convert(each) == value), None)
        return (
            f"{number:.{ROUNDED}g} {self.name}" if exact is None else f"{plain(exact)} {self.name}"
        )


def plain(number: float) -> str:
    """Return the shortest decimal of a number; whole numbers have no point."""
    return repr(float(number)).removesuffix(".0")


METRE, RADIAN, SECOND = (Unit(name, 1.0, float) for name in ("m", "rad", "s"))
LENGTHS: Mapping[str, Unit] = {
    "m": METRE,
    "mm": Unit("mm", 1e-3, lambda x: x / 1000.0),
    "cm": Unit("cm", 1e-2, lambda x: x / 100.0),
    "inch": Unit("inch", 0.0254, lambda x: x * 0.0254),
    "foot": Unit("foot", 0.3048, lambda x: x * 0.3048),
}
ANGLES: Mapping[str, Unit] = {"rad": RADIAN, "deg": Unit("deg", math.pi / 180.0, math.radians)}


def si_of(unit: Unit) -> str:
    """Return the SI unit of a unit of length, angle or time."""
    return "m" if unit.name in LENGTHS else "rad" if unit.name in ANGLES else "s"


def in_units(unit: str, length: Unit, angle: Unit) -> tuple[str, float]:
    """Return the name of an SI unit, N and s as they are, with other units of length and angle, and
    the size of one of it [SI]: N m with mm is N mm, a thousandth.
    """
    size, powers = 1.0, (1, *[-1] * unit.count("/"))
    parts: list[str] = []
    for part, power in zip(unit.split("/"), powers, strict=True):
        names = [{"m": length, "rad": angle}.get(name, name) for name in part.split(" ")]
        for name in names:
            if isinstance(name, Unit):
                size = name.power(size, power)
        parts.append(" ".join(name.name if isinstance(name, Unit) else name for name in names))
    return "/".join(parts), size
