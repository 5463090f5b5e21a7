"""Conversion of the numbers of a case file to SI, and of its directions to unit vectors."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from ...joints import Kind
from ...mechanism.body import Dimension
from ...mechanism.mechanism import Vector
from ..units import Unit
from .document import fault


def geometry_in_si(kind: Kind | None, value: Any, length: Unit) -> Any:
    """Return geometry in SI; None for an omitted field.

    Directions and plain numbers have no unit.
    """
    if value is None:
        return None
    match kind:
        case Kind.LENGTH:
            return length(value)
        case Kind.POSITION:
            return tuple(map(length, value))
        case Kind.POSITIONS:
            return tuple(tuple(map(length, each)) for each in value)
        case Kind.DIRECTION | Kind.DIRECTIONS | Kind.NUMBER | None:
            return value


def direction(file: Path, key: str, found: Vector) -> Vector:
    """Return the unit vector of a direction of a file.

    Raises:
        CaseError: it is zero.
    """
    if not any(found):
        raise fault(file, key, "found zero, expected a direction; give one of any other length")
    length = math.hypot(*found)
    x, y, z = found
    return x / length, y / length, z / length


def load_in_si(dimension: Dimension, value: Any, length: Unit, angle: Unit) -> Any:
    """Return a number, or a tuple of numbers, of a dimension in SI; None for an omitted field."""
    if value is None:
        return None
    if isinstance(value, tuple):
        return tuple(load_in_si(dimension, each, length, angle) for each in value)  # pyright: ignore[reportUnknownVariableType]
    return angle.power(length.power(value, dimension.length), dimension.angle)
