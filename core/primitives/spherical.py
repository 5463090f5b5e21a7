"""Spherical: the points P_i and P_j coincide (3 rows).  Paper sec. 2.2.7, eq. (24).

With d = d0 + u_j + A_j s_j - u_i - A_i s_i from P_i to P_j, written as the change since design so
that nothing large cancels:

    (24)  phi   = d0 + (u_j + (A_j - I) s_j) - (u_i + (A_i - I) s_i)
          rows  = [ -I | skew(A_i s_i) | I | -skew(A_j s_j) ]        exact everywhere
          gamma = w_i x (w_i x A_i s_i) - w_j x (w_j x A_j s_j)
"""

from __future__ import annotations

from dataclasses import dataclass

from ..algebra import ZERO, Scalar, Vec3
from .base import Pose, Primitive


@dataclass(frozen=True)
class Spherical(Primitive):
    """s_i, s_j: arms from the body origins to P_i and P_j [m]; d0: from P_i to P_j at design."""

    n = 3
    steady = True
    s_i: Vec3
    s_j: Vec3
    d0: Vec3 = ZERO

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return tuple(self.d0 + ((j.u - i.u) + (j.swing(self.s_j) - i.swing(self.s_i))))
