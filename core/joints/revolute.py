"""Revolute joint: spherical + dot11, eq. (26). 5 rows, 1 freedom. Also known as hinge or pin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import vec
from .base import Attachment, AxialJoint, triad


@dataclass(frozen=True)
class Revolute(AxialJoint):
    """Both bodies share the point and the axis and turn about it."""

    type = "revolute"
    freedoms = ("rotation",)

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P = vec(self.point)
        return p.Spherical(i.arm(P), j.arm(P)), p.Dot11(*triad(self.axis))
