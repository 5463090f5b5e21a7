"""Planar joint: dot11 + dot20. 3 rows, 3 freedoms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import ZERO, vec
from .base import Attachment, Joint, direction, position, triad


@dataclass(frozen=True)
class Planar(Joint):
    """A plane of each body, through the point and normal to the axis, slides on the other's."""

    type = "planar"
    freedoms = ("translation x", "translation y", "turn about the normal")
    point: tuple[float, float, float] = position()
    axis: tuple[float, float, float] = direction()

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P, (f, g, h) = vec(self.point), triad(self.axis)
        return p.Dot11(f, g, h), p.Dot20(h, i.arm(P), j.arm(P), ZERO)
