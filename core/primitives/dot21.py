"""Dot21: P_j stays on the line through P_i along h_i, for bodies that turn alike (2 rows).

Paper sec. 2.2.6, eq. (23); Table 2.

Const-C form (formulation section 3): where Dot12 holds, body j's arm can be carried by body i, so
body j's rotation and its arm drop out. With e = r_j - r_i = e0 + u_j - u_i between the body
origins, and a = A_i a0 for a0 = f, g:

    (23)  phi   = a . e - a0 . e0
          rows  = [ -a | a x e | a | 0 ]        exact for this phi everywhere
          gamma = -( (w_i x (w_i x a)) . e + 2 (w_i x a) . (v_j - v_i) )

The paper in body axes, const-C, with y = A_i^T (r_j - r_i):

    (23)  phi   = a . y - a . e0
          rows  = [ -(A_i a) | a x y | A_i a | 0 ]
          gamma = a . ( 2 w_i x A_i^T (v_j - v_i) - w_i x (w_i x y) )

Conventional: dot20 between the body origins, with arms of zero.

Only together with Dot12 of the same joint: the rows of the line constraint alone (Dot20) differ
from these by multiples of the Dot12 rows. With the current A_ij in the residual, as the paper has
it, the same rows take one or two Newton passes more and lose their basin for long arms; that form
was rejected. Table 2 prints a spurious block and drops a dot (formulation section 9).
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ..algebra import ZERO, Scalar, Vec3, cross
from .base import Drive, Pose, Primitive, Row, Twist
from .dot20 import ConventionalDot20


@dataclass(frozen=True)
class Dot21(Primitive):
    """f, g: two axes perpendicular to the line [-]; e0: from body i's origin to body j's at design
    [m].
    """

    n = 2
    f: Vec3
    g: Vec3
    e0: Vec3

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return tuple(along(a, self.e0, i, j) for a in (self.f, self.g))

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        return tuple(along_row(a, self.e0, i, j) for a in (self.f, self.g))

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        return tuple(along_gamma(a, self.e0, i, j, vi, vj) for a in (self.f, self.g))

    def paper_form(self) -> tuple[Primitive, ...]:
        return (PaperDot21(self.f, self.g, self.e0),)

    def conventional_form(self) -> tuple[Primitive, ...]:
        return tuple(ConventionalDot20(a, ZERO, ZERO, self.e0) for a in (self.f, self.g))


@dataclass(frozen=True)
class LockedDisplacement(Primitive):
    """The displacement of body j along h of body i is c, for bodies that turn alike (1 row): (23)
    with a = h, driven.
    """

    n = 1
    h: Vec3
    e0: Vec3
    drive: Drive = field(default_factory=Drive)

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (along(self.h, self.e0, i, j) - self.drive.c,)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        return (along_row(self.h, self.e0, i, j),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        return (self.drive.c_tt + along_gamma(self.h, self.e0, i, j, vi, vj),)

    def nu(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (self.drive.c_t,)

    def paper_form(self) -> tuple[Primitive, ...]:
        return (PaperLockedDisplacement(self.h, self.e0, self.drive),)

    def conventional_form(self) -> tuple[Primitive, ...]:
        return (ConventionalDot20(self.h, ZERO, ZERO, self.e0, self.drive),)


def along(a: Vec3, e0: Vec3, i: Pose, j: Pose) -> Scalar:
    """Return the change of a . e since design [m]."""
    du = j.u - i.u
    return i.swing(a) @ (e0 + du) + a @ du


def along_row(a: Vec3, e0: Vec3, i: Pose, j: Pose) -> Row:
    """Return the row of a . e."""
    a_now = i.turn(a)
    return Row(-a_now, cross(a_now, e0 + (j.u - i.u)), a_now, ZERO)


def along_gamma(a: Vec3, e0: Vec3, i: Pose, j: Pose, vi: Twist, vj: Twist) -> Scalar:
    """Return the right-hand side of a . e in the acceleration equation [m/s^2]."""
    a_dot = cross(vi.w, i.turn(a))
    return -(cross(vi.w, a_dot) @ (e0 + (j.u - i.u)) + 2.0 * (a_dot @ (vj.v - vi.v)))


class PaperDot21(Dot21):
    """Eq. (23) in body axes."""

    body_axes = True

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return tuple(_paper_along(a, self.e0, i, j) for a in (self.f, self.g))

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        return tuple(_paper_along_row(a, self.e0, i, j) for a in (self.f, self.g))

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        return tuple(_paper_along_gamma(a, self.e0, i, j, vi, vj) for a in (self.f, self.g))


class PaperLockedDisplacement(LockedDisplacement):
    """(23) in body axes with a = h, driven."""

    body_axes = True

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (_paper_along(self.h, self.e0, i, j) - self.drive.c,)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        return (_paper_along_row(self.h, self.e0, i, j),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        return (self.drive.c_tt + _paper_along_gamma(self.h, self.e0, i, j, vi, vj),)


def _paper_along(a: Vec3, e0: Vec3, i: Pose, j: Pose) -> Scalar:
    return a @ (i.A.T @ (e0 + (j.u - i.u))) - a @ e0


def _paper_along_row(a: Vec3, e0: Vec3, i: Pose, j: Pose) -> Row:
    a_G = i.A @ a
    return Row(-a_G, cross(a, i.A.T @ (e0 + (j.u - i.u))), a_G, ZERO)


def _paper_along_gamma(a: Vec3, e0: Vec3, i: Pose, j: Pose, vi: Twist, vj: Twist) -> Scalar:
    y, y_t = i.A.T @ (e0 + (j.u - i.u)), i.A.T @ (vj.v - vi.v)
    return a @ (2.0 * cross(vi.w, y_t) - cross(vi.w, cross(vi.w, y)))
