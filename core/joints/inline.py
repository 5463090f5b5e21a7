"""Inline joint: two dot20. 2 rows, 4 freedoms. Also known as point on line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import ZERO, vec
from .base import Attachment, Joint, direction, position, triad


@dataclass(frozen=True)
class Inline(Joint):
    """The point, fixed in body j, stays on the line through it along the axis, fixed in body i."""

    type = "inline"
    freedoms = ("slide", "rotation x", "rotation y", "rotation z")
    symmetric = False
    point: tuple[float, float, float] = position()
    axis: tuple[float, float, float] = direction()

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P, (f, g, _) = vec(self.point), triad(self.axis)
        return tuple(p.Dot20(a, i.arm(P), j.arm(P), ZERO) for a in (f, g))
