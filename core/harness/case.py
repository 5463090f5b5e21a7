"""A case: a mechanism, a sweep of one driver, the outputs to compare, and the truth about them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from ..mechanism import Mechanism, Vector
from ..motions import Absolute, Motion, Path, Ramp
from ..trajectory import Array

TIME = "time"
"""The name a sweep has instead of a driver's where time itself is swept."""


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
    """One driver moved over a grid of values at a constant rate, or time; other drivers follow motions of their own, or hold.

    Attributes:
        driver: name of the swept driver, or "time" where drivers follow their motions only.
        values: driver values in the order start..stop [m or rad], or times [s], shape (n,).
        rate: driver units per second; velocities and accelerations are per second at this constant rate.
        design: the driver's value at the design position: zero unless its values are absolute [m or rad].
        motions: of the drivers other than the swept one, from their design values, over the time in which the swept one goes
            from its design value at the rate.
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
        design = {name: motion.design for name, motion in self.motions.items() if isinstance(motion, Absolute)}
        if self.driver == TIME:
            return Path(self.motions, self.values, design)
        moved = {self.driver: Ramp(self.rate), **self.motions}
        return Path(moved, self.change / self.rate, {self.driver: self.design, **design})

    @property
    def moved(self) -> dict[str, Array]:
        """What is swept [m, rad or s], then every further moving driver [m or rad], at the samples, shape (n,) each."""
        path = self.path
        further = {name: path.design.get(name, 0.0) + motion.at(path.times)[0] for name, motion in self.motions.items()}
        return {self.driver: self.values, **further}


@dataclass(frozen=True)
class Output:
    """A compared quantity: a point's coordinate along a direction.

    Attributes:
        direction: global unit vector [-].
        relative: measured from the design position.
        atol, rtol: an error is accepted up to atol [m, m/s, m/s^2] + rtol * range of the reference.
        why: the reason for the tolerance.
    """

    name: str
    point: str
    direction: Vector
    relative: bool
    atol: float
    rtol: float
    why: str
    unit: str = "m"


@dataclass(frozen=True, eq=False)
class Series:
    """One output over the samples: value [unit], and derivatives by time where they are known, each of shape (n,)."""

    position: Array
    velocity: Array | None = None
    acceleration: Array | None = None


@dataclass(frozen=True, eq=False)
class Case:
    """All that an engine needs to solve it and the harness needs to judge it. SI units throughout.

    Attributes:
        truth: the kind of the reference; consensus_only where there is none.
        reference: true values by output name, on the grid of the sweep.
    """

    name: str
    source: str
    truth: Truth
    mechanism: Mechanism
    sweep: Sweep
    outputs: tuple[Output, ...]
    reference: Mapping[str, Series] = field(default_factory=dict[str, Series])

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points that outputs read; the motion of no other is needed."""
        return tuple(dict.fromkeys(output.point for output in self.outputs))
