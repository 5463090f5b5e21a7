"""A case: a mechanism, a sweep of one driver, the outputs to compare, and their reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from functools import reduce
from operator import add
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..algebra import Vec3
from ..jet import Jet
from ..mechanism.mechanism import Mechanism, Vector
from ..mechanism.motions import Absolute, Motion, Path, Ramp
from ..trajectory import Array

TIME = "time"
"""Name of the driver in a sweep of time."""

MARKER = "~"
"""Prefix of the points that the case reader adds to measure a body's rotation; no hardpoints."""

PER_TRAVEL = ".per_travel"
"""Suffix of derivatives by wheel travel, which the case reader adds to the outputs."""


HELD_BUT = "held_but"
"""Fact of an output that is differentiated by some drivers while others are held: their names."""

NO_SIZE = 1e-3
"""Size of a mechanism whose points all coincide within rounding [m]."""
_COINCIDE = 1e-12


class Truth(StrEnum):
    """Kind of the reference of a case. Only the first two count as validation."""

    CLOSED_FORM = "closed_form"
    THIRD_PARTY_DATA = "third_party_data"
    IN_HOUSE_ORACLE = "in_house_oracle"
    CONSENSUS_ONLY = "consensus_only"

    @property
    def validates(self) -> bool:
        """Whether agreement with the reference counts as validation."""
        return self in (Truth.CLOSED_FORM, Truth.THIRD_PARTY_DATA)


@dataclass(frozen=True, eq=False)
class Sweep:
    """One driver moved over a grid of values at a constant rate, or time. Other drivers follow
    their own motions or hold.

    Attributes:
        driver: name of the swept driver, or "time" if drivers only follow their motions.
        values: driver values in the order start..stop [m or rad], or times [s], shape (n,).
        rate: driver units per second, constant; velocities and accelerations are per second at it.
        design: driver value at the design position [m or rad]; zero unless its values are absolute.
        motions: motions of the other drivers, from their design values. Time is zero at the design
            value of the swept driver, which moves at the rate.
    """

    driver: str
    values: Array
    rate: float = 1.0
    design: float = 0.0
    motions: Mapping[str, Motion] = field(default_factory=dict[str, Motion])

    @property
    def change(self) -> Array:
        """Driver values relative to the design position, shape (n,), as engines set them."""
        return self.values - self.design

    @property
    def path(self) -> Path:
        """Motions of all moving drivers over time, and the times of the samples."""
        design = {
            name: motion.design
            for name, motion in self.motions.items()
            if isinstance(motion, Absolute)
        }
        if self.driver == TIME:
            return Path(self.motions, self.values, design)
        moved = {self.driver: Ramp(self.rate), **self.motions}
        return Path(moved, self.change / self.rate, {self.driver: self.design, **design})

    @property
    def moved(self) -> dict[str, Array]:
        """Swept values [m, rad or s], then values of each further moving driver [m or rad], at the
        samples, shape (n,) each.
        """
        path = self.path
        further = {
            name: path.design.get(name, 0.0) + motion.at(path.times)[0]
            for name, motion in self.motions.items()
        }
        return {self.driver: self.values, **further}


ORDERS = 3
"""Orders of an output of the pose alone: value, velocity and acceleration."""


