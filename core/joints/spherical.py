"""Spherical joint: a point of each body coincides, eq. (25). 3 rows, 3 freedoms. Also known as ball
joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import vec
from .base import Attachment, Joint, position


@dataclass(frozen=True)
class Spherical(Joint):
    """Both bodies share the point."""

    type = "spherical"
    freedoms = ("rotation x", "rotation y", "rotation z")
    point: tuple[float, float, float] = position()

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P = vec(self.point)
        return (p.Spherical(i.arm(P), j.arm(P)),)
