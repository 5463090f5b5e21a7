"""Universal joint: spherical + dot10. 4 rows, 2 freedoms. Also known as Hooke's or Cardan joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import vec
from ..errors import MechanismError
from .base import Attachment, Joint, directions, position, unit

# Hardpoint tables carry three digits or more, so rounding tilts an axis by less than this; more is a mistake in the table.
# Within it the cross keeps its design angle, as the two hinges of a simulator do.
ROUNDED_RIGHT_ANGLE = 1e-2


@dataclass(frozen=True)
class Universal(Joint):
    """Both bodies share the point; the first axis, on body i, stays perpendicular to the second, on body j."""

    type = "universal"
    freedoms = ("rotation i", "rotation j")
    point: tuple[float, float, float] = position()
    axes: tuple[tuple[float, float, float], tuple[float, float, float]] = directions()

    def __post_init__(self) -> None:
        super().__post_init__()
        cosine = unit(self.axes[0]) @ unit(self.axes[1])
        if abs(cosine) > ROUNDED_RIGHT_ANGLE:
            raise MechanismError(
                f"{self}: the axes are not perpendicular, the cosine of their angle is {cosine:.3g}; "
                "expected 0 up to rounding of the table; give the two axes of the cross"
            )

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P = vec(self.point)
        return p.Spherical(i.arm(P), j.arm(P)), p.Dot10(unit(self.axes[0]), unit(self.axes[1]))
