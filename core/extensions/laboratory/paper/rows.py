"""The rows of the paper and of textbooks, to measure the paper's claims.

- Paper: Tables 1 and 2 as corrected (formulation section 9), in body axes. Unknowns are (dr, dpi'),
  velocities (rdot, w'), accelerations (rddot, w'dot). The native rows are these times A^T.
- Conventional: full matrix products, not simplified by the geometry, as textbooks and DADS have
  them (Haug; formulation section 2), in body axes. Orientation conditions consist of dot10, line
  conditions of dot20. Spherical, distance and driver rows have no simplified form; their paper rows
  serve here too.

A_ij = A_i^T A_j maps frame j to frame i; Om = A_ij w_j - w_i; W = skew(w). w of a twist and dpi of
a row have components in their own body.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from typing import Any, ClassVar

from ....algebra import ZERO, Mat3, Scalar, Vec3, X, Y, Z, cross, vec
from ....errors import SolveError
from ....kinematics import COLUMNS, Cartesian, Frames, Relation, constraints
from ....kinematics.formulation.formulation import Acceleration, Configuration, State
from ....mechanism.mechanism import Mechanism
from ....primitives import (
    ConstantVelocity,
    Distance,
    Dot10,
    Dot11,
    Dot12,
    Dot20,
    Dot21,
    Drive,
    DrivenAngle,
    DrivenCoordinate,
    Ground,
    Pose,
    Primitive,
    Row,
    Spherical,
    Twist,
)


class NoFormError(SolveError):
    """A primitive has no rows in a row style."""


def relative(i: Pose, j: Pose) -> Mat3:
    """Return A_ij: from frame j to frame i."""
    return i.A.T.times(j.A)


class PaperDot10(Dot10):
    """Eqs (8)-(12), with n = a x A_ij b:

    (8)   phi   = a . A_ij b - c
    (11)  rows  = [ 0 | n | 0 | -A_ij^T n ]
    (12)  gamma = a . ( (w_i x Om) x A_ij b - Om x (Om x A_ij b) )
    """

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
    """The paper's residual (8), with rows by full products:

    rows  = [ 0 | -b^T A_ji skew(a) | 0 | -a^T A_ij skew(b) ]
    gamma = -b^T [ A_ji W_i W_i + W_j W_j A_ji ] a + 2 w_j^T skew(b) A_ji skew(a) w_i
    """

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        A_ij = relative(i, j)
        # x^T skew(y) = x x y
        return (Row(ZERO, -cross(A_ij @ self.b, self.a), ZERO, -cross(A_ij.T @ self.a, self.b)),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        A_ji = relative(i, j).T
        a, b = self.a, self.b
        turning = A_ji @ vi.centripetal(a) + vj.centripetal(A_ji @ a)
        return (2.0 * (cross(vj.w, b) @ (A_ji @ cross(a, vi.w))) - b @ turning,)


class PaperDot11(Dot11):
    """Eqs (13)-(16); the rows of body i are constant:

    (13)  phi   = [ g . A_ij h,  f . A_ij h ]
    (14)  rows  = [ 0 | f | 0 | -A_ij^T f ], [ 0 | -g | 0 | A_ij^T g ]
    (16)  gamma = [ -s (g . w_i),  -s (f . w_i) ],      s = h . Om
    """

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        h_j = relative(i, j) @ self.h
        return self.g @ h_j, self.f @ h_j

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        A_ji = relative(i, j).T
        return Row(ZERO, self.f, ZERO, -(A_ji @ self.f)), Row(ZERO, -self.g, ZERO, A_ji @ self.g)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        s = self.h @ (relative(i, j) @ vj.w - vi.w)
        return -(s * (self.g @ vi.w)), -(s * (self.f @ vi.w))


class ParallelTest(ConventionalDot10):
    """The first dot10 of a parallel pair, b = h: it also carries the pair's branch test, h_i . h_j
    > 0.
    """

    def branch(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        return (self.b @ (relative(i, j) @ self.b),)


class PaperDot12(Dot12):
    """Eqs (17)-(21), with the joint frame f, g, h along the body axes:

        (17)       phi   = [ g_i . h_j, h_i . f_j, f_i . g_j ]
        (18)-(21)  rows  = [ 0 | I | 0 | -A_ij ],      gamma = 0

    The residual has seven spurious rotations; the branch test is trace A_ij = 3.
    """

    steady = False

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


class LockTest(ConventionalDot10):
    """The first dot10 of a lock: it also carries the lock's branch test, trace A_ij = 3."""

    def branch(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        A_ij = relative(i, j)
        return (A_ij.x.x + A_ij.y.y + A_ij.z.z - 2.0,)


class PaperDot20(Dot20):
    """Eq. (22), with y = A_i^T (r_j - r_i + A_j s_j):

    (22)  phi   = a . (y - s_i) - c - a . d0
          rows  = [ -(A_i a) | a x y | A_i a | s_j x A_ij^T a ]
          gamma = c_tt + a . ( 2 w_i x ydot - w_i x (w_i x y) - A_ij (w_j x (w_j x s_j)) ),
          ydot  = A_i^T (v_j - v_i) + A_ij (w_j x s_j)
    """

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
    """a . d by full products, with d = r_j + A_j s_j - r_i - A_i s_i:

    rows  = [ -(A_i a)^T | a^T skew(s_i) - d^T A_i skew(a) | (A_i a)^T | -a^T A_ij skew(s_j) ]
    gamma = c_tt + 2 w_i^T skew(a) A_i^T (v_i - v_j) + 2 s_j^T W_j A_ji W_i a
            - s_i^T W_i W_i a - s_j^T W_j W_j A_ji a - d^T A_i W_i W_i a
    """

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


class PaperDot21(Dot21):
    """Eq. (23), const-C, with y = A_i^T (r_j - r_i):

    (23)  phi   = a . y - a . e0
          rows  = [ -(A_i a) | a x y | A_i a | 0 ]
          gamma = a . ( 2 w_i x A_i^T (v_j - v_i) - w_i x (w_i x y) )
    """

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        y = i.A.T @ (self.e0 + (j.u - i.u))
        return tuple(a @ y - a @ self.e0 for a in (self.f, self.g))

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        y = i.A.T @ (self.e0 + (j.u - i.u))
        return tuple(Row(-(i.A @ a), cross(a, y), i.A @ a, ZERO) for a in (self.f, self.g))

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        y, y_t = i.A.T @ (self.e0 + (j.u - i.u)), i.A.T @ (vj.v - vi.v)
        turning = 2.0 * cross(vi.w, y_t) - cross(vi.w, cross(vi.w, y))
        return tuple(a @ turning for a in (self.f, self.g))


class PaperSpherical(Spherical):
    """Eq. (24):

    rows  = [ -I | A_i skew(s_i) | I | -A_j skew(s_j) ]
    gamma = A_i (w_i x (w_i x s_i)) - A_j (w_j x (w_j x s_j))
    """

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        blocks = zip((X, Y, Z), _arm_rows(i.A, self.s_i), _arm_rows(j.A, self.s_j), strict=True)
        return tuple(Row(-e, b_i, e, -b_j) for e, b_i, b_j in blocks)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        return tuple(i.A @ vi.centripetal(self.s_i) - j.A @ vj.centripetal(self.s_j))


def _arm_rows(A: Mat3, s: Vec3) -> tuple[Vec3, Vec3, Vec3]:
    """Return the rows of A skew(s)."""
    # row k of A, times skew(s), is a_k x s
    return cross(A.x, s), cross(A.y, s), cross(A.z, s)


class PaperDistance(Distance):
    """The same residual; u = d / L times the rows of the spherical condition:

    rows  = [ -u | A_i^T u x s_i | u | s_j x A_j^T u ]
    """

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        u = (1.0 / self.length) * (self.d0 + self.change(i, j))
        return (Row(-u, cross(i.A.T @ u, self.s_i), u, cross(self.s_j, j.A.T @ u)),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        d = self.d0 + self.change(i, j)
        d_t = (vj.v + j.A @ cross(vj.w, self.s_j)) - (vi.v + i.A @ cross(vi.w, self.s_i))
        bent = j.A @ vj.centripetal(self.s_j) - i.A @ vi.centripetal(self.s_i)
        return (-((d_t @ d_t + d @ bent) * (1.0 / self.length)),)


class PaperDrivenCoordinate(DrivenCoordinate):
    """The rows in body axes."""

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        return (Row(ZERO, ZERO, self.k, cross(self.s, j.A.T @ self.k)),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        return (self.drive.c_tt - self.k @ (j.A @ vj.centripetal(self.s)),)


class PaperDrivenAngle(DrivenAngle):
    """The rows in body axes."""

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        return (Row(ZERO, -self.h, ZERO, self.h),)


class PaperConstantVelocity(ConstantVelocity):
    """The difference of two dot10 in body axes."""

    dot: ClassVar[type[PaperDot10]] = PaperDot10

    @property
    def pair(self) -> tuple[Dot10, Dot10]:
        """The two dot10 that are subtracted."""
        return self.dot(self.f_i, self.g_j), self.dot(self.g_i, self.f_j)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        (plus,), (minus,) = (dot.rows(i, j) for dot in self.pair)
        return (Row(ZERO, plus.pi - minus.pi, ZERO, plus.pj - minus.pj),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        (plus,), (minus,) = (dot.gamma(i, j, vi, vj) for dot in self.pair)
        return (plus - minus,)


class ConventionalConstantVelocity(PaperConstantVelocity):
    """The difference of two dot10 by full products."""

    dot = ConventionalDot10


PAPER: Mapping[type[Primitive], Any] = {
    Dot10: PaperDot10,
    Dot11: PaperDot11,
    Dot12: PaperDot12,
    Dot20: PaperDot20,
    Dot21: PaperDot21,
    Spherical: PaperSpherical,
    Distance: PaperDistance,
    DrivenCoordinate: PaperDrivenCoordinate,
    DrivenAngle: PaperDrivenAngle,
    Ground: Ground,
    ConstantVelocity: PaperConstantVelocity,
}
"""The paper's form of each primitive, with the same fields."""
CONVENTIONAL: Mapping[type[Primitive], Any] = {
    **PAPER,
    Dot10: ConventionalDot10,
    Dot20: ConventionalDot20,
    ConstantVelocity: ConventionalConstantVelocity,
}
"""The conventional form of each primitive that has one with the same fields."""


def paper_form(primitive: Primitive) -> tuple[Primitive, ...]:
    """Return the primitives that replace one in the paper's row style.

    Raises:
        NoFormError: the primitive has none.
    """
    return (_form(primitive, PAPER),)


def conventional_form(primitive: Primitive) -> tuple[Primitive, ...]:
    """Return the primitives that replace one in the conventional row style.

    Raises:
        NoFormError: the primitive has none.
    """
    match primitive:
        case Dot11(f=f, g=g, h=h) if type(primitive) is Dot11:
            return ParallelTest(g, h), ConventionalDot10(f, h)
        case Dot12() if type(primitive) is Dot12:
            return LockTest(Y, Z), ConventionalDot10(Z, X), ConventionalDot10(X, Y)
        case Dot21(f=f, g=g, e0=e0) if type(primitive) is Dot21:
            return tuple(ConventionalDot20(a, ZERO, ZERO, e0) for a in (f, g))
        case _:
            return (_form(primitive, CONVENTIONAL),)


def _form(primitive: Primitive, forms: Mapping[type[Primitive], Any]) -> Primitive:
    kind = forms.get(type(primitive))  # a subclass has rows of its own
    if kind is None:
        raise NoFormError(
            f"{type(primitive).__name__} has no rows in the styles paper and conventional; use the"
            " style native"
        )
    return kind(**{each.name: getattr(primitive, each.name) for each in fields(kind)})


class BodyAxes(Cartesian):
    """Equations whose dpi, w and wdot are in body axes."""

    def retract(self, at: Configuration, step: Sequence[Scalar]) -> State:
        return super().retract(at, self._globally(at, step))

    def twists(self, at: Configuration, v: Sequence[Scalar]) -> Mapping[str, Twist]:
        return super().twists(at, self._globally(at, v))

    def accelerations(
        self, at: Configuration, v: Sequence[Scalar], a: Sequence[Scalar]
    ) -> Mapping[str, Acceleration]:
        # A w' differentiated is A w'dot + w x w, and the last is zero
        return super().accelerations(at, v, self._globally(at, a))

    def _globally(self, at: Configuration, values: Sequence[Scalar]) -> list[Scalar]:
        """Return values of the unknowns with their turns in global axes."""
        found = [*values]
        for name, k in self.columns.items():
            turned = slice(k + 3, k + COLUMNS)
            found[turned] = at.poses[name].turn(vec(values[turned]))
        return found


def _styled(
    form: Callable[[Primitive], Sequence[Primitive]],
    mechanism: Mechanism,
    frame: Frames,
    drives: Mapping[str, Drive],
    named: Collection[str],
) -> Cartesian:
    found = [
        each
        for c in constraints(mechanism, frame, drives, named)
        for each in (
            [c]
            if isinstance(c, Relation)
            else [replace(c, primitive=each) for each in form(c.primitive)]
        )
    ]
    return BodyAxes(found, frame.moving)


paper = partial(_styled, paper_form)
conventional = partial(_styled, conventional_form)
"""The formulations of the row styles; see `kinematics.formulation.styles`."""
