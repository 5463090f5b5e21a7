"""Distance joint: a point of each body keeps its distance. 1 row, 5 freedoms. Also known as tie rod
or massless link.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import root, vec
from ..errors import MechanismError, Phrase
from ..failures import FailureKind
from .base import Attachment, Joint, length, positions

# A length that differs from the design distance by less, relatively, moves no output beyond its
# tolerance, unless one is given.
NOTED = 1e-9


@dataclass(frozen=True)
class Distance(Joint):
    """A rod from a point on body i to a point on body j; its length is the design distance unless
    given [m].
    """

    type = "distance"
    freedoms = ()
    points: tuple[tuple[float, float, float], tuple[float, float, float]] = positions()
    length: float | None = length(default=None)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.design_distance > 0.0:
            raise MechanismError(
                f"{self}: the points coincide at design, expected two places; use a spherical"
                " joint",
                kind=FailureKind.NO_LENGTH,
            )
        if not self.rod_length > 0.0:
            raise MechanismError(
                Phrase(
                    f"{self}: length is ",
                    self.rod_length,
                    ", expected a positive one; the points are ",
                    self.design_distance,
                    " apart at design, which is the length where none is given",
                ),
                kind=FailureKind.NO_LENGTH,
            )

    @property
    def design_distance(self) -> float:
        """Distance of the points at design [m]."""
        along = vec(self.points[1]) - vec(self.points[0])
        return root(along @ along)

    @property
    def rod_length(self) -> float:
        """The length the joint keeps [m]."""
        return self.design_distance if self.length is None else self.length

    @property
    def notes(self) -> Sequence[str | Phrase]:
        found, apart = self.rod_length, self.design_distance
        if abs(found - apart) <= NOTED * apart:
            return ()
        how = "assembled from there, so the design position is another than the given one"
        return (Phrase(f"{self}: length ", found, ", points ", apart, f" apart at design: {how}"),)

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P_i, P_j = (vec(point) for point in self.points)
        d0 = P_j - P_i
        design_length = root(d0 @ d0)
        L = design_length if self.length is None else self.length
        return (p.Distance(i.arm(P_i), j.arm(P_j), d0, L, design_length),)
