"""Geometry fields of joints: points, directions and lengths, and their kinds."""

from __future__ import annotations

from dataclasses import field
from enum import Enum
from typing import Any


class Kind(Enum):
    """Kind of a geometry field of a joint; it sets the shape and the unit for a reader."""

    POSITION = "a point [x, y, z]"
    DIRECTION = "a direction [x, y, z]"
    POSITIONS = "two points [[x, y, z] on the first body, [x, y, z] on the second]"
    DIRECTIONS = "two directions [[x, y, z] on the first body, [x, y, z] on the second]"
    LENGTH = "a length"
    NUMBER = "a number"

    @property
    def pair(self) -> bool:
        """Whether the field has one value on each body."""
        return self is not self.single

    @property
    def single(self) -> Kind:
        """Kind of each value of a pair; the kind itself if it is no pair."""
        return _SINGLE.get(self, self)


_SINGLE = {Kind.POSITIONS: Kind.POSITION, Kind.DIRECTIONS: Kind.DIRECTION}


def _geometry(kind: Kind, **options: Any) -> Any:
    return field(metadata={"kind": kind}, **options)


def position(**options: Any) -> Any:
    """Return a field: a point common to both bodies, global at design [m]."""
    return _geometry(Kind.POSITION, **options)


def direction() -> Any:
    """Return a field: a direction common to both bodies, global at design, not zero [-]."""
    return _geometry(Kind.DIRECTION)


def positions() -> Any:
    """Return a field: a point on each body, global at design [m]."""
    return _geometry(Kind.POSITIONS)


def directions() -> Any:
    """Return a field: a direction on each body, global at design, of non-zero length [-]."""
    return _geometry(Kind.DIRECTIONS)


def length(**options: Any) -> Any:
    """Return a field: a length [m]."""
    return _geometry(Kind.LENGTH, **options)
