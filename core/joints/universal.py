"""Universal joint: spherical + dot10. 4 rows, 2 freedoms. Also known as Hooke's or Cardan joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import vec
from .base import Attachment, Joint, directions, position, require_perpendicular, unit


@dataclass(frozen=True)
class Universal(Joint):
    """Both bodies share the point; the first axis, on body i, stays perpendicular to the second, on
    body j.
    """

    type = "universal"
    freedoms = ("rotation i", "rotation j")
    point: tuple[float, float, float] = position()
    axes: tuple[tuple[float, float, float], tuple[float, float, float]] = directions()

    def __post_init__(self) -> None:
        super().__post_init__()
        require_perpendicular(self, self.axes)

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P = vec(self.point)
        return p.Spherical(i.arm(P), j.arm(P)), p.Dot10(unit(self.axes[0]), unit(self.axes[1]))
