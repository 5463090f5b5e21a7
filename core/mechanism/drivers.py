"""Drivers of a mechanism. Each adds one equation  Phi(q) - c(t) = 0  per driven coordinate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from ..errors import MechanismError
from ..input_checks import require_direction, require_finite, triple
from ..joints.base import Joint, Kind


@dataclass(frozen=True)
class Driver:
    """Base of the drivers. Values are in radians if it turns, else in metres."""

    type: ClassVar[str]
    turns: ClassVar[bool] = False
    name: str


@dataclass(frozen=True)
class PointCoordinate(Driver):
    """Drives the coordinate of a point along a fixed global direction.

    Attributes:
        point: name of the driven point.
        direction: global direction, any length but zero [-].
        relative: the value is the change from the design position (default), else the coordinate
            itself [m]; see `Mechanism.design_value`.
    """

    type: ClassVar[str] = "point_coordinate"
    point: str
    direction: tuple[float, float, float]
    relative: bool = True

    def __post_init__(self) -> None:
        who = f"driver {self.name!r}: direction"
        object.__setattr__(self, "direction", triple(who, self.direction, Kind.DIRECTION.value))
        require_finite(who, self.direction, Kind.DIRECTION.value)
        require_direction(who, self.direction)


@dataclass(frozen=True)
class JointDriver(Driver):
    """Base of the drivers of a joint's own freedom: second body relative to first, zero at
    design.
    """

    freedom: ClassVar[str]
    joint: str
    relative: bool = True

    def check(self, joint: Joint) -> None:
        """Raise MechanismError unless the joint has the freedom this driver drives."""
        if self.freedom not in joint.freedoms:
            raise MechanismError(
                f"driver {self.name!r} ({self.type}): joint {joint.name!r} is {joint.type} and has"
                f" no {self.freedom} to drive; its freedoms: {', '.join(joint.freedoms) or 'none'}",
                f"drivers.{self.name}.joint",
            )


@dataclass(frozen=True)
class JointAngle(JointDriver):
    """Drives the rotation of a joint's second body relative to its first, about the axis by the
    right hand [rad].
    """

    type: ClassVar[str] = "joint_angle"
    turns: ClassVar[bool] = True
    freedom: ClassVar[str] = "rotation"


@dataclass(frozen=True)
class JointDisplacement(JointDriver):
    """Drives the displacement of a joint's second body relative to its first, along the axis
    [m].
    """

    type: ClassVar[str] = "joint_displacement"
    freedom: ClassVar[str] = "translation"
