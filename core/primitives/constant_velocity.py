"""Constant velocity: two shafts turn at the same rate at any angle (1 row).  Formulation section 2.

With f_i, g_i across shaft i and f_j, g_j across shaft j, the twist between the shafts vanishes:

    phi   = f_i . g_j - g_i . f_j          the difference of two dot10
    rows, gamma                            the same difference of theirs, exact everywhere

phi is -4 e0 e3 of the relative Euler parameters: besides the zero twist e3 = 0 it is zero at
e0 = 0, a relative turn of 180 degrees. The branch test is

    f_i . f_j + g_i . g_j = 2 (e0^2 - e3^2),

with zero twist 1 + cos(bend): positive up to the fold of the shafts, where both zeros meet; not
positive on the other branch. (The trace of the relative rotation is positive up to 120 degrees
only.)
"""

from __future__ import annotations

from dataclasses import dataclass

from ..algebra import Scalar, Vec3
from .base import Pose, Primitive
from .dot10 import Dot10


@dataclass(frozen=True)
class ConstantVelocity(Primitive):
    """f_i, g_i on body i and f_j, g_j on body j: across the shafts, unit, zero twist at design
    [-].
    """

    n = 1
    f_i: Vec3
    g_i: Vec3
    f_j: Vec3
    g_j: Vec3

    @property
    def pair(self) -> tuple[Dot10, Dot10]:
        """The two dot10 that are subtracted."""
        return Dot10(self.f_i, self.g_j), Dot10(self.g_i, self.f_j)

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        (plus,), (minus,) = (dot.phi(i, j) for dot in self.pair)
        return (plus - minus,)

    def branch(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        f, g = (i.turn(a) @ j.turn(b) for a, b in ((self.f_i, self.f_j), (self.g_i, self.g_j)))
        return (f + g,)
