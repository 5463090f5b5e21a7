"""Force elements of a mechanism, as data.

All vectors are in global axes at the design position, SI units. A load that turns with its body
says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from enum import StrEnum
from typing import Any, ClassVar, Self, cast

from ..errors import MechanismError, Phrase
from ..input_checks import finite, held, plain, require_finite, triple
from ..joints.base import Joint, Kind, position, positions
from .body import (
    ANGLE,
    DAMPING,
    FORCE,
    LENGTH,
    STIFFNESS,
    TORQUE,
    TURNING_DAMPING,
    TURNING_STIFFNESS,
    dimension_of,
    quantity,
)


class Axes(StrEnum):
    """The axes in which a force or torque is constant."""

    GLOBAL = "global"
    BODY = "body"

    @classmethod
    def named(cls, who: str, name: Any) -> Axes:
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
            if (dimension := dimension_of(each)) is not None:
                numbers = cast("tuple[float, ...]", value if isinstance(value, tuple) else (value,))
                new = tuple(dimension.in_kg_and_s(x, unit) for x in numbers)
                changes[each.name] = new if isinstance(value, tuple) else new[0]
            elif (kind := each.metadata.get("kind")) is not None:
                changes[each.name] = tuple(map(place, value)) if kind.pair else place(value)
        return replace(self, **changes)

    def _key(self, what: str) -> str:
        return f"forces.{self.name}.{what}"

    def _numbers(self) -> None:
        """Make the quantities finite numbers, of zero or more unless they are angles."""
        for each in fields(self):
            if (dimension := dimension_of(each)) is None:
                continue
            value, signed = plain(getattr(self, each.name)), dimension is ANGLE
            if not finite(value) or (value < 0.0 and not signed):
                more = "" if signed else ", zero or more"
                raise MechanismError(
                    f"{self}: {each.name} is {value!r}, expected a number of {dimension}{more}",
                    self._key(each.name),
                )
            object.__setattr__(self, each.name, float(value))

    def _vector(self, what: str, kind: str) -> None:
        who = f"{self}: {what}"
        object.__setattr__(self, what, triple(who, getattr(self, what), kind))
        require_finite(who, getattr(self, what), kind)


@dataclass(frozen=True)
class SpringDamper(ForceElement):
    """A spring and a damper between a point of each of two bodies, tension positive.

    The tension is stiffness (length - free_length) + damping times the rate of the length.

    Attributes:
        i, j: first and second body.
        points: on the first and on the second body, global at design [m].
        stiffness: [N/m], zero or more.
        damping: [N s/m], zero or more.
        free_length: [m], zero or more; the length at design unless given.
    """

    type: ClassVar[str] = "spring_damper"
    i: str
    j: str
    points: tuple[tuple[float, float, float], tuple[float, float, float]] = positions()
    stiffness: float = quantity(STIFFNESS)
    damping: float = quantity(DAMPING, default=0.0)
    free_length: float | None = quantity(LENGTH, default=None)

    def __post_init__(self) -> None:
        who = f"{self}: points"
        pair = held(who, self.points, 2, Kind.POSITIONS.value)
        points = tuple(triple(who, each, Kind.POSITIONS.value) for each in pair)
        for each in points:
            require_finite(who, each, Kind.POSITIONS.value)
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

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies that it acts on."""
        return self.i, self.j


@dataclass(frozen=True)
class TorsionSpringDamper(ForceElement):
    """A torsional spring and damper about the axis of a joint that turns.

    The torque on the joint's second body, about the axis by the right hand, is
    -(stiffness (angle - free_angle) + damping times the angle's rate).

    Attributes:
        joint: name; its angle is zero at design.
        stiffness: [N m/rad], zero or more.
        damping: [N m s/rad], zero or more.
        free_angle: [rad].
    """

    type: ClassVar[str] = "torsion_spring_damper"
    joint: str
    stiffness: float = quantity(TURNING_STIFFNESS)
    damping: float = quantity(TURNING_DAMPING, default=0.0)
    free_angle: float = quantity(ANGLE, default=0.0)

    def __post_init__(self) -> None:
        self._numbers()

    def check(self, joint: Joint) -> None:
        """Raise MechanismError unless the joint turns about an axis."""
        if "rotation" not in joint.freedoms:
            raise MechanismError(
                f"{self}: joint {joint.name!r} is {joint.type} and has no rotation; its freedoms:"
                f" {', '.join(joint.freedoms) or 'none'}",
                self._key("joint"),
            )


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
        object.__setattr__(self, "frame", Axes.named(str(self), self.frame))

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
        object.__setattr__(self, "frame", Axes.named(str(self), self.frame))

    @property
    def bodies(self) -> tuple[str, ...]:
        """Names of the bodies that it acts on."""
        return (self.body,)


ELEMENTS: dict[str, type[ForceElement]] = {
    each.type: each for each in (SpringDamper, TorsionSpringDamper, Force, Torque)
}
"""Force elements by their type in case files."""
