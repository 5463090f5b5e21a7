"""Force elements of a mechanism, as data.

All vectors are in global axes at the design position, SI units. A load that turns with its body
says so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, ClassVar

from ..errors import MechanismError
from ..input_checks import finite, held, plain, require_finite, triple
from ..joints.base import Joint, Kind


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

    def _number(self, what: str, unit: str, *, signed: bool = False) -> None:
        """Make a field a finite number, of zero or more unless it has a sign."""
        value = plain(getattr(self, what))
        if not finite(value) or (value < 0.0 and not signed):
            more = "" if signed else ", zero or more"
            raise MechanismError(f"{self}: {what} is {value!r}, expected a number of {unit}{more}")
        object.__setattr__(self, what, float(value))

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
    points: tuple[tuple[float, float, float], tuple[float, float, float]]
    stiffness: float
    damping: float = 0.0
    free_length: float | None = None

    def __post_init__(self) -> None:
        who = f"{self}: points"
        pair = held(who, self.points, 2, Kind.POSITIONS.value)
        points = tuple(triple(who, each, Kind.POSITIONS.value) for each in pair)
        for each in points:
            require_finite(who, each, Kind.POSITIONS.value)
        object.__setattr__(self, "points", points)
        if self.i == self.j:
            raise MechanismError(
                f"{self}: both ends are on {self.i!r}; a spring needs two different bodies"
            )
        length = math.dist(*points)
        if length == 0.0:
            raise MechanismError(
                f"{self}: its points coincide at {[*points[0]]}, so that its force has no"
                " direction; give the two ends of the spring"
            )
        if self.free_length is None:
            object.__setattr__(self, "free_length", length)
        for what, unit in (
            ("stiffness", "N/m"),
            ("damping", "N s/m"),
            ("free_length", "m"),
        ):
            self._number(what, unit)

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
    stiffness: float
    damping: float = 0.0
    free_angle: float = 0.0

    def __post_init__(self) -> None:
        self._number("stiffness", "N m/rad")
        self._number("damping", "N m s/rad")
        self._number("free_angle", "rad", signed=True)

    def check(self, joint: Joint) -> None:
        """Raise MechanismError unless the joint turns about an axis."""
        if "rotation" not in joint.freedoms:
            raise MechanismError(
                f"{self}: joint {joint.name!r} is {joint.type} and has no rotation; its freedoms:"
                f" {', '.join(joint.freedoms) or 'none'}",
                f"forces.{self.name}.joint",
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
    point: tuple[float, float, float]
    vector: tuple[float, float, float]
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
    vector: tuple[float, float, float]
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
