"""Force elements of a mechanism, as data.

All vectors are in global axes at the design position, SI units. A load that turns with its body
says so.

A curve of force over deflection, of a progressive rate or a bump stop, is a table of pairs. The
monotone cubic of Fritsch and Butland connects them: it is smooth to its first derivative, and rises
wherever the table rises. Beyond its ends it goes on straight.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import Field, dataclass, field, fields, replace
from enum import StrEnum
from functools import cache
from itertools import pairwise
from typing import Any, ClassVar, Self, TypeAlias, cast

from ..errors import MechanismError, Phrase
from ..input_checks import finite, finite_numbers, held, plain, require_direction
from ..joints.base import Kind, position, positions, unit
from .body import (
    ANGLE,
    DAMPING,
    FORCE,
    LENGTH,
    STIFFNESS,
    TORQUE,
    TURNING_DAMPING,
    TURNING_STIFFNESS,
    Dimension,
    dimension_of,
    quantity,
)

# Axes of a file have some digits; more than this apart from a right angle is no slip of digits.
PERPENDICULAR = 1e-3
ROUND_OFF = 4e-16


Curve: TypeAlias = tuple[tuple[float, float], ...]
"""Pairs of deflection and force, deflections increasing."""


def curve(deflection: Dimension, force: Dimension) -> Any:
    """Return a field of a force element: a curve, or None for a constant stiffness."""
    return field(default=None, metadata={"curve": (deflection, force)})


def dimensions_of(each: Field[Any]) -> tuple[Dimension, Dimension] | None:
    """Return the dimensions of a field of curves; None for another field."""
    return each.metadata.get("curve")


def checked_curve(who: str, key: str, given: Any) -> Curve:
    """Return a table as a curve.

    Raises:
        MechanismError: it is no table of pairs with increasing deflections, or has no zero of the
            force.
    """
    expected = "a table [[deflection, force], ...] of two rows or more"
    try:
        table = tuple((float(x), float(force)) for x, force in given)
    except (TypeError, ValueError):
        raise MechanismError(f"{who} is {given!r}, expected {expected}", key) from None
    if len(table) < 2 or not all(finite(number) for row in table for number in row):
        raise MechanismError(f"{who} is {given!r}, expected {expected}", key)
    deflections, forces = zip(*table, strict=True)
    for one, other in pairwise(deflections):
        if other <= one:
            raise MechanismError(
                f"{who}: deflection {other!r} follows {one!r}; deflections must increase", key
            )
    if min(forces) > 0.0 or max(forces) < 0.0:
        raise MechanismError(
            f"{who}: no force of it is zero; add the row of the free element, with force 0", key
        )
    return table


@cache
def pieces(table: Curve) -> tuple[tuple[float, float, float, float, float], ...]:
    """Return start, width and the coefficients of s, s^2, s^3 of each piece, from its start."""
    # slow to import, and few mechanisms have curves
    from scipy.interpolate import PchipInterpolator  # pyright: ignore[reportMissingTypeStubs]

    x, y = zip(*table, strict=True)
    cubic: Any = PchipInterpolator(x, y)
    rows = zip(x, x[1:], *cubic.c[2::-1].tolist(), strict=False)
    return tuple((start, stop - start, *powers) for start, stop, *powers in rows)


def scaled(value: Any, factors: Sequence[float]) -> Any:
    """Return a curve, or the curves of all axes, with deflections and forces times factors."""
    if value and not isinstance(value[0], tuple):
        return tuple(factor * x for factor, x in zip(factors, value, strict=True))
    return tuple(scaled(each, factors) for each in value)


class Axes(StrEnum):
    """The axes in which a force or torque is constant."""

    GLOBAL = "global"
    BODY = "body"

    @classmethod
    def of(cls, who: str, name: Any) -> Axes:
        """Return the axes of a name.

        Raises:
            MechanismError: there are none of that name.
        """
        try:
            return cls(name)
        except ValueError:
            raise MechanismError(
                f"{who}: frame is {name!r}, expected 'global' (constant direction) or 'body' (turns"
                " with the body)"
            ) from None


@dataclass(frozen=True)
class ForceElement:
    """Base of the force elements."""

    type: ClassVar[str]
    name: str

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies that it names."""
        return ()

    def __str__(self) -> str:
        return f"force {self.name!r} ({self.type})"

    def in_frame(self, place: Callable[[Any], Any], unit: float = 1.0) -> Self:
        """Return the element with its points passed to a function, and its numbers in kg, s and a
        unit of length [m].
        """
        changes: dict[str, Any] = {}
        for each in fields(self):
            value: Any = getattr(self, each.name)
            if value is None:
                continue
            if (dimension := dimension_of(each)) is not None:
                numbers = cast("tuple[float, ...]", value if isinstance(value, tuple) else (value,))
                new = tuple(dimension.in_kg_and_s(x, unit) for x in numbers)
                changes[each.name] = new if isinstance(value, tuple) else new[0]
            elif (pair := dimensions_of(each)) is not None:
                factors = [each_of.in_kg_and_s(1.0, unit) for each_of in pair]
                changes[each.name] = scaled(value, factors)
            elif (kind := each.metadata.get("kind")) is not None:
                changes[each.name] = tuple(map(place, value)) if kind.pair else place(value)
        return replace(self, **changes)

    def _key(self, what: str) -> str:
        return f"forces.{self.name}.{what}"

    def _curve(self) -> None:
        """Make the curve, if any, a checked one."""
        table = getattr(self, "curve", None)
        if table is not None:
            found = checked_curve(f"{self}: curve", self._key("curve"), table)
            object.__setattr__(self, "curve", found)

    def _numbers(self) -> None:
        """Make the quantities finite numbers, of zero or more unless they are angles."""
        for each in fields(self):
            if (dimension := dimension_of(each)) is not None:
                value = plain(getattr(self, each.name))
                more = None if dimension is ANGLE else ", zero or more"
                object.__setattr__(self, each.name, self._number(each.name, value, dimension, more))

    def _number(self, what: str, value: Any, dimension: Dimension, more: str | None) -> float:
        """Return a finite number; it may be negative if no more is said."""
        if not finite(value) or (value < 0.0 and more is not None):
            raise MechanismError(
                f"{self}: {what} is {value!r}, expected a number of {dimension}{more or ''}",
                self._key(what),
            )
        return float(value)

    def _vector(self, what: str, kind: str) -> None:
        found = finite_numbers(f"{self}: {what}", getattr(self, what), 3, kind)
        object.__setattr__(self, what, found)


