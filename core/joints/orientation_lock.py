"""Orientation lock: dot12. 3 rows, 3 freedoms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from .base import Attachment, Joint


@dataclass(frozen=True)
class OrientationLock(Joint):
    """Both bodies turn alike and shift freely."""

    type = "orientation_lock"
    freedoms = ("translation x", "translation y", "translation z")

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        return (p.Dot12(),)