class Quantity(Protocol):
    """An output to compare: a function of the motion of points.

    Attributes:
        points: names of the points it reads.
        unit: SI unit of its value: m, rad, 1, or one of these per m.
        orders: number of orders (value, first and second time derivative) computable from results.
        atol, rtol: an error is accepted up to atol [unit, unit/s, unit/s^2] + rtol * the range of
            the reference.
        why: reason for the tolerance.
        sense: meaning of a positive value; empty if name and unit state it.
        signs: convention of signs and axes; empty if only the case's own axes apply.
        facts: properties for readers of results.
    """

    @property
    def name(self) -> str: ...
    @property
    def points(self) -> tuple[str, ...]: ...
    @property
    def unit(self) -> str: ...
    @property
    def orders(self) -> int: ...
    @property
    def atol(self) -> float: ...
    @property
    def rtol(self) -> float: ...
    @property
    def why(self) -> str: ...
    @property
    def sense(self) -> str: ...
    @property
    def signs(self) -> str: ...
    @property
    def facts(self) -> Mapping[str, Any]: ...

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the quantity over the samples; unknown values are NaN.

        Args:
            at: global positions of its points as jets [m].
            design: the same at the design position, at rest.
        """
        ...


@dataclass(frozen=True)
class Output:
    """A plain output: a point's coordinate along a direction.

    Attributes:
        direction: global unit vector [-].
        relative: whether the coordinate is measured from the design position.
    """

    name: str
    point: str
    direction: Vector
    relative: bool
    atol: float
    rtol: float
    why: str
    unit: str = "m"

    @property
    def orders(self) -> int:
        """Position, velocity and acceleration."""
        return 3

    @property
    def sense(self) -> str:
        """Empty: the direction states it."""
        return ""

    @property
    def signs(self) -> str:
        """Empty: only the case's own axes apply."""
        return ""

    @property
    def points(self) -> tuple[str, ...]:
        """The point."""
        return (self.point,)

    @property
    def facts(self) -> Mapping[str, Any]:
        """All fields."""
        return asdict(self)

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the coordinate [m]; components of zero weight are skipped, because there may be
        very many samples.
        """
        each = zip(self.direction, at[self.point], design[self.point], strict=True)
        moved = [(along, x - start if self.relative else x) for along, x, start in each if along]
        return reduce(add, [x if along == 1.0 else along * x for along, x in moved])


@dataclass(frozen=True, eq=False)
class Series:
    """One output over the samples: value [unit], and time derivatives if known, each of shape (n,).

    Attributes:
        possible: whether the engine returns the inputs of the value; an output that is a derivative
            needs velocities.
    """

    position: Array
    velocity: Array | None = None
    acceleration: Array | None = None
    possible: bool = field(default=True, kw_only=True)


@dataclass(frozen=True)
class Origin:
    """Source of the reference of a case.

    Attributes:
        citation: author, title, page or address; empty if unknown.
        file: name of the file of the reference; empty without a file.
        sha256: digest of that file.
        own: whether kincheck computed the reference.
    """

    citation: str
    file: str = ""
    sha256: str = ""
    own: bool = False


@dataclass(frozen=True, eq=False)
class Case:
    """The input of engines, and of the harness that judges their results, in SI units.

    Attributes:
        truth: kind of the reference; consensus_only without one.
        reference: true values by output name, on the grid of the sweep.
        origin: source of the reference; None for the source of the case itself.
        length_unit, angle_unit: units of the file of the case, by their names in `units`.
    """

    name: str
    source: str
    truth: Truth
    mechanism: Mechanism
    sweep: Sweep
    outputs: tuple[Quantity, ...]
    reference: Mapping[str, Series] = field(default_factory=dict[str, Series])
    origin: Origin | None = None
    length_unit: str = "m"
    angle_unit: str = "rad"

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points that outputs read; no other motion is needed."""
        return tuple(dict.fromkeys(point for output in self.outputs for point in output.points))

    @property
    def signs(self) -> str:
        """Sign conventions of the outputs in words, for the head of each table, or empty."""
        return "; ".join(dict.fromkeys(output.signs for output in self.outputs if output.signs))


def size(case: Case) -> float:
    """Return the largest extent along a global axis of joints and compared points at design, or the
    largest displacement of a driver [m].

    All points count if nothing is compared yet.
    """
    path = case.sweep.path
    values, _, _ = path.drive(list(path.motions), path.times)
    compared = case.points or [point.name for point in case.mechanism.points]
    points = [
        case.mechanism.point(name).position for name in compared if not name.startswith(MARKER)
    ]
    points += [position for joint in case.mechanism.joints for position in joint.points_on()]
    shift = float(np.ptp(values[~turning(case)], axis=1).max(initial=0.0))
    extent = max(float(np.ptp(np.array(points), axis=0).max()), shift)
    return extent if extent > _COINCIDE * float(np.abs(points).max()) else NO_SIZE


def turning(case: Case) -> NDArray[np.bool_]:
    """Return whether each moving driver turns, shape (drivers,)."""
    return np.array(
        [case.mechanism.driver(name).turns for name in case.sweep.path.motions], dtype=np.bool_
    )
