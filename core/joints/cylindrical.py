"""Cylindrical joint: dot11 + two dot20. 4 rows, 2 freedoms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import ZERO, vec
from .base import Attachment, AxialJoint, triad


@dataclass(frozen=True)
class Cylindrical(AxialJoint):
    """Both bodies share the axis, turn about it and slide along it."""

    type = "cylindrical"
    freedoms = ("rotation", "translation")

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P, (f, g, h) = vec(self.point), triad(self.axis)
        # two exact dot20, not dot21: that one needs dot12 in the same joint
        return (
            p.Dot11(f, g, h),
            p.Dot20(f, i.arm(P), j.arm(P), ZERO),
            p.Dot20(g, i.arm(P), j.arm(P), ZERO),
        )
