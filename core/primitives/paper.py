"""The row style of the paper: Tables 1 and 2 as corrected (formulation section 9), in body axes.

Unknowns are (dr, dpi'), velocities (rdot, w'), accelerations (rddot, w'dot). Body axes are parallel
to the global ones at design, so a body-fixed vector has the same components in every style. A_ij =
A_i^T A_j, frame j -> frame i; Om = A_ij w_j - w_i. Kept to measure the paper's claims; the native
style is these rows times A.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

from ..algebra import ZERO, Mat3, Scalar, Vec3, X, Y, Z, cross
from .base import Pose, Primitive, Row, Twist
from .constant_velocity import ConstantVelocity
from .distance import Distance
from .dot10 import Dot10
from .dot11 import Dot11
from .dot12 import Dot12
from .dot20 import Dot20
from .dot21 import Dot21, LockedDisplacement
from .driven import DrivenAngle, DrivenCoordinate
from .ground import Ground
from .spherical import Spherical


def relative(i: Pose, j: Pose) -> Mat3:
    """Return A_ij: from frame j to frame i."""
    return i.A.T.times(j.A)


def arm_rows(A: Mat3, s: Vec3) -> tuple[Vec3, Vec3, Vec3]:
    """Return the rows of A skew(s)."""
    # row k of A, times skew(s), is a_k x s
    return cross(A.x, s), cross(A.y, s), cross(A.z, s)


@dataclass(frozen=True)
class PaperSpherical(Spherical):
    """Rows [ -I | A_i skew(s_i) | I | -A_j skew(s_j) ]."""

    body_axes = True

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        blocks = zip((X, Y, Z), arm_rows(i.A, self.s_i), arm_rows(j.A, self.s_j), strict=True)
        return tuple(Row(-e, b_i, e, -b_j) for e, b_i, b_j in blocks)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        return tuple(i.A @ vi.centripetal(self.s_i) - j.A @ vj.centripetal(self.s_j))


@dataclass(frozen=True)
class PaperDot10(Dot10):
    """Eqs (8)-(12): n = a x A_ij b, rows [ 0 | n | 0 | -A_ij^T n ]."""

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


@dataclass(frozen=True)
class PaperDot11(Dot11):
    """Eqs (13)-(16): rows [ 0 | f | 0 | -A_ij^T f ] and [ 0 | -g | 0 | A_ij^T g ], constant for
    body i.
    """

    body_axes = True

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        h_j = relative(i, j) @ self.h
        return self.g @ h_j, self.f @ h_j

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        A_ji = relative(i, j).T
        return Row(ZERO, self.f, ZERO, -(A_ji @ self.f)), Row(ZERO, -self.g, ZERO, A_ji @ self.g)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        s = self.h @ (relative(i, j) @ vj.w - vi.w)
        return -(s * (self.g @ vi.w)), -(s * (self.f @ vi.w))


@dataclass(frozen=True)
class PaperDot12(Dot12):
    """Eqs (17)-(21): rows [ 0 | I | 0 | -A_ij ]. The residual has seven spurious rotations; the
    branch test is trace A_ij = 3.
    """

    steady = False
    body_axes = True

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        A_ij = relative(i, j)
        # with the joint frame along the body axes, f, g, h = x, y, z: g_i . h_j, h_i . f_j, f_i .
        # g_j
        return A_ij.y.z, A_ij.z.x, A_ij.x.y

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        A_ij = relative(i, j)
        return tuple(
            Row(ZERO, e, ZERO, -a) for e, a in zip((X, Y, Z), (A_ij.x, A_ij.y, A_ij.z), strict=True)
        )

    def branch(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        A_ij = relative(i, j)
        return (A_ij.x.x + A_ij.y.y + A_ij.z.z - 2.0,)  # 1 on the branch, -2 or -3 off it


@dataclass(frozen=True)
class PaperDot20(Dot20):
    """Eq. (22) with y = A_i^T (r_j - r_i + A_j s_j): rows [ -(A_i a) | a x y | A_i a | s_j x A_ij^T
    a ].
    """

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


@dataclass(frozen=True)
class PaperDot21(Dot21):
    """Eq. (23), const-C, with y0 = A_i^T (r_j - r_i): rows [ -(A_i a) | a x y0 | A_i a | 0 ] for a
    = f, g.
    """

    body_axes = True

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return tuple(_along(a, self.e0, i, j) for a in (self.f, self.g))

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        return tuple(_along_row(a, self.e0, i, j) for a in (self.f, self.g))

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        return tuple(_along_gamma(a, self.e0, i, j, vi, vj) for a in (self.f, self.g))


@dataclass(frozen=True)
class PaperLockedDisplacement(LockedDisplacement):
    """(23) with a = h, driven."""

    body_axes = True

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (_along(self.h, self.e0, i, j) - self.drive.c,)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        return (_along_row(self.h, self.e0, i, j),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        return (self.drive.c_tt + _along_gamma(self.h, self.e0, i, j, vi, vj),)


@dataclass(frozen=True)
class PaperDistance(Distance):
    """The same residual; rows u^T J of the spherical rows, u = d / L."""

    body_axes = True

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        u = (1.0 / self.length) * (self.d0 + self.change(i, j))
        return (Row(-u, cross(i.A.T @ u, self.s_i), u, cross(self.s_j, j.A.T @ u)),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        d = self.d0 + self.change(i, j)
        d_t = (vj.v + j.A @ cross(vj.w, self.s_j)) - (vi.v + i.A @ cross(vi.w, self.s_i))
        bent = j.A @ vj.centripetal(self.s_j) - i.A @ vi.centripetal(self.s_i)
        return (-((d_t @ d_t + d @ bent) * (1.0 / self.length)),)


@dataclass(frozen=True)
class PaperDrivenCoordinate(DrivenCoordinate):
    """Rows [ 0 | 0 | k | s x A_j^T k ]."""

    body_axes = True

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        return (Row(ZERO, ZERO, self.k, cross(self.s, j.A.T @ self.k)),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        return (self.drive.c_tt - self.k @ (j.A @ vj.centripetal(self.s)),)


@dataclass(frozen=True)
class PaperDrivenAngle(DrivenAngle):
    """Rows [ 0 | -h | 0 | h ], constant: h is the same in both body frames if the axes are
    parallel.
    """

    body_axes = True

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        return (Row(ZERO, -self.h, ZERO, self.h),)


@dataclass(frozen=True)
class PaperConstantVelocity(ConstantVelocity):
    """The difference of two dot10 in body axes."""

    body_axes = True

    @property
    def pair(self) -> tuple[Dot10, Dot10]:
        """The two dot10 that are subtracted."""
        return PaperDot10(self.f_i, self.g_j), PaperDot10(self.g_i, self.f_j)


@dataclass(frozen=True)
class PaperGround(Ground):
    """Rows I_6."""

    body_axes = True


def _along(a: Vec3, e0: Vec3, i: Pose, j: Pose) -> Scalar:
    return a @ (i.A.T @ (e0 + (j.u - i.u))) - a @ e0


def _along_row(a: Vec3, e0: Vec3, i: Pose, j: Pose) -> Row:
    a_G = i.A @ a
    return Row(-a_G, cross(a, i.A.T @ (e0 + (j.u - i.u))), a_G, ZERO)


def _along_gamma(a: Vec3, e0: Vec3, i: Pose, j: Pose, vi: Twist, vj: Twist) -> Scalar:
    y, y_t = i.A.T @ (e0 + (j.u - i.u)), i.A.T @ (vj.v - vi.v)
    return a @ (2.0 * cross(vi.w, y_t) - cross(vi.w, cross(vi.w, y)))


def _of_same_fields(paper: type[Primitive]) -> Callable[[Primitive], tuple[Primitive, ...]]:
    """Return a function to the same fields in another class."""

    def twin(native: Primitive) -> tuple[Primitive, ...]:
        return (
            paper(
                **{name: getattr(native, name) for name in (each.name for each in fields(native))}
            ),
        )

    return twin


TWINS: Mapping[type[Primitive], Callable[[Any], tuple[Primitive, ...]]] = {
    native: _of_same_fields(paper)
    for native, paper in (
        (Spherical, PaperSpherical),
        (Dot10, PaperDot10),
        (Dot11, PaperDot11),
        (Dot12, PaperDot12),
        (Dot20, PaperDot20),
        (Dot21, PaperDot21),
        (LockedDisplacement, PaperLockedDisplacement),
        (Distance, PaperDistance),
        (DrivenCoordinate, PaperDrivenCoordinate),
        (DrivenAngle, PaperDrivenAngle),
        (Ground, PaperGround),
        (ConstantVelocity, PaperConstantVelocity),
    )
}
"""Native primitive -> the primitives of this style that replace it."""

__all__ = ["TWINS", "arm_rows", "relative"]