@dataclass(frozen=True)
class SpringDamper(ForceElement):
    """A spring and a damper between a point of each of two bodies, tension positive.

    The tension is stiffness (length - free_length) + damping times the rate of the length. A curve
    adds its force at the deflection length - free_length.

    Attributes:
        i, j: first and second body.
        points: on the first and on the second body, global at design [m].
        stiffness: [N/m], zero or more.
        damping: [N s/m], zero or more.
        free_length: [m], zero or more; the length at design unless given.
        curve: tension over deflection [m, N]; none by default.
    """

    type: ClassVar[str] = "spring_damper"
    i: str
    j: str
    points: tuple[tuple[float, float, float], tuple[float, float, float]] = positions()
    stiffness: float = quantity(STIFFNESS, default=0.0)
    damping: float = quantity(DAMPING, default=0.0)
    free_length: float | None = quantity(LENGTH, default=None)
    curve: tuple[tuple[float, float], ...] | None = curve(LENGTH, FORCE)

    def __post_init__(self) -> None:
        who = f"{self}: points"
        pair = held(who, self.points, 2, Kind.POSITIONS.value)
        points = tuple(finite_numbers(who, each, 3, Kind.POSITIONS.value) for each in pair)
        object.__setattr__(self, "points", points)
        if self.i == self.j:
            raise MechanismError(
                f"{self}: both ends are on {self.i!r}; a spring needs two different bodies",
                self._key("bodies"),
            )
        length = math.dist(*points)
        if length == 0.0:
            x, y, z = points[0]
            raise MechanismError(
                Phrase(
                    *(f"{self}: its points coincide at x = ", x, ", y = ", y, ", z = ", z),
                    ", so that its force has no direction; give the two ends of the spring",
                ),
                self._key("points"),
            )
        if self.free_length is None:
            object.__setattr__(self, "free_length", length)
        self._numbers()
        self._curve()

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies that it acts on."""
        return self.i, self.j


@dataclass(frozen=True)
class TorsionSpringDamper(ForceElement):
    """A torsional spring and damper about the axis of a joint that turns.

    The torque on the joint's second body, about the axis by the right hand, is
    -(stiffness (angle - free_angle) + damping times the angle's rate). A curve adds its torque at
    the deflection angle - free_angle.

    Attributes:
        joint: name; its angle is zero at design.
        stiffness: [N m/rad], zero or more.
        damping: [N m s/rad], zero or more.
        free_angle: [rad].
        curve: torque over deflection [rad, N m]; none by default.
    """

    type: ClassVar[str] = "torsion_spring_damper"
    joint: str
    stiffness: float = quantity(TURNING_STIFFNESS, default=0.0)
    damping: float = quantity(TURNING_DAMPING, default=0.0)
    free_angle: float = quantity(ANGLE, default=0.0)
    curve: tuple[tuple[float, float], ...] | None = curve(ANGLE, TORQUE)

    def __post_init__(self) -> None:
        self._numbers()
        self._curve()


@dataclass(frozen=True)
class Force(ForceElement):
    """A constant force on a point of a body.

    Attributes:
        body: name of the body that it acts on.
        point: of the body, global at design [m].
        vector: [N], global axes; at design if it turns with the body.
        frame: "global" for a constant direction, "body" for one that turns with the body.
    """

    type: ClassVar[str] = "force"
    body: str
    point: tuple[float, float, float] = position()
    vector: tuple[float, float, float] = quantity(FORCE)
    frame: Axes = Axes.GLOBAL

    def __post_init__(self) -> None:
        self._vector("point", Kind.POSITION.value)
        self._vector("vector", "a force [x, y, z]")
        object.__setattr__(self, "frame", Axes.of(str(self), self.frame))

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies that it acts on."""
        return (self.body,)


@dataclass(frozen=True)
class Torque(ForceElement):
    """A constant torque on a body.

    Attributes:
        body: name of the body that it acts on.
        vector: [N m], global axes; at design if it turns with the body.
        frame: "global" for a constant direction, "body" for one that turns with the body.
    """

    type: ClassVar[str] = "torque"
    body: str
    vector: tuple[float, float, float] = quantity(TORQUE)
    frame: Axes = Axes.GLOBAL

    def __post_init__(self) -> None:
        self._vector("vector", "a torque [x, y, z]")
        object.__setattr__(self, "frame", Axes.of(str(self), self.frame))

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies that it acts on."""
        return (self.body,)


class Law(StrEnum):
    """The law of a bushing's torque: the gradient of an energy in three angles.

    To first order both are equal. `EULER_PARAMETERS`: twice the vector part of the relative Euler
    parameters. `CARDAN`: the angles of turns about x, then y, then z of the turned axes, as of
    OpenSim's BushingForce.
    """

    EULER_PARAMETERS = "euler_parameters"
    CARDAN = "cardan"


@dataclass(frozen=True)
class Bushing(ForceElement):
    """A block of rubber between two bodies: springs and dampers along and about three axes.

    The axes are fixed in the first body, which carries the element. A displacement is that of the
    second body's point from the first body's, along these axes. The force acts at the second body's
    point, on the first body in the sense of the displacement.

    Attributes:
        i, j: first and second body.
        point: of both bodies, global at design [m].
        axes: first and second axis, global at design, perpendicular; the third follows by the right
            hand. Global axes unless given.
        stiffness: along the axes [N/m], zero or more; one number serves all.
        turning_stiffness: about the axes [N m/rad].
        damping: along the axes [N s/m].
        turning_damping: about the axes [N m s/rad].
        preload: force along the axes at design on the first body [N].
        curve: force over displacement [m, N], for all axes, or one for each; an axis with an empty
            one has none. It adds to the stiffness.
        law: law of the torque.
        joint: the joint in the bushing's place in rigid studies; empty without one.
    """

    type: ClassVar[str] = "bushing"
    i: str
    j: str
    point: tuple[float, float, float] = position()
    axes: tuple[tuple[float, float, float], tuple[float, float, float]] = (
        (1.0, 0.0, 0.0),
        (0.0, 1.0, 0.0),
    )
    stiffness: tuple[float, float, float] = quantity(STIFFNESS, default=(0.0, 0.0, 0.0))
    turning_stiffness: tuple[float, float, float] = quantity(
        TURNING_STIFFNESS, default=(0.0, 0.0, 0.0)
    )
    damping: tuple[float, float, float] = quantity(DAMPING, default=(0.0, 0.0, 0.0))
    turning_damping: tuple[float, float, float] = quantity(TURNING_DAMPING, default=(0.0, 0.0, 0.0))
    preload: tuple[float, float, float] = quantity(FORCE, default=(0.0, 0.0, 0.0))
    curve: tuple[tuple[tuple[float, float], ...], ...] | None = curve(LENGTH, FORCE)
    law: Law = Law.EULER_PARAMETERS
    joint: str = field(default="", metadata={"hidden": True})

    def __post_init__(self) -> None:
        if self.i == self.j:
            raise MechanismError(
                f"{self}: both sides are on {self.i!r}; a bushing needs two different bodies",
                self._key("bodies"),
            )
        self._vector("point", Kind.POSITION.value)
        self._axes()
        for each in fields(self):
            if (dimension := dimension_of(each)) is not None:
                self._three(each.name, dimension)
        self._curves()
        try:
            object.__setattr__(self, "law", Law(self.law))
        except ValueError:
            raise MechanismError(
                f"{self}: law is {self.law!r}, expected one of {', '.join(Law)}", self._key("law")
            ) from None
        if not any((*self.stiffness, *self.turning_stiffness, *self.damping, *self.preload)) and (
            self.curve is None and not any(self.turning_damping)
        ):
            raise MechanismError(
                f"{self}: it has no stiffness; give stiffness, turning_stiffness or a curve",
                self._key("stiffness"),
            )

    def _key(self, what: str) -> str:
        if not self.joint:
            return super()._key(what)
        own = self.name.removeprefix(f"{self.joint}.")
        return f"joints.{self.joint}.bushings.{own}.{what}"

    def _axes(self) -> None:
        who = f"{self}: axes"
        expected = "two directions [[x, y, z], [x, y, z]] at right angles"
        pair = [
            finite_numbers(who, each, 3, expected) for each in held(who, self.axes, 2, expected)
        ]
        for each in pair:
            require_direction(who, each)
        given = [math.hypot(*each) for each in pair]
        first, second = (unit(each) for each in pair)
        off = first @ second
        if max(abs(off), *(abs(each - 1.0) for each in given)) <= ROUND_OFF:
            object.__setattr__(self, "axes", tuple(pair))
            return
        if abs(off) > PERPENDICULAR:
            raise MechanismError(
                f"{who} are {math.degrees(math.acos(off)):.6g} degrees apart, expected 90; give"
                " perpendicular ones",
                self._key("axes"),
            )
        # what the digits of the file leave of the first axis is taken out of the second
        second = unit([*(second - off * first)])
        object.__setattr__(self, "axes", (tuple(first), tuple(second)))

    def _three(self, what: str, dimension: Dimension) -> None:
        given = plain(getattr(self, what))
        values = (given,) * 3 if finite(given) else given
        values = held(f"{self}: {what}", values, 3, f"a number of {dimension}, or three")
        more = None if what == "preload" else ", zero or more (a falling force needs a curve)"
        found = tuple(self._number(what, value, dimension, more) for value in values)
        object.__setattr__(self, what, found)

    def _curves(self) -> None:
        if self.curve is None:
            return
        who, key = f"{self}: curve", self._key("curve")
        given = held(who, self.curve, None, "a table, or one for each axis")
        one = all(
            len(row) == 2 and all(map(finite, row)) for row in given if hasattr(row, "__len__")
        )
        tables = (given,) * 3 if one and any(len(row) for row in given) else given
        tables = held(who, tables, 3, "a table [[displacement, force], ...], or one for each axis")
        found = tuple(checked_curve(who, key, each) if len(each) else () for each in tables)
        object.__setattr__(self, "curve", found)

    @property
    def bodies(self) -> tuple[str, str]:
        """Names of the bodies that it acts on."""
        return self.i, self.j

    @property
    def triad(
        self,
    ) -> tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]:
        """The three axes, global unit vectors at design [-]."""
        (a, b, c), (d, e, f) = self.axes
        return (*self.axes, (b * f - c * e, c * d - a * f, a * e - b * d))

    @property
    def turns_only(self) -> bool:
        """Whether it gives no force, and so its amount is a torque."""
        return not any((*self.stiffness, *self.damping, *self.preload, self.curve))


ELEMENTS: dict[str, type[ForceElement]] = {
    each.type: each for each in (SpringDamper, TorsionSpringDamper, Bushing, Force, Torque)
}
"""Force elements by their type in case files."""
