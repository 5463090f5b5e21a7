"""In-plane joint: dot20. 1 row, 5 freedoms. Also known as point on plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import ZERO, vec
from .base import Attachment, Joint, direction, position, unit


@dataclass(frozen=True)
class InPlane(Joint):
    """The point of body j stays in the plane through it normal to the axis of body i."""

    type = "in_plane"
    freedoms = ("translation x", "translation y", "rotation x", "rotation y", "rotation z")
    symmetric = False
    point: tuple[float, float, float] = position()
    axis: tuple[float, float, float] = direction()

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P = vec(self.point)
        return (p.Dot20(unit(self.axis), i.arm(P), j.arm(P), ZERO),)
