"""Quantities to compare: functions of the motion of points, the plain coordinate of a point, and
the points that they add to a mechanism.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import Field, asdict, dataclass, fields, replace
from enum import StrEnum
from functools import reduce
from operator import add
from typing import Any, ClassVar, Protocol, cast

import numpy as np

from ..algebra import Scalar, Vec3
from ..jet import Jet, known
from ..mechanism.mechanism import Mechanism, Point, Vector
from ..trajectory import MARKER as MARKER
from ..trajectory import PointMotion

ORDERS = 3
"""Orders of an output of the pose alone: value, velocity and acceleration."""


AXES: Mapping[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
"""Global axes by name."""


class Axis(StrEnum):
    """A global axis."""

    X = "x"
    Y = "y"
    Z = "z"


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
        undefined: reason why solved samples have no value; empty if all have.
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
    def undefined(self) -> str: ...

    @property
    def period(self) -> float: ...

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return the points it reads that the reader of a case adds to the mechanism."""
        ...

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the quantity over the samples; unknown values are NaN.

        This is its equation, over scalars of any kind: lanes, balls, traced scalars.

        Args:
            at: global positions of its points as jets [m].
            design: the same at the design position, at rest.
        """
        ...

    def terms(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Sequence[Jet]:
        """Return what it follows from over a sweep: itself, or the Euler parameters of a body,
        whose sign is known over a sweep only.
        """
        ...

    def resting(self, at: Mapping[str, Vec3]) -> tuple[Scalar, Scalar] | None:
        """Return squares of two speeds: samples have no value where the first is negligible
        against the second over the sweep; see `where_moving`. None for an output of poses.
        """
        ...


# Samples with a speed below this fraction of the fastest point's speed are left out: a quotient by
# the speed has lost three digits of its rates there, and more at lower speeds.
STILL = 1e-3


def where_moving(quotient: Jet, speeds: tuple[Any, Any] | None) -> Jet:
    """Return a quotient by a speed, NaN at samples where this speed is negligible.

    The largest speed is over the samples, not over lanes: lanes may hold variants of a design,
    which must not be judged by one another.

    Args:
        speeds: as `Quantity.resting` gives them; samples along the first axis.
    """
    if speeds is None:
        return quotient
    own, fastest = (np.asarray(each, dtype=np.float64) for each in speeds)
    limit = np.broadcast_to(STILL**2 * np.fmax.reduce(fastest, axis=0, initial=0.0), own.shape)
    return quotient if (own > limit).all() else known(own, limit, quotient)


def known_at(output: Quantity, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
    """Return an output over the samples, its turns not counted, NaN where it has no value."""
    return where_moving(output.of(at, design), output.resting(at))


def point_jets(motion: PointMotion) -> Vec3:
    """Return the position of a point as jets [m], with NaN for rates that nobody gives."""
    x, v, a = (
        np.full(np.shape(motion.position), np.nan)
        if each is None
        else np.asarray(each, dtype=np.float64)
        for each in (motion.position, motion.velocity, motion.acceleration)
    )
    return Vec3(*(Jet(x[:, k], v[:, k], a[:, k]) for k in range(3)))


def still_jets(position: Iterable[Any]) -> Vec3:
    """Return a position at rest as jets [m]."""
    return Vec3(*(Jet(np.asarray(x), np.zeros(()), np.zeros(())) for x in position))


HIDDEN: Mapping[str, Any] = {"hidden": True}
FACT: Mapping[str, Any] = {"hidden": True, "fact": True}
"""Metadata of a field that the table of an output in a case file does not give; it is a fact of the
output, or none.
"""


class PoseQuantity(ABC):
    """Properties of a quantity of the pose, see `Quantity`, unless its class has others."""

    @property
    def forces(self) -> tuple[str, ...]:
        """None: it is a motion."""
        return ()

    @property
    def orders(self) -> int:
        """Value, rate and second rate."""
        return ORDERS

    @property
    def undefined(self) -> str:
        """Empty: it has a value at every pose."""
        return ""

    @property
    def period(self) -> float:
        """Zero: each value is a pose of its own."""
        return 0.0

    @property
    def signs(self) -> str:
        """Empty: only the case's own axes apply."""
        return ""

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return nothing: it reads points of the mechanism alone."""
        return ()

    @abstractmethod
    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the quantity over the samples; see `Quantity.of`."""

    def terms(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Sequence[Jet]:
        """Return the quantity alone."""
        return (self.of(at, design),)

    def resting(self, at: Mapping[str, Vec3]) -> tuple[Scalar, Scalar] | None:
        """Return None: it is an output of poses."""
        return None


class TypedQuantity(PoseQuantity):
    """A quantity with a type in case files; a subclass with a type registers itself.

    Attributes:
        type: name in case files.
        measure: SI unit: m, rad, or 1.
        positive: meaning of a positive value.
        needs: what is optional in the table of the type, and required here.
        further: further keys in case files beyond the fields of the class: type and default.
        registry: classes by type.
    """

    type: ClassVar[str]
    measure: ClassVar[str]
    positive: ClassVar[str]
    needs: ClassVar[tuple[str, ...]] = ()
    further: ClassVar[Mapping[str, tuple[Any, Any]]] = {}
    registry: ClassVar[dict[str, Any]]

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "type" in cls.__dict__:
            cls.registry[cls.type] = cls

    @property
    def unit(self) -> str:
        """Unit of the type."""
        return self.measure

    @property
    def side(self) -> str:
        """Side of the vehicle that it is of, left or right; empty if of none."""
        return ""

    @property
    def sense(self) -> str:
        """Meaning of a positive value, in words."""
        return f"positive: {self.positive}"

    @property
    def facts(self) -> Mapping[str, Any]:
        """Properties for readers of results."""
        own = {
            each.name: getattr(self, each.name)
            for each in fields(cast("Any", self))
            if each.metadata.get("fact", not each.metadata.get("hidden"))
        }
        return {"type": self.type, "unit": self.unit, "sense": self.sense, **own}


def own_keys(cls: type[Any]) -> list[Field[Any]]:
    """Return the fields of a typed quantity beyond the common ones, which case files give."""
    common = ("name", "atol", "rtol", "why")
    return [
        each for each in fields(cls) if each.name not in common and not each.metadata.get("hidden")
    ]


class Derived(PoseQuantity):
    """A quantity derived from an output, with its tolerance; the reader of a case file adds it."""


class Convention(StrEnum):
    """Standard of the axes and signs of outputs. SAE J670 also allows z up; here its name means the
    historical z down.
    """

    ISO_8855 = "iso8855"
    SAE_J670 = "sae_j670"

    @property
    def words(self) -> str:
        """Standard and its axes, in words."""
        return (
            "ISO 8855 (x forward, y left, z up)"
            if self is Convention.ISO_8855
            else "SAE J670 (x forward, y right, z down)"
        )

    @property
    def up(self) -> int:
        """Factor from an upward component to one along z, and from a leftward component to one
        along y.
        """
        return 1 if self is Convention.ISO_8855 else -1


@dataclass(frozen=True)
class Output(PoseQuantity):
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
    def sense(self) -> str:
        """Empty: the direction states it."""
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


def with_markers(mechanism: Mechanism, outputs: Sequence[Quantity]) -> Mechanism:
    """Return the mechanism with the points that outputs read beyond its own."""
    added = {point.name: point for output in outputs for point in output.markers(mechanism)}
    known = {point.name for point in mechanism.points}
    new = [point for name, point in added.items() if name not in known]
    return replace(mechanism, points=[*mechanism.points, *new]) if new else mechanism
