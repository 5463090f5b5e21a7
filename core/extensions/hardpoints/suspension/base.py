"""Base classes of suspension outputs: a formula over the vectors of a corner, with unit and sign;
and derivatives by wheel travel.

A new output type is a frozen dataclass with `type`, `measure`, `positive`, `needs`, `reads` and a
formula, derived from one of the three kinds here, or from `AxleOutput`. The class declaration
registers it: case files can name it at once, and `kincheck list --outputs` prints it.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import Annotated, Any, ClassVar

from ....algebra import Scalar, Vec3, where_larger
from ....case.case import HELD_BUT, PER_TRAVEL
from ....case.io.schema import one_of
from ....case.quantity import HIDDEN, Derived, TypedQuantity
from ....jet import Jet
from ....mechanism.mechanism import Mechanism, Point
from .corner import Corner, Side, Vehicle

_SIDES: Any = Annotated[Side, one_of(Side)]


@dataclass(frozen=True)
class SuspensionOutput(TypedQuantity):
    """A quantity of a wheel or an axle, judged, reported and compared like any other output.

    Attributes:
        reads: vehicle attributes with the names of the points it reads.
        nowhere: reason why it has no value at some poses; empty if it has one at all.
        atol, rtol: an error is accepted up to atol [unit] + rtol * range of the reference.
    """

    further: ClassVar[Mapping[str, tuple[Any, Any]]] = {"side": (_SIDES | None, None)}
    reads: ClassVar[tuple[str, ...]]
    nowhere: ClassVar[str] = ""
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
        read = list[str]()
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
        found = list[Point]()
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
    def side(self) -> str:
        """Side of its wheel, or of the first wheel of its axle."""
        return str(self.vehicle.side)

    @property
    def undefined(self) -> str:
        """Reason why solved samples have no value; empty if all have."""
        return self.nowhere

    @property
    def signs(self) -> str:
        """Convention of signs and axes, in words."""
        return self.vehicle.signs


@dataclass(frozen=True)
class WheelOutput(SuspensionOutput):
    """A quantity of one wheel."""


@dataclass(frozen=True)
class _OfCorner(WheelOutput):
    reads = ("wheel_center", "spin_marker")

    @abstractmethod
    def value(self, corner: Corner) -> Jet:
        """Return the value of the formula over the samples."""


@dataclass(frozen=True)
class Change(_OfCorner):
    """A coordinate relative to the design position."""

    measure = "m"

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the coordinate minus its value at design."""
        return self.value(Corner(self.vehicle, at)) - self.value(Corner(self.vehicle, design))


@dataclass(frozen=True)
class Attitude(_OfCorner):
    """An angle or an offset, known at every position.

    Attributes:
        relative: whether it is measured from the design position.
    """

    measure = "rad"

    relative: bool = False

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the angle or offset, minus its value at design if relative."""
        value = self.value(Corner(self.vehicle, at))
        return value - self.value(Corner(self.vehicle, design)) if self.relative else value


@dataclass(frozen=True)
class Rate(_OfCorner):
    """A quotient of velocities, known only while the wheel travels, with one derivative less.

    It is a property of the position: other drivers are held, see `Vehicle.travel`.
    """

    nowhere = "the wheel hardly travels there"

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
        """Return the quotient; it has no value while the wheel is at rest."""
        return self.value(Corner(self.vehicle, at))

    def resting(self, at: Mapping[str, Vec3]) -> tuple[Scalar, Scalar]:
        """Return the squares of the speeds of travel and of the fastest point."""
        return speeds(self.vehicle, at)


def held(vehicle: Vehicle) -> Mapping[str, Any]:
    """Return the drivers by which outputs of the vehicle are differentiated while others are held,
    as a fact; empty along the sweep.
    """
    return {HELD_BUT: list(vehicle.travel)} if vehicle.travel else {}


def speeds(wheel: Vehicle, at: Mapping[str, Vec3]) -> tuple[Scalar, Scalar]:
    """Return the squares of the wheel's speed of travel and of the speed of the fastest point."""
    found = [sum(x.v * x.v for x in point) for point in at.values()]
    travel = Corner(wheel, at).center.z.v
    return travel * travel, reduce(_larger, found)


def _larger(a: Scalar, b: Scalar) -> Scalar:
    return where_larger(a, b, a, b)


@dataclass(frozen=True)
class PerTravel(Derived):
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
    def undefined(self) -> str:
        """Reason why it has no value at some poses."""
        return self.of_output.undefined or Rate.nowhere

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
        """Return the slope; it has no value while the wheel is at rest."""
        return self.of_output.of(at, design).dot / Corner(self.vehicle, at).center.z.dot

    def resting(self, at: Mapping[str, Vec3]) -> tuple[Scalar, Scalar]:
        """Return the squares of the speeds of travel and of the fastest point."""
        return speeds(self.vehicle, at)
