"""Parallel axes: dot11. 2 rows, 4 freedoms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from .base import Attachment, Joint, direction, triad


@dataclass(frozen=True)
class ParallelAxes(Joint):
    """The axis keeps the same direction in both bodies."""

    type = "parallel_axes"
    freedoms = ("translation x", "translation y", "translation z", "turn about the axis")
    axis: tuple[float, float, float] = direction()

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        return (p.Dot11(*triad(self.axis)),)
