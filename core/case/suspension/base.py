"""Base classes of suspension outputs: a formula over the vectors of a corner, with unit and sign.

A new output type is a frozen dataclass with `type`, `measure`, `positive`, `needs`, `reads` and a
formula, derived from one of the three kinds here, or from `AxleOutput`. The class declaration
registers it: case files can name it at once, and `kincheck list --outputs` prints it.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

import numpy as np

from ...algebra import Vec3
from ...jet import Jet, where
from ...mechanism.mechanism import Mechanism, Point
from ..case import HELD_BUT
from ..quantity import HIDDEN, TypedQuantity
from .corner import Corner
from .vehicle import Vehicle

# Samples with a wheel speed below this fraction of the fastest point's speed are left out: a
# quotient by the travel speed has lost three digits of its rates there, and more at lower speeds.
STILL = 1e-3


@dataclass(frozen=True)
class SuspensionOutput(TypedQuantity):
    """A quantity of a wheel or an axle, judged, reported and compared like any other output.

    Attributes:
        needs: vehicle attributes that are optional in general, but required here.
        reads: vehicle attributes with the names of the points it reads.
        atol, rtol: an error is accepted up to atol [unit] + rtol * range of the reference.
    """

    needs: ClassVar[tuple[str, ...]] = ()
    reads: ClassVar[tuple[str, ...]]
    registry: ClassVar[dict[str, type[SuspensionOutput]]] = {}

    name: str
    vehicle: Vehicle = field(metadata=HIDDEN)
    atol: float
    rtol: float
    why: str

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points it reads."""
        return self.read_of(self.vehicle)

    def read_of(self, vehicle: Vehicle) -> tuple[str, ...]:
        """Return the names of the points it reads of a wheel."""
        read: list[str] = []
        for each in self.reads:
            found: str | tuple[str, ...] | None = getattr(vehicle, each)
            read += [found] if isinstance(found, str) else found or ()
        return tuple(read)

    @property
    def vehicles(self) -> tuple[Vehicle, ...]:
        """The wheels that it is of."""
        return (self.vehicle,)

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return the points on the wheel carrier that it reads beyond those of the case."""
        found: list[Point] = []
        for wheel in self.vehicles:
            body = mechanism.point(wheel.wheel_center).body
            found += [
                Point(name, body, place)
                for name, place in wheel.markers(mechanism).items()
                if name in self.points
            ]
        return found

    @property
    def problem(self) -> str:
        """Reason why this wheel has no such output: found, expected, remedy. Otherwise empty."""
        return ""

    @property
    def signs(self) -> str:
        """Convention of signs and axes, in words."""
        return self.vehicle.signs

    @property
    def facts(self) -> Mapping[str, Any]:
        """Properties for readers of results."""
        own = {
            each: value for each, value in asdict(self).items() if each not in ("vehicle", "other")
        }
        return {"type": self.type, "unit": self.unit, "sense": self.sense, **own}


@dataclass(frozen=True)
class WheelOutput(SuspensionOutput):
    """A quantity of one wheel."""

    @abstractmethod
    def value(self, corner: Corner) -> Jet:
        """Return the value of the formula over the samples."""


@dataclass(frozen=True)
class Change(WheelOutput):
    """A coordinate relative to the design position."""

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the coordinate minus its value at design."""
        return self.value(Corner(self.vehicle, at)) - self.value(Corner(self.vehicle, design))


@dataclass(frozen=True)
class Attitude(WheelOutput):
    """An angle or an offset, known at every position.

    Attributes:
        relative: whether it is measured from the design position.
    """

    relative: bool = False

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the angle or offset, minus its value at design if relative."""
        value = self.value(Corner(self.vehicle, at))
        return value - self.value(Corner(self.vehicle, design)) if self.relative else value


@dataclass(frozen=True)
class Rate(WheelOutput):
    """A quotient of velocities, known only while the wheel travels, with one derivative less.

    It is a property of the position: other drivers are held, see `Vehicle.travel`.
    """

    @property
    def orders(self) -> int:
        """Value and rate, which need velocities and accelerations; the value alone where other
        drivers are held, because its rate along the sweep is another.
        """
        return 1 if self.vehicle.travel else 2

    @property
    def facts(self) -> Mapping[str, Any]:
        """Properties for readers of results."""
        return {**super().facts, **held(self.vehicle)}

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the quotient, NaN while the wheel is at rest."""
        corner = Corner(self.vehicle, at)
        return where_moving(self.value(corner), corner, at)


def held(vehicle: Vehicle) -> Mapping[str, Any]:
    """Return the drivers by which outputs of the vehicle are differentiated while others are held,
    as a fact; empty along the sweep.
    """
    return {HELD_BUT: list(vehicle.travel)} if vehicle.travel else {}


def where_moving(quotient: Jet, corner: Corner, at: Mapping[str, Vec3]) -> Jet:
    """Return a quotient by the travel speed, NaN at samples with a negligible travel speed relative
    to the fastest point.
    """
    travel = np.abs(corner.center.z.v)
    speeds = [
        np.sqrt(sum(component.v * component.v for component in point)) for point in at.values()
    ]
    # The maximum is over points and samples, not over lanes: lanes may hold variants of a design,
    # which must not be judged by one another.
    fastest = np.max(np.nan_to_num(np.array(speeds)), axis=(0, 1), initial=0.0)
    return where(travel > STILL * fastest, quotient)
