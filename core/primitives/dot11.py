"""Dot11: the axis h_j is parallel to h_i (2 rows).  Paper sec. 2.2.3, eqs (13)-(16); Table 1.

f, g, h are right-handed and unit; at design the frames of both bodies coincide. In global axes:

    (13)  phi   = [ g_i . h_j,  f_i . h_j ]
    (14)  rows  = [ 0 | f_i | 0 | -f_i ], [ 0 | -g_i | 0 | g_i ]
    (16)  gamma = [ -s (g_i . w_i),  -s (f_i . w_i) ],      s = h . (w_j - w_i)

(14) puts h_i for h_j in g_i x h_j = f_i and f_i x h_j = -g_i: exact where phi = 0 on the branch h_j
= +h_i, and of the order of the misalignment off it, so Newton stays quadratic and reaches +h_i from
any misalignment below 180 degrees; with the exact rows it fails beyond 67 degrees (90 with the
update used here). h_j = -h_i also solves (13); there the rows have the wrong sign, the branch test
names it. The printed (16) has three wrong signs (formulation section 9).
"""

from __future__ import annotations

from dataclasses import dataclass

from ..algebra import ZERO, Scalar, Vec3
from .base import Pose, Primitive, Row, Twist


@dataclass(frozen=True)
class Dot11(Primitive):
    """f, g, h: right-handed orthonormal frame at design, h the common axis [-]."""

    n = 2
    f: Vec3
    g: Vec3
    h: Vec3

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        dh = j.swing(self.h)
        # a . h is zero at design for a = g, f; only what changed since is summed
        return tuple(i.swing(a) @ (self.h + dh) + a @ dh for a in (self.g, self.f))

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        f, g = i.turn(self.f), i.turn(self.g)
        return Row(ZERO, f, ZERO, -f), Row(ZERO, -g, ZERO, g)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        s = j.turn(self.h) @ (vj.w - vi.w)
        return -(s * (i.turn(self.g) @ vi.w)), -(s * (i.turn(self.f) @ vi.w))

    def branch(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (i.turn(self.h) @ j.turn(self.h),)
