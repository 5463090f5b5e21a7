"""Dot20: a on body i is perpendicular to the line from P_i to P_j (1 row).

Paper sec. 2.2.5, eq. (22); Table 2.

In global axes, with a = A_i a0, S = A s, and d from P_i to P_j:

    (22)  phi   = a . d - c - a0 . d0     expanded about design; c is the driven displacement
          rows  = [ -a | a x (d + S_i) | a | S_j x a ]          exact everywhere
          gamma = c_tt - ( (w_i x (w_i x a)) . d + 2 (w_i x a) . ddot + a .
                  (w_j x (w_j x S_j) - w_i x (w_i x S_i)) )

The paper in body axes, with y = A_i^T (r_j - r_i + A_j s_j):

    (22)  phi   = a . (y - s_i) - c - a . d0
          rows  = [ -(A_i a) | a x y | A_i a | s_j x A_ij^T a ]
          gamma = c_tt + a . ( 2 w_i x ydot - w_i x (w_i x y) - A_ij (w_j x (w_j x s_j)) ),
          ydot  = A_i^T (v_j - v_i) + A_ij (w_j x s_j)

Conventional, with d = r_j + A_j s_j - r_i - A_i s_i:

          rows  = [ -(A_i a)^T | a^T skew(s_i) - d^T A_i skew(a) | (A_i a)^T | -a^T A_ij skew(s_j) ]
          gamma = c_tt + 2 w_i^T skew(a) A_i^T (v_i - v_j) + 2 s_j^T W_j A_ji W_i a
                  - s_i^T W_i W_i a - s_j^T W_j W_j A_ji a - d^T A_i W_i W_i a

The printed gamma20 is garbled beyond reading (formulation section 9); this one is the second
derivative of (22). r_j - r_i is formed from displacements before anything else, which keeps the
residual exact at any distance from the global origin.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ..algebra import Scalar, Vec3, cross
from .base import Drive, Pose, Primitive, Row, Twist, relative


@dataclass(frozen=True)
class Dot20(Primitive):
    """a on body i [-]; arms s_i, s_j to P_i and P_j [m]; d0 from P_i to P_j at design [m]; drive:
    displacement along a [m].
    """

    n = 1
    a: Vec3
    s_i: Vec3
    s_j: Vec3
    d0: Vec3
    drive: Drive = field(default_factory=Drive)

    def change(self, i: Pose, j: Pose) -> Vec3:
        """Return the change of d since design."""
        return (j.u - i.u) + (j.swing(self.s_j) - i.swing(self.s_i))

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        dd = self.change(i, j)
        return (i.swing(self.a) @ (self.d0 + dd) + self.a @ dd - self.drive.c,)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        a, d = i.turn(self.a), self.d0 + self.change(i, j)
        return (Row(-a, cross(a, d + i.turn(self.s_i)), a, cross(j.turn(self.s_j), a)),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        a, d, S_i, S_j = (
            i.turn(self.a),
            self.d0 + self.change(i, j),
            i.turn(self.s_i),
            j.turn(self.s_j),
        )
        a_dot, d_dot = cross(vi.w, a), vj.of(S_j) - vi.of(S_i)
        turning = cross(vi.w, a_dot) @ d + 2.0 * (a_dot @ d_dot)
        return (self.drive.c_tt - (turning + a @ (vj.centripetal(S_j) - vi.centripetal(S_i))),)

    def nu(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (self.drive.c_t,)


class PaperDot20(Dot20):
    """Eq. (22) in body axes."""

    body_axes = True

    def _y(self, i: Pose, j: Pose) -> Vec3:
        between = (self.d0 + self.s_i - self.s_j) + (j.u - i.u)
        return i.A.T @ between + relative(i, j) @ self.s_j

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (self.a @ (self._y(i, j) - self.s_i) - self.a @ self.d0 - self.drive.c,)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        a_G = i.A @ self.a
        return (
            Row(
                -a_G, cross(self.a, self._y(i, j)), a_G, cross(self.s_j, relative(i, j).T @ self.a)
            ),
        )

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        A_ij, y = relative(i, j), self._y(i, j)
        y_t = i.A.T @ (vj.v - vi.v) + A_ij @ cross(vj.w, self.s_j)
        turning = (
            2.0 * cross(vi.w, y_t) - cross(vi.w, cross(vi.w, y)) - A_ij @ vj.centripetal(self.s_j)
        )
        return (self.drive.c_tt + self.a @ turning,)


class ConventionalDot20(Dot20):
    """a . (r_j + A_j s_j - r_i - A_i s_i) by full products."""

    body_axes = True

    def _d(self, i: Pose, j: Pose) -> Vec3:
        between = (self.d0 + self.s_i - self.s_j) + (j.u - i.u)
        return between + j.A @ self.s_j - i.A @ self.s_i

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return ((i.A @ self.a) @ self._d(i, j) - self.a @ self.d0 - self.drive.c,)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        a_G = i.A @ self.a
        p_i = cross(self.a, self.s_i) - cross(i.A.T @ self._d(i, j), self.a)
        return (Row(-a_G, p_i, a_G, -cross(relative(i, j).T @ self.a, self.s_j)),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        a, A_ji = self.a, relative(i, j).T
        bent = vi.centripetal(a)
        # s^T W = -(w x s)
        sliding = cross(vi.w, a) @ (i.A.T @ (vi.v - vj.v)) - cross(vj.w, self.s_j) @ (
            A_ji @ cross(vi.w, a)
        )
        turning = (
            self.s_i @ bent + self.s_j @ vj.centripetal(A_ji @ a) + (i.A.T @ self._d(i, j)) @ bent
        )
        return (self.drive.c_tt + 2.0 * sliding - turning,)


Dot20.paper, Dot20.conventional = PaperDot20, ConventionalDot20
