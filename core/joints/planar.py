"""Planar joint: dot11 + dot20. 3 rows, 3 freedoms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import ZERO, vec
from .base import Attachment, AxialJoint, triad, unit


@dataclass(frozen=True)
class Planar(AxialJoint):
    """A plane of each body, through the point and normal to the axis, slides on the other and turns
    about the axis.
    """

    type = "planar"
    freedoms = ("translation x", "translation y", "rotation")

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P, (f, g, h) = vec(self.point), triad(self.axis)
        return p.Dot11(f, g, h), p.Dot20(h, i.arm(P), j.arm(P), ZERO)

    def mixed(self, i: Attachment, j: Attachment) -> Sequence[tuple[p.Primitive, str]]:
        # its translations have no names: nothing drives them
        P, h = vec(self.point), unit(self.axis)
        return (p.Dot20(h, i.arm(P), j.arm(P), ZERO), ""), (p.NamedTurn(h), "rotation")
