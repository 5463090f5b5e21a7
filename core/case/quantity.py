"""Quantities to compare: functions of the motion of points, and the plain coordinate of a point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import reduce
from operator import add
from typing import Any, Protocol

from ..algebra import Vec3
from ..jet import Jet
from ..mechanism.mechanism import Mechanism, Point, Vector
from ..trajectory import MARKER as MARKER

ORDERS = 3
"""Orders of an output of the pose alone: value, velocity and acceleration."""


class Quantity(Protocol):
    """An output to compare: a function of the motion of points.

    Attributes:
        points: names of the points it reads.
        forces: names of the joints, drivers and force elements whose forces it reads.
        unit: SI unit of its value: m, rad, 1, or one of these per m.
        orders: number of orders (value, first and second time derivative) computable from results.
        period: values that differ by a multiple of it are the same pose [unit]; zero if none are.
            `of` then returns any of them, and `rotation.turns` counts the periods along the sweep.
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
    def forces(self) -> tuple[str, ...]: ...
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

    @property
    def period(self) -> float: ...

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return the points it reads that the reader of a case adds to the mechanism."""
        ...

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
    def period(self) -> float:
        """Zero: each value is a pose of its own."""
        return 0.0

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return nothing: it reads a point of the mechanism."""
        return ()

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
    def forces(self) -> tuple[str, ...]:
        """None: it is a motion."""
        return ()

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
