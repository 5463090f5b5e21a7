"""A case: a mechanism, a sweep of one driver, the outputs to compare, and the truth about them."""

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
"""The name a sweep has instead of a driver's where time itself is swept."""

MARKER = "~"
"""Begins the names of points that the reading of a case adds to a body, to see how it turns; they
are no hardpoints.
"""

PER_TRAVEL = ".per_travel"
"""Ends the names of derivatives by wheel travel, which the reading of a case adds to its
outputs.
"""


NO_SIZE = 1e-3
"""Size of a mechanism whose points all coincide, to rounding [m]."""
_COINCIDE = 1e-12


class Truth(StrEnum):
    """Where the reference of a case comes from. Only the first two validate anything."""

    CLOSED_FORM = "closed_form"
    THIRD_PARTY_DATA = "third_party_data"
    IN_HOUSE_ORACLE = "in_house_oracle"
    CONSENSUS_ONLY = "consensus_only"

    @property
    def validates(self) -> bool:
        """Whether agreement with it may be called validation."""
        return self in (Truth.CLOSED_FORM, Truth.THIRD_PARTY_DATA)


@dataclass(frozen=True, eq=False)
class Sweep:
    """One driver moved over a grid of values at a constant rate, or time; other drivers follow
    motions of their own, or hold.

    Attributes:
        driver: name of the swept driver, or "time" where drivers follow their motions only.
        values: driver values in the order start..stop [m or rad], or times [s], shape (n,).
        rate: driver units per second; velocities and accelerations are per second at this constant
            rate.
        design: the driver's value at the design position: zero unless its values are absolute [m or
            rad].
        motions: of the drivers other than the swept one, from their design values, over the time in
            which the swept one goes from its design value at the rate.
    """

    driver: str
    values: Array
    rate: float = 1.0
    design: float = 0.0
    motions: Mapping[str, Motion] = field(default_factory=dict[str, Motion])

    @property
    def change(self) -> Array:
        """Driver values measured from the design position, shape (n,); what an engine sets."""
        return self.values - self.design

    @property
    def path(self) -> Path:
        """How all moving drivers go with time, and the times of the samples."""
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
        """What is swept [m, rad or s], then every further moving driver [m or rad], at the samples,
        shape (n,) each.
        """
        path = self.path
        further = {
            name: path.design.get(name, 0.0) + motion.at(path.times)[0]
            for name, motion in self.motions.items()
        }
        return {self.driver: self.values, **further}


ORDERS = 3
"""Of an output that is a function of the pose alone: value, velocity and acceleration follow."""


class Quantity(Protocol):
    """What is compared: a function of the motion of points.

    Attributes:
        points: names of the points it reads.
        unit: of its value, SI: m, rad, 1, or one of these by m.
        orders: how many of value, first and second derivative by time follow from what engines
            give.
        atol, rtol: an error is accepted up to atol [unit, unit/s, unit/s^2] + rtol * range of the
            reference.
        why: the reason for the tolerance.
        sense: what a positive value means; empty where unit and name say it.
        signs: the convention of signs and axes; empty where the case's own axes are all there is.
        facts: what a reader of results needs to know of it.
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
        """The quantity over the samples; what is not known is NaN.

        Args:
            at: global positions of its points as jets [m].
            design: the same at the design position, where they stand still.
        """
        ...


@dataclass(frozen=True)
class Output:
    """The plain quantity: a point's coordinate along a direction.

    Attributes:
        direction: global unit vector [-].
        relative: measured from the design position.
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
        """The direction says it."""
        return ""

    @property
    def signs(self) -> str:
        """The convention of signs of the outputs: none but the case's own axes."""
        return ""

    @property
    def points(self) -> tuple[str, ...]:
        """The point."""
        return (self.point,)

    @property
    def facts(self) -> Mapping[str, Any]:
        """All there is to it."""
        return asdict(self)

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """The coordinate [m]; of components that do not count nothing is computed, for there may be
        very many samples.
        """
        each = zip(self.direction, at[self.point], design[self.point], strict=True)
        moved = [(along, x - start if self.relative else x) for along, x, start in each if along]
        return reduce(add, [x if along == 1.0 else along * x for along, x in moved])


@dataclass(frozen=True, eq=False)
class Series:
    """One output over the samples: value [unit], and derivatives by time where they are known, each
    of shape (n,).

    Attributes:
        possible: whether the engine gives what the value is made of; that of a derivative takes
            velocities.
    """

    position: Array
    velocity: Array | None = None
    acceleration: Array | None = None
    possible: bool = field(default=True, kw_only=True)


@dataclass(frozen=True)
class Origin:
    """Where the reference of a case comes from, and which one it is.

    Attributes:
        citation: author, title, page or address; empty where nobody says.
        file: name of the file that holds the reference; empty where none does.
        sha256: digest of that file.
        own: kincheck has made it.
    """

    citation: str
    file: str = ""
    sha256: str = ""
    own: bool = False


@dataclass(frozen=True, eq=False)
class Case:
    """All that an engine needs to solve it and the harness needs to judge it. SI units throughout.

    Attributes:
        truth: the kind of the reference; consensus_only where there is none.
        reference: true values by output name, on the grid of the sweep.
        origin: of the reference; without, it comes from where the case does.
        length_unit, angle_unit: of the numbers in the file that it was read from, by their names in
            `units`.
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
        """Names of the points that outputs read; the motion of no other is needed."""
        return tuple(dict.fromkeys(point for output in self.outputs for point in output.points))

    @property
    def signs(self) -> str:
        """The convention of signs of the outputs that have one, in words; what heads every table of
        them. Empty without.
        """
        return "; ".join(dict.fromkeys(output.signs for output in self.outputs if output.signs))


def size(case: Case) -> float:
    """Return the largest extent along a global axis of the joints and the compared points at
    design, or of the drivers' shifts [m].

    Where nothing is compared yet, all points count.
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
    """Which of the moving drivers turn, shape (drivers,)."""
    return np.array(
        [case.mechanism.driver(name).turns for name in case.sweep.path.motions], dtype=np.bool_
    )
