"""Perpendicular axes: dot10. 1 row, 5 freedoms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from .base import Attachment, Joint, directions, require_perpendicular, unit


@dataclass(frozen=True)
class PerpendicularAxes(Joint):
    """The first axis, on body i, stays perpendicular to the second, on body j."""

    type = "perpendicular_axes"
    freedoms = ("translation x", "translation y", "translation z", "rotation i", "rotation j")
    axes: tuple[tuple[float, float, float], tuple[float, float, float]] = directions()

    def __post_init__(self) -> None:
        super().__post_init__()
        require_perpendicular(self, self.axes)

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        return (p.Dot10(unit(self.axes[0]), unit(self.axes[1])),)
