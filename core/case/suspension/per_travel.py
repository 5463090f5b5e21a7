"""Derivatives of suspension outputs by wheel travel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ...algebra import Vec3
from ...jet import Jet
from ...mechanism.mechanism import Mechanism, Point
from ..case import PER_TRAVEL
from ..quantity import PoseQuantity
from .base import SuspensionOutput, held, where_moving
from .corner import Corner
from .vehicle import Vehicle


@dataclass(frozen=True)
class PerTravel(PoseQuantity):
    """The derivative of an output by wheel travel (jounce): the upward displacement of the wheel
    centre relative to the vehicle's body.

    Other drivers are held, see `Vehicle.travel`. If the vehicle has no driver of its travel, it is
    the slope along the sweep, q' / s', and includes the share of other moving drivers.

    Attributes:
        atol: tolerance of the output over the size of the mechanism [unit / m].
    """

    of_output: SuspensionOutput
    atol: float

    @property
    def name(self) -> str:
        """Name of the output with the suffix `PER_TRAVEL`."""
        return f"{self.of_output.name}{PER_TRAVEL}"

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points it reads."""
        return tuple(dict.fromkeys((*self.of_output.points, self.vehicle.wheel_center)))

    @property
    def orders(self) -> int:
        """One less than those of the output; the value alone where other drivers are held."""
        return 1 if self.vehicle.travel else self.of_output.orders - 1

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return the markers of the output."""
        return self.of_output.markers(mechanism)

    @property
    def unit(self) -> str:
        """Unit of the output per metre."""
        return f"{self.of_output.unit}/m"

    @property
    def rtol(self) -> float:
        """Relative tolerance of the output."""
        return self.of_output.rtol

    @property
    def why(self) -> str:
        """Reason for the tolerance."""
        return f"that of {self.of_output.name} over the size of the mechanism; {self.of_output.why}"

    @property
    def sense(self) -> str:
        """Meaning of a positive value, in words."""
        return f"{self.of_output.sense}, per metre of jounce travel"

    @property
    def vehicle(self) -> Vehicle:
        """Vehicle of the output."""
        return self.of_output.vehicle

    @property
    def signs(self) -> str:
        """Convention of signs and axes, in words."""
        return self.of_output.signs

    @property
    def facts(self) -> Mapping[str, Any]:
        """Properties for readers of results."""
        known: Sequence[str] = ("name", "unit", "sense", "atol", "rtol", "why")
        return {
            "type": "per_travel",
            "of": self.of_output.name,
            **{each: getattr(self, each) for each in known},
            **held(self.vehicle),
        }

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the slope, NaN while the wheel is at rest."""
        corner = Corner(self.vehicle, at)
        return where_moving(self.of_output.of(at, design).dot / corner.center.z.dot, corner, at)
