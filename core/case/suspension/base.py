"""What an output of a suspension is: a formula over the vectors of a corner, and what it tells of
its unit and sign.

A new output type is a frozen dataclass with `type`, `measure`, `positive`, `needs`, `reads` and a
formula, below one of the three kinds here. Declaring the class registers it: case files can name it
at once, and `kincheck list --outputs` prints it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Any, ClassVar

import numpy as np

from ...algebra import Vec3
from ...jet import Jet
from ...trajectory import Array
from ..case import PER_TRAVEL
from .corner import Corner
from .vehicle import Vehicle

# Samples at which the wheel travels slower than this part of the fastest point are left out: there
# a quotient by the speed of travel has lost three digits of the rates it is made of, and more the
# slower it gets.
STILL = 1e-3


@dataclass(frozen=True)
class SuspensionOutput(ABC):
    """A quantity of one wheel over its travel; judged, reported and compared like any other output.

    Attributes:
        type: the name in case files.
        measure: its unit: m, rad, or 1 for a ratio.
        positive: what a positive value means, for all wheels and conventions.
        needs: attributes of the vehicle that may be left out in general, but not here.
        reads: attributes of the vehicle that name the points it reads.
        atol, rtol: an error is accepted up to atol [unit] + rtol * range of the reference.
    """

    type: ClassVar[str]
    measure: ClassVar[str]
    positive: ClassVar[str]
    needs: ClassVar[tuple[str, ...]] = ()
    reads: ClassVar[tuple[str, ...]]
    registry: ClassVar[dict[str, type[SuspensionOutput]]] = {}

    name: str
    vehicle: Vehicle
    atol: float
    rtol: float
    why: str

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "type" in cls.__dict__:
            SuspensionOutput.registry[cls.type] = cls

    @abstractmethod
    def value(self, corner: Corner) -> Jet:
        """The formula."""

    @abstractmethod
    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """The output over the samples; see `Quantity.of`."""

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points it reads."""
        read: list[str] = []
        for each in self.reads:
            found: str | tuple[str, str] = getattr(self.vehicle, each)
            read += [found] if isinstance(found, str) else found
        return tuple(read)

    @property
    def unit(self) -> str:
        """That of its type."""
        return self.measure

    @property
    def orders(self) -> int:
        """Value, rate and second rate."""
        return 3

    @property
    def sense(self) -> str:
        """What a positive value means for this wheel, in words."""
        return f"positive: {self.positive}"

    @property
    def problem(self) -> str:
        """Why there is no such output of this wheel: what was found, expected, and what to do;
        empty where there is.
        """
        return ""

    @property
    def signs(self) -> str:
        """The convention in words."""
        return self.vehicle.signs

    @property
    def facts(self) -> Mapping[str, Any]:
        """What a reader of results needs to know of it."""
        own = {each: value for each, value in asdict(self).items() if each != "vehicle"}
        return {"type": self.type, "unit": self.unit, "sense": self.sense, **own}


@dataclass(frozen=True)
class Change(SuspensionOutput):
    """A coordinate, measured from the design position."""

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """The coordinate less that at design."""
        return self.value(Corner(self.vehicle, at)) - self.value(Corner(self.vehicle, design))


@dataclass(frozen=True)
class Attitude(SuspensionOutput):
    """An angle or an offset that is known at every position.

    Attributes:
        relative: measured from the design position.
    """

    relative: bool = False

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """The angle or offset, less that at design if it is relative."""
        value = self.value(Corner(self.vehicle, at))
        return value - self.value(Corner(self.vehicle, design)) if self.relative else value


@dataclass(frozen=True)
class Rate(SuspensionOutput):
    """A quotient of velocities: known where the wheel travels, and with one derivative less.

    It is a property of the position only while nothing but the travel moves the wheel.
    """

    @property
    def orders(self) -> int:
        """Value and rate; they take velocities and accelerations."""
        return 2

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """The quotient, NaN where the wheel stands still."""
        corner = Corner(self.vehicle, at)
        return where_moving(self.value(corner), corner, at)


@dataclass(frozen=True)
class PerTravel:
    """The derivative of an output by wheel travel: upward displacement of the wheel centre against
    the vehicle's body, jounce.

    It is the slope along the sweep, q' / s': with further drivers that move, their share is in it.

    Attributes:
        atol: of the output, over the size of the mechanism [unit / m].
    """

    of_output: SuspensionOutput
    atol: float

    @property
    def name(self) -> str:
        """That of the output, with an ending."""
        return f"{self.of_output.name}{PER_TRAVEL}"

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points it reads."""
        return tuple(dict.fromkeys((*self.of_output.points, self.vehicle.wheel_center)))

    @property
    def orders(self) -> int:
        """One less than the output has."""
        return self.of_output.orders - 1

    @property
    def unit(self) -> str:
        """That of the output by metres."""
        return f"{self.of_output.unit}/m"

    @property
    def rtol(self) -> float:
        """As of the output."""
        return self.of_output.rtol

    @property
    def why(self) -> str:
        """The reason for the tolerance."""
        return f"that of {self.of_output.name} over the size of the mechanism; {self.of_output.why}"

    @property
    def sense(self) -> str:
        """What a positive value means, in words."""
        return f"{self.of_output.sense}, per metre of jounce travel"

    @property
    def vehicle(self) -> Vehicle:
        """That of the output."""
        return self.of_output.vehicle

    @property
    def signs(self) -> str:
        """The convention in words."""
        return self.of_output.signs

    @property
    def facts(self) -> Mapping[str, Any]:
        """What a reader of results needs to know of it."""
        known: Sequence[str] = ("name", "unit", "sense", "atol", "rtol", "why")
        return {
            "type": "per_travel",
            "of": self.of_output.name,
            **{each: getattr(self, each) for each in known},
        }

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """The slope, NaN where the wheel stands still."""
        corner = Corner(self.vehicle, at)
        return where_moving(self.of_output.of(at, design).dot / corner.center.z.dot, corner, at)


def where_moving(quotient: Jet, corner: Corner, at: Mapping[str, Vec3]) -> Jet:
    """The quotient by the speed of travel, NaN where that is as good as zero beside the fastest of
    the points.
    """
    travel = np.abs(corner.center.z.v)
    speeds = [
        np.sqrt(sum(component.v * component.v for component in point)) for point in at.values()
    ]
    # over points and samples, not over lanes: variants of a design may be side by side, and are not
    # to be judged by one another
    fastest = np.max(np.nan_to_num(np.array(speeds)), axis=(0, 1), initial=0.0)
    still = ~(travel > STILL * fastest)

    def masked(values: Array) -> Array:
        return np.where(still, np.nan, values)

    return Jet(masked(quotient.x), masked(quotient.v), masked(quotient.a))


def own_keys(cls: type[SuspensionOutput]) -> list[Any]:
    """The fields of a type beyond those all have: what a case file gives."""
    inherited = {each.name for each in fields(SuspensionOutput)}
    return [each for each in fields(cls) if each.name not in inherited]
