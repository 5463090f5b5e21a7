"""Measures of pairs: the distance of two points, the angle of two directions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...algebra import Vec3, cross, triple, vec
from ...errors import MechanismError
from ...jet import Jet, arctan2, doubles, norm
from ...mechanism.mechanism import Mechanism, Point, Vector
from ..quantity import MARKER
from .base import Measure, place_on, reach_of


@dataclass(frozen=True)
class Distance(Measure):
    """Distance between two points, such as the length of a damper.

    Its rates are unknown while the points coincide.
    """

    type = "distance"
    measure = "m"
    positive = "longer"

    between: tuple[str, str] = field(metadata={"key": "points"})
    relative: bool = False

    @property
    def points(self) -> tuple[str, ...]:
        """Both points."""
        return self.between

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the distance [m], minus its value at design if relative."""
        return self._apart(at) - self._apart(design) if self.relative else self._apart(at)

    def _apart(self, at: Mapping[str, Vec3]) -> Jet:
        first, second = (at[name] for name in self.between)
        size = np.maximum(*(doubles(norm(each, 0.0)) for each in (first, second)))
        return norm(second - first, size)


@dataclass(frozen=True)
class Angle(Measure):
    """Angle between a direction of one body and a direction of another, 0 to pi.

    Its rates are unknown while they are parallel, to 1e-6 rad.

    Attributes:
        directions: global at design, any length but zero [-].
    """

    type = "angle"
    measure = "rad"
    positive = "wider"

    bodies: tuple[str, str]
    directions: tuple[Vector, Vector]
    relative: bool = False

    def check(self, mechanism: Mechanism) -> None:
        """Raise MechanismError unless the bodies exist and the directions are not zero."""
        super().check(mechanism)
        if not all(map(any, self.directions)):
            raise MechanismError(
                "found zero, expected a direction; give one of any other length",
                f"outputs.{self.name}.directions",
            )

    @property
    def points(self) -> tuple[str, ...]:
        """A place on each body and the tip of its direction there."""
        marked = zip(self.bodies, self.directions, strict=True)
        return tuple(
            f"{MARKER}body {body}: {what}"
            for body, along in marked
            for what in ("place", " ".join(map(repr, along)))
        )

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return the places and the tips."""
        reach, names = reach_of(mechanism), iter(self.points)
        found: list[Point] = []
        for body, along in zip(self.bodies, self.directions, strict=True):
            place, d = place_on(mechanism, body), vec(along)
            tip = place + (reach / math.sqrt(d @ d)) * d
            found += [Point(next(names), body, triple(each)) for each in (place, tip)]
        return found

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the angle [rad], minus its value at design if relative."""
        return self._between(at) - self._between(design) if self.relative else self._between(at)

    def _between(self, at: Mapping[str, Vec3]) -> Jet:
        first, a, second, b = (at[name] for name in self.points)
        a, b = a - first, b - second
        size = np.sqrt(doubles(a @ a) * doubles(b @ b))
        return arctan2(norm(cross(a, b), size), a @ b)
