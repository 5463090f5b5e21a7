"""The conventional row style: products of full matrices as textbooks and DADS have them (Haug), in
body axes.

Every orientation condition is made of dot10 and every line condition of dot20; nothing is
simplified by the geometry. Formulation section 2, the forms quoted there after Haug. With A_ji =
A_j^T A_i:

    dot10   rows = [ 0 | -b^T A_ji skew(a) | 0 | -a^T A_ij skew(b) ]
            gamma = -b^T [ A_ji W_i W_i + W_j W_j A_ji ] a + 2 w_j^T skew(b) A_ji skew(a) w_i,
            W = skew(w)
    dot20   rows = [ -(A_i a)^T | a^T skew(s_i) - d^T A_i skew(a) | (A_i a)^T |
                     -a^T A_ij skew(s_j) ]
            gamma = 2 w_i^T skew(a) A_i^T (v_i - v_j) + 2 s_j^T W_j A_ji W_i a
                    - s_i^T W_i W_i a - s_j^T W_j W_j A_ji a - d^T A_i W_i W_i a

Spherical, distance and driver rows have no simplified form; they are those of the paper's style.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ..algebra import ZERO, Scalar, Vec3, X, Y, Z, cross
from . import paper
from .base import Pose, Primitive, Row, Twist
from .constant_velocity import ConstantVelocity
from .dot10 import Dot10
from .dot11 import Dot11
from .dot12 import Dot12
from .dot20 import Dot20
from .dot21 import Dot21, LockedDisplacement
from .paper import relative


@dataclass(frozen=True)
class ConventionalDot10(Dot10):
    """a . A_ij b = c by full products."""

    body_axes = True

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (self.a @ (relative(i, j) @ self.b) - self.a @ self.b,)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        A_ij = relative(i, j)
        # x^T skew(y) = x x y
        return (Row(ZERO, -cross(A_ij @ self.b, self.a), ZERO, -cross(A_ij.T @ self.a, self.b)),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        A_ji = relative(i, j).T
        a, b = self.a, self.b
        turning = A_ji @ vi.centripetal(a) + vj.centripetal(A_ji @ a)
        return (2.0 * (cross(vj.w, b) @ (A_ji @ cross(a, vi.w))) - b @ turning,)


@dataclass(frozen=True)
class ParallelTest(ConventionalDot10):
    """The first dot10 of a parallel pair: it also carries the pair's branch test, h_i . h_j > 0."""

    h: Vec3 = ZERO

    def branch(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (self.h @ (relative(i, j) @ self.h),)


@dataclass(frozen=True)
class LockTest(ConventionalDot10):
    """The first dot10 of a lock: it also carries the lock's branch test, trace A_ij = 3."""

    def branch(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        A_ij = relative(i, j)
        return (A_ij.x.x + A_ij.y.y + A_ij.z.z - 2.0,)


@dataclass(frozen=True)
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


@dataclass(frozen=True)
class ConventionalConstantVelocity(ConstantVelocity):
    """The difference of two dot10 by full products."""

    body_axes = True

    @property
    def pair(self) -> tuple[Dot10, Dot10]:
        """The two dot10 that are subtracted."""
        return ConventionalDot10(self.f_i, self.g_j), ConventionalDot10(self.g_i, self.f_j)


def _dot10(native: Dot10) -> tuple[Primitive, ...]:
    return (ConventionalDot10(native.a, native.b),)


def _dot11(native: Dot11) -> tuple[Primitive, ...]:
    return ParallelTest(native.g, native.h, native.h), ConventionalDot10(native.f, native.h)


def _dot12(native: Dot12) -> tuple[Primitive, ...]:
    return LockTest(Y, Z), ConventionalDot10(Z, X), ConventionalDot10(X, Y)


def _line(a: Vec3, e0: Vec3, **drive: Any) -> ConventionalDot20:
    # between the body origins: the arms are zero
    return ConventionalDot20(a, ZERO, ZERO, e0, **drive)


def _dot20(native: Dot20) -> tuple[Primitive, ...]:
    return (ConventionalDot20(native.a, native.s_i, native.s_j, native.d0, native.drive),)


def _dot21(native: Dot21) -> tuple[Primitive, ...]:
    return _line(native.f, native.e0), _line(native.g, native.e0)


def _locked(native: LockedDisplacement) -> tuple[Primitive, ...]:
    return (_line(native.h, native.e0, drive=native.drive),)


TWINS: Mapping[type[Primitive], Callable[[Any], tuple[Primitive, ...]]] = {
    **paper.TWINS,
    Dot10: _dot10,
    Dot11: _dot11,
    Dot12: _dot12,
    Dot20: _dot20,
    Dot21: _dot21,
    LockedDisplacement: _locked,
    ConstantVelocity: lambda native: (
        ConventionalConstantVelocity(native.f_i, native.g_i, native.f_j, native.g_j),
    ),
}
"""Native primitive -> the primitives of this style that replace it."""
