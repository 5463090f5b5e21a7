"""Base classes of suspension outputs: a formula over the vectors of a corner, with unit and sign;
and derivatives by wheel travel.

A new output type is a frozen dataclass with `type`, `measure`, `positive`, `needs` and a formula,
derived from one of the three kinds here, or from `AxleOutput`. The class declaration
registers it: case files can name it at once, and `kincheck list --outputs` prints it.
"""

from __future__ import annotations

from abc import abstractmethod
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, reduce
from typing import Annotated, Any, ClassVar

from ....algebra import Scalar, Vec3, where_larger
from ....case.case import HELD_BUT, PER_TRAVEL
from ....case.io.schema import one_of
from ....case.quantity import HIDDEN, Derived, PoseQuantity, TypedQuantity
from ....jet import UNKNOWN, Jet
from ....mechanism.mechanism import Mechanism, Point
from .corner import Corner, Side, Vehicle

KEPT = 4096
"""Outputs whose points are kept: those of many axles, with slopes."""
_SIDES: Any = Annotated[Side, one_of(Side)]


class _ByFormula(PoseQuantity):
    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points it reads."""
        return _points_of(self)


@lru_cache(KEPT)
def _points_of(output: PoseQuantity) -> tuple[str, ...]:
    """Return the names of the points that a formula reads when it runs on unknown places."""
    read = defaultdict[str, Vec3](lambda: Vec3(UNKNOWN, UNKNOWN, UNKNOWN))
    output.of(read, read)
    return tuple(read)


@dataclass(frozen=True)
class SuspensionOutput(_ByFormula, TypedQuantity):
    """A quantity of a wheel or an axle, judged, reported and compared like any other output.

    Attributes:
        nowhere: reason why it has no value at some poses; empty if it has one at all.
        atol, rtol: an error is accepted up to atol [unit] + rtol * range of the reference.
    """

    further: ClassVar[Mapping[str, tuple[Any, Any]]] = {"side": (_SIDES | None, None)}
    nowhere: ClassVar[str] = ""
    registry: ClassVar[dict[str, type[SuspensionOutput]]] = {}

    name: str
    vehicle: Vehicle = field(metadata=HIDDEN)
    atol: float
    rtol: float
    why: str

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

    # with both lists of arguments, a type checker accepts formulas of one corner and of two
    @abstractmethod
    def value(self, *corners: Any, **named: Any) -> Jet:
        """Return the value of the formula, of the corner of each wheel."""

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the output, minus its value at design if it is relative."""
        now = self.value(*(Corner(wheel, at) for wheel in self.vehicles))
        if not getattr(self, "relative", False):
            return now
        return now - self.value(*(Corner(wheel, design) for wheel in self.vehicles))


@dataclass(frozen=True)
class Change(SuspensionOutput):
    """A coordinate relative to the design position."""

    measure = "m"
    relative: ClassVar[bool] = True


@dataclass(frozen=True)
class Attitude(SuspensionOutput):
    """An angle or an offset, known at every position.

    Attributes:
        relative: whether it is measured from the design position.
    """

    measure = "rad"

    relative: bool = False


@dataclass(frozen=True)
class Rate(SuspensionOutput):
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

    def resting(self, at: Mapping[str, Vec3]) -> tuple[Scalar, Scalar] | None:
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
class PerTravel(_ByFormula, Derived):
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
