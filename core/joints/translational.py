"""Translational joint: dot12 + dot21, eq. (27). 5 rows, 1 freedom. Also known as prismatic joint or
slider.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import vec
from .base import Attachment, AxialJoint, triad


@dataclass(frozen=True)
class Translational(AxialJoint):
    """Both bodies turn alike, and slide along the axis through the point."""

    type = "translational"
    freedoms = ("translation",)

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P, (f, g, _) = vec(self.point), triad(self.axis)
        return p.Dot12(), p.Dot21(f, g, i.arm(P) - j.arm(P))
