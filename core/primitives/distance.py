"""Distance: P_i and P_j keep the distance L, the tie rod (1 row).  Formulation section 2.

With d from P_i to P_j, dd its change since design, S = A s:

    phi   = (d . d - L^2) / (2 L) = ( dd . (2 d0 + dd) + (L0 - L)(L0 + L) ) / (2 L),      L0 = |d0|
    rows  = [ -d | d x S_i | d | S_j x d ] / L
    gamma = -( ddot . ddot + d . (w_j x (w_j x S_j) - w_i x (w_i x S_i)) ) / L

This is the square form d . d - L^2 divided by 2 L: rows of unit scale and a residual in metres, as
|d| - L has them, without a square root, and the difference of squares is never formed. The bare
square form was rejected because its rows have the size of d; |d| - L because it is not smooth where
the points meet.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..algebra import Scalar, Vec3
from .base import Pose, Primitive


@dataclass(frozen=True)
class Distance(Primitive):
    """Arms s_i, s_j [m]; d0 from P_i to P_j at design [m]; the length L and the design length L0
    [m], both positive.
    """

    n = 1
    s_i: Vec3
    s_j: Vec3
    d0: Vec3
    length: Scalar
    design_length: Scalar

    def change(self, i: Pose, j: Pose) -> Vec3:
        """Return the change of d since design."""
        return (j.u - i.u) + (j.swing(self.s_j) - i.swing(self.s_i))

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        dd, L, L0 = self.change(i, j), self.length, self.design_length
        return ((dd @ (2.0 * self.d0 + dd) + (L0 - L) * (L0 + L)) * (0.5 / L),)
