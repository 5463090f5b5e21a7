"""Constant-velocity joint: spherical + constant velocity. 4 rows, 2 freedoms. Also known as Rzeppa
or homokinetic joint.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import primitives as p
from ..algebra import Vec3, cross, vec
from ..errors import MechanismError
from ..failures import FailureKind
from .base import Attachment, Joint, directions, position, triad, unit


@dataclass(frozen=True)
class ConstantVelocity(Joint):
    """Two shafts meet in the point, along an axis each and pointing the same way on; both turn at
    the same rate about them.
    """

    type = "constant_velocity"
    freedoms = ("bend x", "bend y")
    point: tuple[float, float, float] = position()
    axes: tuple[tuple[float, float, float], tuple[float, float, float]] = directions()

    def __post_init__(self) -> None:
        super().__post_init__()
        cosine = unit(self.axes[0]) @ unit(self.axes[1])
        # beyond a right angle no such joint transmits, and at 180 degrees it has no zero twist
        if cosine <= 0.0:
            raise MechanismError(
                f"{self}: the cosine of the angle between its axes is {cosine:.3g}, expected a"
                " positive one; let both point from the driving to the driven side",
                kind=FailureKind.WRONG_ANGLE,
            )

    def primitives(self, i: Attachment, j: Attachment) -> Sequence[p.Primitive]:
        P, (f, g, h) = vec(self.point), triad(self.axes[0])
        k = unit(self.axes[1])
        twistless = (_carry(f, h, k), _carry(g, h, k))
        return p.Spherical(i.arm(P), j.arm(P)), p.ConstantVelocity(f, g, *twistless)


def _carry(a: Vec3, h: Vec3, k: Vec3) -> Vec3:
    """a turned by the shortest rotation that takes h to k (Rodrigues)."""
    n = cross(h, k)
    return a + cross(n, a) + (1.0 / (1.0 + h @ k)) * cross(n, cross(n, a))
