"""Dot10: the angle between a on body i and b on body j is constant (1 row).

Paper sec. 2.2.2, eqs (8)-(12); Table 1.

In global axes, with a = A_i a0, b = A_j b0 and n = a x b:

    (8)   phi   = a . b - c                 expanded about design, where a0 . b0 = c
    (11)  rows  = [ 0 | n | 0 | -n ]        exact everywhere; one vector product serves both bodies
    (12)  gamma = ndot . (w_j - w_i),       ndot = (w_i x a) x b + a x (w_j x b)

The printed (9)-(12) and Table 1 carry wrong indices and lost factors (formulation section 9); (12)
here is the derivative of (11), which needs no matrix product.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..algebra import Scalar, Vec3
from .base import Pose, Primitive


@dataclass(frozen=True)
class Dot10(Primitive):
    """a on body i, b on body j, unit vectors [-]; the cosine of their angle keeps its design
    value.
    """

    n = 1
    a: Vec3
    b: Vec3

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        da, db = i.swing(self.a), j.swing(self.b)
        return (da @ (self.b + db) + self.a @ db,)
