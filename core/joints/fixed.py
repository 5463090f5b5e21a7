"""Fixed joint: spherical + dot12. 6 rows, no freedom. Also known as weld."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import vec
from .base import Attachment, Joint, position


@dataclass(frozen=True)
class Fixed(Joint):
    """Both bodies move as one. The point may be left out: any point serves."""

    type = "fixed"
    freedoms = ()
    point: tuple[float, float, float] | None = position(default=None)

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P = j.origin if self.point is None else vec(self.point)
        return p.Spherical(i.arm(P), j.arm(P)), p.Dot12()
