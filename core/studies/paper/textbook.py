"""The rows of Tables 1 and 2 as they are printed (as corrected, formulation section 9): full
matrices, multiplied from the left.

Nothing is shared and no zero of a skew matrix is left out. The solver has no such style; the
paper's operation counts and its remark on round-off are about these rows. Body axes, with
A_ij = A_i^T A_j and W = skew(w):

    dot10   [ 0 | -b^T A_ji skew(a) | 0 | -a^T A_ij skew(b) ]
            gamma = -b^T [ A_ji W_i W_i + W_j W_j A_ji ] a + 2 w_j^T skew(b) A_ji skew(a) w_i
    dot11   [ 0 | f^T | 0 | -f^T A_ij ], [ 0 | -g^T | 0 | g^T A_ij ]
            gamma = (w_i x f)^T A_ij w_j,  -(w_i x g)^T A_ij w_j
    dot12   [ 0 | I | 0 | -C ]                C = A_ij, taken as constant          gamma = 0
    dot20   [ -a^T A_i^T | a^T skew(s_i) - d^T A_i skew(a) | a^T A_i^T | -a^T A_ij skew(s_j) ]
            d = r_j + A_j s_j - r_i - A_i s_i
            gamma = 2 w_i^T skew(a) A_i^T (v_i - v_j) + 2 s_j^T W_j A_ji W_i a
                    - s_i^T W_i W_i a - s_j^T W_j W_j A_ji a - d^T A_i W_i W_i a
    dot21   [ -a^T A_i^T | -e^T A_i skew(a) | a^T A_i^T | 0 ] for a = f, g         e = r_j - r_i
            gamma = 2 (v_j - v_i)^T A_i skew(a) w_i + e^T A_i W_i skew(a) w_i

A pose's u is the position r itself here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

from ...algebra import ZERO, Mat3, Scalar, Vec3, X, Y, Z
from ...primitives import (
    Dot10,
    Dot11,
    Dot12,
    Dot20,
    Dot21,
    Pose,
    Primitive,
    Row,
    Twist,
)


class Countable(Protocol):
    """Equations with countable operations: a primitive, or rows as printed."""

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        """Rows of the Jacobian."""
        ...

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        """Right-hand sides of the acceleration equations."""
        ...


def skew(a: Vec3) -> Mat3:
    """Return the matrix of the cross product a x."""
    return Mat3(Vec3(0.0, -a.z, a.y), Vec3(a.z, 0.0, -a.x), Vec3(-a.y, a.x, 0.0))


def chain(row: Vec3, *factors: Mat3) -> Vec3:
    """Return a row vector times one matrix after the other."""
    for factor in factors:
        row = factor.T @ row
    return row


@dataclass(frozen=True, kw_only=True)
class AsPrinted:
    """Rows as printed.

    Attributes:
        formed: multiply A_ij out wherever it is printed; else a row goes through A_i^T and then
            A_j.
    """

    body_axes: ClassVar[bool] = True
    formed: bool = True

    def relative(self, i: Pose, j: Pose) -> tuple[Mat3, ...]:
        """A_ij as one factor or two."""
        return (i.A.T.times(j.A),) if self.formed else (i.A.T, j.A)


@dataclass(frozen=True)
class PrintedDot10(AsPrinted):
    """a on body i, b on body j [-]."""

    a: Vec3
    b: Vec3

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        """(8), zero for perpendicular a and b."""
        return (chain(self.a, *self.relative(i, j)) @ self.b,)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        """(11)."""
        p_i = chain(self.b, *self.relative(j, i), skew(self.a))
        return (Row(ZERO, -p_i, ZERO, -chain(self.a, *self.relative(i, j), skew(self.b))),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        """(12)."""
        a, b, W_i, W_j = self.a, self.b, skew(vi.w), skew(vj.w)
        turning = (
            chain(b, *self.relative(j, i), W_i, W_i) @ a
            + chain(b, W_j, W_j, *self.relative(j, i)) @ a
        )
        return (2.0 * (chain(vj.w, skew(b), *self.relative(j, i), skew(a)) @ vi.w) - turning,)


@dataclass(frozen=True)
class PrintedDot20(AsPrinted):
    """a on body i [-]; arms s_i, s_j to P_i and P_j [m]."""

    a: Vec3
    s_i: Vec3
    s_j: Vec3

    def d(self, i: Pose, j: Pose) -> Vec3:
        """From P_i to P_j, summed in the order of (22)."""
        return j.u + j.A @ self.s_j - i.u - i.A @ self.s_i

    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        """(22)."""
        return ((i.A @ self.a) @ self.d(i, j),)

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        """Table 2."""
        along = chain(self.a, i.A.T)
        p_i = chain(self.a, skew(self.s_i)) - chain(self.d(i, j), i.A, skew(self.a))
        return (Row(-along, p_i, along, -chain(self.a, *self.relative(i, j), skew(self.s_j))),)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        """Table 2."""
        a, W_i, W_j = self.a, skew(vi.w), skew(vj.w)
        sliding = (
            chain(vi.w, skew(a), i.A.T) @ (vi.v - vj.v)
            + chain(self.s_j, W_j, *self.relative(j, i), W_i) @ a
        )
        turning = (
            chain(self.s_i, W_i, W_i) @ a + chain(self.s_j, W_j, W_j, *self.relative(j, i)) @ a
        )
        return (2.0 * sliding - turning - chain(self.d(i, j), i.A, W_i, W_i) @ a,)


@dataclass(frozen=True)
class PrintedDot11(AsPrinted):
    """f, g, h: right-handed orthonormal, h the common axis [-]."""

    f: Vec3
    g: Vec3

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        """(14)."""
        first, second = (chain(a, *self.relative(i, j)) for a in (self.f, self.g))
        return Row(ZERO, self.f, ZERO, -first), Row(ZERO, -self.g, ZERO, second)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        """(16)."""
        first, second = (
            chain(skew(vi.w) @ a, *self.relative(i, j)) @ vj.w for a in (self.f, self.g)
        )
        return first, -second


@dataclass(frozen=True)
class PrintedDot12:
    """C: the constant A_ij of bodies of equal rotation."""

    C: Mat3

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        """(21)."""
        return tuple(
            Row(ZERO, e, ZERO, -c)
            for e, c in zip((X, Y, Z), (self.C.x, self.C.y, self.C.z), strict=True)
        )

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        """Zero."""
        return 0.0, 0.0, 0.0


@dataclass(frozen=True)
class PrintedDot21:
    """f, g: across the line, on body i [-]."""

    f: Vec3
    g: Vec3

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        """Table 2."""
        e, found = j.u - i.u, list[Row]()
        for a in (self.f, self.g):
            along = chain(a, i.A.T)
            found.append(Row(-along, -chain(e, i.A, skew(a)), along, ZERO))
        return tuple(found)

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        """Table 2."""
        e, e_t, W_i = j.u - i.u, vj.v - vi.v, skew(vi.w)
        return tuple(
            2.0 * (chain(e_t, i.A, skew(a)) @ vi.w) + chain(e, i.A, W_i, skew(a)) @ vi.w
            for a in (self.f, self.g)
        )


class Given(Pose):
    """A pose with given A: D holds A itself."""

    @property
    def A(self) -> Mat3:
        return self.D

    def turn(self, a: Vec3) -> Vec3:
        return self.D @ a

    def swing(self, a: Vec3) -> Vec3:
        return self.D @ a - a


@dataclass(frozen=True)
class Condition:
    """A condition of Table 3.

    Attributes:
        primitive: the native primitive: simplified where the paper simplifies.
        dots: the equivalent unsimplified scalar products, one for each row.
    """

    name: str
    primitive: Primitive
    dots: tuple[Dot10 | Dot20, ...]

    @property
    def is_simplified(self) -> bool:
        """Whether the paper has other rows for it than the scalar products."""
        return self.dots != (self.primitive,)

    def simplified(self, style: str) -> tuple[Primitive, ...]:
        """Return the condition in the row style "native" or "paper"."""
        return (self.primitive,) if style == "native" else self.primitive.paper_form()

    def unsimplified(self, style: str) -> tuple[Primitive, ...]:
        """Return the scalar products in the row style "native", "paper" or "conventional"."""
        if style == "native":
            return self.dots
        return tuple(
            form
            for dot in self.dots
            for form in (dot.paper_form() if style == "paper" else dot.conventional_form())
        )

    def printed(self, *, formed: bool) -> tuple[PrintedDot10 | PrintedDot20, ...]:
        """Return the scalar products as printed, for poses with positions in place of displacements
        from the design.
        """
        return tuple(
            PrintedDot10(each.a, each.b, formed=formed)
            if isinstance(each, Dot10)
            else PrintedDot20(each.a, each.s_i, each.s_j, formed=formed)
            for each in self.dots
        )


def conditions(f: Vec3, g: Vec3, h: Vec3, s_i: Vec3, s_j: Vec3) -> tuple[Condition, ...]:
    """Return the conditions of Table 3 for a joint with axes f, g, h and arms s_i, s_j.

    The arms lead to a point common to both bodies at design.
    """
    across = Dot20(f, s_i, s_j, ZERO), Dot20(g, s_i, s_j, ZERO)
    frames_coincide = Dot10(g, h), Dot10(h, f), Dot10(f, g)
    return (
        Condition("d10", frames_coincide[0], frames_coincide[:1]),
        Condition("d11", Dot11(f, g, h), (Dot10(g, h), Dot10(f, h))),
        Condition("d12", Dot12(), frames_coincide),
        Condition("d20", across[0], across[:1]),
        Condition("d21", Dot21(f, g, s_i - s_j), across),
    )
