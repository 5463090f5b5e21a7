"""Revolute-spherical joint: distance + dot20, a massless link. 2 rows, 4 freedoms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import root, vec
from ..errors import MechanismError
from ..failures import FailureKind
from .base import Attachment, Joint, direction, positions, unit


@dataclass(frozen=True)
class RevoluteSpherical(Joint):
    """A link from a hinge on body i, about the axis, to a ball on body j; its length is that at
    design.
    """

    type = "revolute_spherical"
    freedoms = ("turn of the link", "rotation x", "rotation y", "rotation z")
    symmetric = False
    points: tuple[tuple[float, float, float], tuple[float, float, float]] = positions()
    axis: tuple[float, float, float] = direction()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.points[0] == self.points[1]:
            raise MechanismError(
                f"{self}: the link has length 0, expected two different points; for a link of no"
                " length use inline",
                kind=FailureKind.NO_LENGTH,
            )

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P_i, P_j = (vec(point) for point in self.points)
        d0 = P_j - P_i
        L = root(d0 @ d0)
        return p.Distance(i.arm(P_i), j.arm(P_j), d0, L, L), p.Dot20(
            unit(self.axis), i.arm(P_i), j.arm(P_j), d0
        )
