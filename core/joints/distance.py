"""Distance joint: a point of each body keeps its distance. 1 row, 5 freedoms. Also known as tie rod or massless link."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import root, vec
from ..errors import MechanismError
from .base import Attachment, Joint, length, positions


@dataclass(frozen=True)
class Distance(Joint):
    """A rod from a point on body i to a point on body j; its length is the design distance unless given [m]."""

    type = "distance"
    freedoms = ()
    points: tuple[tuple[float, float, float], tuple[float, float, float]] = positions()
    length: float | None = length(default=None)

    def __post_init__(self) -> None:
        super().__post_init__()
        found = self.rod_length
        if not (found > 0.0 and self.design_distance > 0.0):
            raise MechanismError(
                f"{self}: length {found:.6g} m between points {self.design_distance:.6g} m apart at design, expected both "
                "positive; for points that coincide use a spherical joint"
            )

    @property
    def design_distance(self) -> float:
        """Distance of the points at design [m]."""
        return math.dist(*self.points)

    @property
    def rod_length(self) -> float:
        """The length the joint keeps [m]."""
        return self.design_distance if self.length is None else self.length

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P_i, P_j = (vec(point) for point in self.points)
        d0 = P_j - P_i
        design_length = root(d0 @ d0)
        L = design_length if self.length is None else self.length
        return (p.Distance(i.arm(P_i), j.arm(P_j), d0, L, design_length),)
