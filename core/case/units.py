"""Units of length, angle and time in files: conversion to SI, and back for messages."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import Field, dataclass
from fractions import Fraction
from typing import Any, TypeAlias, cast

from ..joints import Kind
from ..mechanism.body import Dimension, dimension_of
from ..mechanism.loads import dimensions_of, scaled
from ..mechanism.motions import Measure

Convert: TypeAlias = Callable[[float], float]
"""Conversion from the unit of a file to SI."""

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
    convert: Convert

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
FORCES: Mapping[str, Unit] = {
    name: Unit(name, size, size.__mul__) for name, size in (("N", 1.0), ("kN", 1e3))
}
ANGLES: Mapping[str, Unit] = {"rad": RADIAN, "deg": Unit("deg", math.pi / 180.0, math.radians)}


@dataclass(frozen=True)
class FileUnits:
    """Units of length and angle of a file. Mass is in kg, time in s and force in N everywhere."""

    length: Unit = METRE
    angle: Unit = RADIAN

    def of(self, unit: str) -> tuple[str, Convert]:
        """Return the unit of the file for an SI unit (m, rad, 1, N, N m, or one of these per m or
        rad), and the conversion of its numbers to SI.
        """
        above, _, below = unit.partition("/")
        known = {"m": self.length, "rad": self.angle}
        convert = self.length if above == "N m" else known.get(above, float)
        name = convert.name if isinstance(convert, Unit) else above
        if not below:
            return name, convert
        scale = known[below](1.0)
        return f"{name}/{known[below].name}", lambda number: convert(number) / scale

    def power(self, dimension: Dimension, value: Any) -> Any:
        """Return a number, or a tuple of numbers, of a dimension in SI."""
        if isinstance(value, tuple):
            numbers = cast("tuple[float, ...]", value)
            return tuple(self.power(dimension, each) for each in numbers)
        return self.angle.power(self.length.power(value, dimension.length), dimension.angle)

    def place(self, value: Any) -> Any:
        """Return a length, or a tuple of lengths or places, in SI."""
        if isinstance(value, tuple):
            return tuple(map(self.place, cast("tuple[Any, ...]", value)))
        return self.length(value)

    def in_si(self, each: Field[Any], value: Any, driver: Unit | None = None) -> Any:
        """Return the value of a field of a joint, load or motion in SI; None for an omitted one.

        Args:
            driver: unit of the values of the driver of a motion.
        """
        if value is None:
            return None
        if dimension := dimension_of(each):
            return self.power(dimension, value)
        if (pair := dimensions_of(each)) is not None:
            try:
                return scaled(value, [self.power(dimension, 1.0) for dimension in pair])
            except (TypeError, ValueError):  # a row of another length, or rows and numbers mixed
                return value  # the element's own check names it
        if each.metadata.get("kind") in (Kind.POSITION, Kind.POSITIONS, Kind.LENGTH):
            return self.place(value)
        measure = each.metadata.get("measure")
        if measure is Measure.ANGLE:
            return self.angle(value)
        if driver is not None and measure in (Measure.DRIVER, Measure.DRIVER_RATE):
            if isinstance(value, tuple):
                return tuple(map(driver, cast("tuple[float, ...]", value)))
            return driver(value)
        return value


def si_of(unit: Unit) -> str:
    """Return the SI unit of a unit of length, angle or time."""
    return "m" if unit.name in LENGTHS else "rad" if unit.name in ANGLES else "s"
