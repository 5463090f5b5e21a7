"""Dot10: the angle between a on body i and b on body j is constant (1 row).

Paper sec. 2.2.2, eqs (8)-(12); Table 1.

In global axes, with a = A_i a0, b = A_j b0 and n = a x b:

    (8)   phi   = a . b - c                 expanded about design, where a0 . b0 = c
    (11)  rows  = [ 0 | n | 0 | -n ]        exact everywhere; one vector product serves both bodies
    (12)  gamma = ndot . (w_j - w_i),       ndot = (w_i x a) x b + a x (w_j x b)

The paper in body axes, with n = a x A_ij b:

    (8)   phi   = a . A_ij b - c
    (11)  rows  = [ 0 | n | 0 | -A_ij^T n ]
    (12)  gamma = a . ( (w_i x Om) x A_ij b - Om x (Om x A_ij b) )

Conventional:

          rows  = [ 0 | -b^T A_ji skew(a) | 0 | -a^T A_ij skew(b) ]
          gamma = -b^T [ A_ji W_i W_i + W_j W_j A_ji ] a + 2 w_j^T skew(b) A_ji skew(a) w_i

The printed (9)-(12) and Table 1 carry wrong indices and lost factors (formulation section 9); (12)
here is the derivative of (11), which needs no matrix product.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..algebra import ZERO, Scalar, Vec3, cross
from .base import Pose, Primitive, Row, Twist, relative


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

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        n = cross(i.turn(self.a), j.turn(self.b))
        return (Row(ZERO, n, ZERO, -n),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        a, b = i.turn(self.a), j.turn(self.b)
        n_dot = cross(cross(vi.w, a), b) + cross(a, cross(vj.w, b))
        return (n_dot @ (vj.w - vi.w),)


class PaperDot10(Dot10):
    """Eqs (8)-(12) in body axes."""

    body_axes = True

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (self.a @ (relative(i, j) @ self.b) - self.a @ self.b,)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        A_ij = relative(i, j)
        n = cross(self.a, A_ij @ self.b)
        return (Row(ZERO, n, ZERO, -(A_ij.T @ n)),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        A_ij = relative(i, j)
        b, Om = A_ij @ self.b, A_ij @ vj.w - vi.w
        return (self.a @ (cross(cross(vi.w, Om), b) - cross(Om, cross(Om, b))),)


class ConventionalDot10(PaperDot10):
    """The paper's residual (8), with rows by full products."""

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        A_ij = relative(i, j)
        # x^T skew(y) = x x y
        return (Row(ZERO, -cross(A_ij @ self.b, self.a), ZERO, -cross(A_ij.T @ self.a, self.b)),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        A_ji = relative(i, j).T
        a, b = self.a, self.b
        turning = A_ji @ vi.centripetal(a) + vj.centripetal(A_ji @ a)
        return (2.0 * (cross(vj.w, b) @ (A_ji @ cross(a, vi.w))) - b @ turning,)


Dot10.paper, Dot10.conventional = PaperDot10, ConventionalDot10
