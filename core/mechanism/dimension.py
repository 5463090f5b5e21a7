"""Dimensions of masses and loads: a number of them changes with the units of length and angle."""

from __future__ import annotations

from dataclasses import Field, dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Dimension:
    """Powers of force, length and angle in a quantity; mass is in kg and time in s everywhere.

    Attributes:
        unit: the unit, with places for those of length and angle.
    """

    unit: str
    force: int = 0
    length: int = 0
    angle: int = 0

    def __str__(self) -> str:
        return self.of("m", "rad")

    def of(self, length: str, angle: str) -> str:
        """Return the unit with names for the units of length and angle."""
        return self.unit.format(length=length, angle=angle)

    def in_kg_and_s(self, number: float, unit: float) -> float:
        """Return a number in SI as one in kg, s and a unit of length [m], which sets the force."""
        return number / unit ** (self.force + self.length)


MASS = Dimension("kg")
LENGTH = Dimension("{length}", length=1)
ANGLE = Dimension("{angle}", angle=1)
ACCELERATION = Dimension("{length}/s^2", length=1)
INERTIA = Dimension("kg {length}^2", length=2)
FORCE = Dimension("N", force=1)
TORQUE = Dimension("N {length}", force=1, length=1)
STIFFNESS = Dimension("N/{length}", force=1, length=-1)
DAMPING = Dimension("N s/{length}", force=1, length=-1)
TURNING_STIFFNESS = Dimension("N {length}/{angle}", force=1, length=1, angle=-1)
TURNING_DAMPING = Dimension("N {length} s/{angle}", force=1, length=1, angle=-1)


def quantity(dimension: Dimension, **options: Any) -> Any:
    """Return a field of a load: a number or numbers of a dimension."""
    return field(metadata={"dimension": dimension}, **options)


def dimension_of(each: Field[Any]) -> Dimension | None:
    """Return the dimension of a field of a load; None for a name or a point."""
    return each.metadata.get("dimension")
