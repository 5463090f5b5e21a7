"""Measures of joints: the rotation about and the displacement along their axis."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from ...algebra import Vec3, triple, vec
from ...errors import MechanismError
from ...jet import Jet, arctan2
from ...joints.base import triad
from ...mechanism.mechanism import Mechanism, Point
from ..quantity import MARKER
from .base import Measure, length, reach_of


@dataclass(frozen=True)
class _JointCoordinate(Measure):
    freedom: ClassVar[str]

    joint: str

    def check(self, mechanism: Mechanism) -> None:
        """Raise MechanismError unless the joint exists and has the freedom."""
        super().check(mechanism)
        joint = mechanism.joint(self.joint)
        if self.freedom not in joint.freedoms:
            raise MechanismError(
                f"{joint} has no {self.freedom} to measure; its freedoms:"
                f" {', '.join(joint.freedoms) or 'none'}",
                f"outputs.{self.name}.joint",
            )

    def _marker(self, what: str) -> str:
        return f"{MARKER}joint {self.joint}: {what}"

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return the points it reads: of both bodies, on the joint's axis and beside it."""
        joint: Any = mechanism.joint(self.joint)
        f, g, h = triad(joint.axis)
        place, reach = vec(joint.point), reach_of(mechanism)
        tips = {
            "": place,
            " f": place + reach * f,
            " g": place + reach * g,
            " axis": place + reach * h,
        }
        every = [
            Point(self._marker(f"{which}{what}"), body, triple(tip))
            for which, body in (("first", joint.i), ("second", joint.j))
            for what, tip in tips.items()
        ]
        return [point for point in every if point.name in self.points]


@dataclass(frozen=True)
class JointAngle(_JointCoordinate):
    """Rotation of a joint's second body relative to its first, zero at design; turns count.

    If a study varies the axis, the measured axis stays nominal: the error is of second order.
    """

    type = "joint_angle"
    measure = "rad"
    positive = "second body about the axis, by the right-hand rule"
    freedom = "rotation"

    @property
    def points(self) -> tuple[str, ...]:
        """Two directions of the first body across the axis, and one of the second."""
        marked = ("first", "first f", "first g", "second", "second f")
        return tuple(map(self._marker, marked))

    @property
    def period(self) -> float:
        """A whole turn."""
        return 2.0 * math.pi

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the angle [rad], from -pi to pi."""
        first, f, g, second, turned = (at[name] for name in self.points)
        arm = turned - second
        return arctan2((g - first) @ arm, (f - first) @ arm)


@dataclass(frozen=True)
class JointDisplacement(_JointCoordinate):
    """Displacement of a joint's second body relative to its first along the axis, zero at design.

    If a study varies the axis, the measured axis stays nominal: the error is of second order.
    """

    type = "joint_displacement"
    measure = "m"
    positive = "second body along the axis"
    freedom = "translation"

    @property
    def points(self) -> tuple[str, ...]:
        """The axis on the first body, and the joint's point on the second."""
        return tuple(map(self._marker, ("first", "first axis", "second")))

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the displacement [m]."""
        first, tip, second = (at[name] for name in self.points)
        return ((tip - first) @ (second - first)) / length(design, *self.points[:2])
