"""Measure of bodies: their rotation since design."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from ...algebra import Vec3, X, Y, triple
from ...jet import Jet
from ...mechanism.mechanism import Mechanism, Point
from ..quantity import MARKER
from ..rotation import euler_parameters, rotation_vector, smallest
from .base import Measure, length, place_on, reach_of

ROUND_OFF = 1e-9
"""Of an angle, a thousand times what engines differ by [rad]."""


class Component(StrEnum):
    """A component of the rotation vector [rad], or an Euler parameter [-]."""

    X = "x"
    Y = "y"
    Z = "z"
    E0 = "e0"
    E1 = "e1"
    E2 = "e2"
    E3 = "e3"


@dataclass(frozen=True)
class Orientation(Measure):
    """Rotation of a body since design: of its rotation vector or Euler parameters, global axes.

    The rotation vector is axis times angle, up to half a turn: beyond it, it is that of the smaller
    rotation the other way round. The sign of Euler parameters is continuous from the design.
    """

    type = "orientation"
    measure = "rad"
    positive = "about the global axis, by the right-hand rule"

    body: str
    component: Component

    @property
    def unit(self) -> str:
        """Radians, or 1 for an Euler parameter."""
        return "rad" if self.component in ("x", "y", "z") else "1"

    @property
    def points(self) -> tuple[str, ...]:
        """A place on the body, and two directions from there."""
        return tuple(f"{MARKER}body {self.body}: {what}" for what in ("place", "x", "y"))

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return the place and the directions of the global axes at design."""
        place, reach = place_on(mechanism, self.body), reach_of(mechanism)
        tips = (place, place + reach * X, place + reach * Y)
        marked = zip(self.points, tips, strict=True)
        return [Point(name, self.body, triple(tip)) for name, tip in marked]

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the component of the smallest rotation, [rad] or [-]."""
        return self.component_of(smallest(self.parameters(at, design)))

    def parameters(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> list[Jet]:
        """Return Euler parameters of the rotation since design, either sign."""
        place, *tips = self.points
        x, y = ((1.0 / length(design, place, tip)) * (at[tip] - at[place]) for tip in tips)
        return euler_parameters(x, y)

    def component_of(self, e: Sequence[Jet]) -> Jet:
        """Return the component of a rotation given by its Euler parameters, [rad] or [-]."""
        if self.unit == "1":
            return e[int(self.component[1])]
        # engines that agree but for round-off must not differ by a whole turn at half a turn
        rotation = rotation_vector(smallest(e, max(ROUND_OFF, self.atol)))
        return rotation["xyz".index(self.component)]
