"""A joint unknown to every engine, without a chain of known joints in its place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ... import primitives as p
from ...algebra import ZERO, vec
from ...joints import Attachment, Joint
from ...joints.base import directions, position, require_perpendicular, unit


@dataclass(frozen=True)
class UnknownJoint(Joint):
    """The point of body j stays in the plane through it normal to the first axis, on body i, and
    the second axis, on body j, stays perpendicular to the first.
    """

    freedoms = ("translation x", "translation y", "rotation i", "rotation j")
    symmetric = False
    point: tuple[float, float, float] = position()
    axes: tuple[tuple[float, float, float], tuple[float, float, float]] = directions()

    def __post_init__(self) -> None:
        super().__post_init__()
        require_perpendicular(self, self.axes)

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        point, (normal, along) = vec(self.point), map(unit, self.axes)
        return p.Dot20(normal, i.arm(point), j.arm(point), ZERO), p.Dot10(normal, along)


UnknownJoint.type = "unknown_to_engines"  # set here, so that it is not registered for case files
