"""The paper's equations as printed, and operation counts of Table 3: multiplications and additions
of rows between two moving bodies.

One counter traces the rows as the solver does and counts the program: equal operations are shared,
zeros and ones fold. The other counts executed operations, full matrix products included.

The rows of Tables 1 and 2 stand here as they are printed (as corrected, formulation section 9):
full matrices, multiplied from the left.

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

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import count, pairwise
from operator import add
from typing import Protocol

import msgspec

from ....algebra import IDENTITY, ZERO, Mat3, Scalar, Vec3, X, Y, Z
from ....primitives import Dot10, Dot11, Dot12, Dot20, Dot21, Pose, Primitive, Row, Twist
from ....program import Tape, program
from .rows import conventional_form, paper_form


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

    def simplified_rows(self, style: str) -> tuple[Primitive, ...]:
        """Return the condition in the row style "native" or "paper"."""
        return (self.primitive,) if style == "native" else paper_form(self.primitive)

    def unsimplified_rows(self, style: str) -> tuple[Primitive, ...]:
        """Return the scalar products in the row style "native", "paper" or "conventional"."""
        if style == "native":
            return self.dots
        return tuple(
            form
            for dot in self.dots
            for form in (paper_form(dot) if style == "paper" else conventional_form(dot))
        )

    def printed_rows(self, *, formed: bool) -> tuple[PrintedDot10 | PrintedDot20, ...]:
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


# Counts

CONVENTIONS = (
    (
        "Multiplications and additions for one pair of moving bodies; signs are free; A(p) of both"
        " bodies is given. J: the rows. velocity: J and Jv. acceleration: J, gamma and Ja - gamma."
        " gamma: that alone, from A."
    ),
    (
        "dot products: d10 or d20 for each row, nothing simplified. simplified: the rows of d11,"
        " d12 and d21."
    ),
    (
        "as printed: each row by itself, a vector times full matrices from the left, zeros of skew"
        " matrices included; only d, the line between the points, and A a are kept. multiplied out:"
        " A_i^T A_j is formed wherever it is printed (45 operations); from the left: the vector"
        " goes through both factors (30). d12 takes A_i^T A_j as a constant that is given."
    ),
    (
        "traced: the rows as the solver has them. What is equal is done once, over all rows and"
        " stages of a line; zeros and ones fold; what constants make among themselves is done"
        " beforehand. Body axes are parallel at design, where P_i and P_j coincide. conventional"
        " and paper's axes form A_i^T A_j once (45); native axes are global and need none."
    ),
    (
        "general axes: f, g, h and the arms are general numbers. unit axes: f, g, h are the axes of"
        " the bodies."
    ),
)

# A near figure differs by a few percent: a sum or a sign counted otherwise.
NEARLY = 0.03


class Operations(msgspec.Struct, frozen=True):
    """Multiplications and additions of each stage, by CONVENTIONS; null if unknown."""

    jacobian: int
    velocity: int
    acceleration: int
    gamma: int | None = None


class Counted(msgspec.Struct, frozen=True):
    """A condition of Table 3, in one form (`way`) and by one counter.

    Attributes:
        rows: DOTS or SIMPLIFIED; d10 and d20 are dot products themselves.
        unit_axes: with joint axes along body axes; null if nothing folds.
    """

    condition: str
    rows: str
    way: str
    general_axes: Operations
    unit_axes: Operations | None = None


DOTS, SIMPLIFIED = "dot products", "simplified"
TABLE_3, MULTIPLIED_OUT, FROM_THE_LEFT = (
    "printed in Table 3",
    "as printed, multiplied out",
    "as printed, from the left",
)
AXES = {"conventional": "conventional", "paper": "paper's axes", "native": "native axes"}
TRACED = {style: f"{axes}, traced" for style, axes in AXES.items()}
"""Row style -> name of its counts: full, or vector products in body or global axes."""

# d10's velocity is printed as "-159"; d21's acceleration may lack a zero (formulation 8.1).
PRINTED = {
    "d10": Operations(150, 159, 277),
    "d11": Operations(48, 57, 137),
    "d12": Operations(0, 5, 5),
    "d20": Operations(144, 167, 398),
    "d21": Operations(36, 66, 18),
}


class Executed:
    """A scalar with a count of its operations, except multiplications by literal ones and signs."""

    def __init__(self, tally: list[int]) -> None:
        self.tally = tally

    def _count(self, other: Scalar) -> Executed:
        self.tally[0] += 1
        return self

    __add__ = __radd__ = __sub__ = __rsub__ = _count

    def __mul__(self, other: Scalar) -> Executed:
        free = isinstance(other, float) and abs(other) == 1.0
        return self if free else self._count(other)

    __rmul__ = __mul__

    def __neg__(self) -> Executed:
        return self


@dataclass(frozen=True)
class Pair:
    """Two moving bodies, their velocities and accelerations."""

    i: Pose
    j: Pose
    vi: Twist
    vj: Twist
    ai: Twist
    aj: Twist

    @staticmethod
    def of(number: Callable[[], Scalar]) -> Pair:
        """Return a pair with all its numbers from a source."""

        def vector() -> Vec3:
            return Vec3(number(), number(), number())

        i, j = (Given(vector(), IDENTITY, Mat3(vector(), vector(), vector())) for _ in range(2))
        return Pair(i, j, *(Twist(vector(), vector()) for _ in range(4)))


def stages(equations: Sequence[Countable], pair: Pair) -> Iterator[list[Scalar]]:
    """Yield what the stages compute: the entries of J, Jv, gamma, and Ja - gamma."""
    rows = [row for each in equations for row in each.rows(pair.i, pair.j)]
    yield [x for row in rows for block in row for x in block]
    yield _times(rows, pair.vi, pair.vj)
    gamma = [x for each in equations for x in each.gamma(pair.i, pair.j, pair.vi, pair.vj)]
    yield gamma
    yield _less(_times(rows, pair.ai, pair.aj), gamma)


def count_executed(equations: Sequence[Countable], pair: Pair, tally: list[int]) -> Operations:
    """Return the operations of executed rows; the pair's numbers add to the tally."""
    totals = [tally[0], *(tally[0] for _ in stages(equations, pair))]
    jacobian, velocity, gamma, acceleration = (b - a for a, b in pairwise(totals))
    return Operations(jacobian, jacobian + velocity, jacobian + gamma + acceleration, gamma)


def count_traced(equations: Sequence[Countable]) -> Operations:
    """Return the operations of the traced programs of rows."""
    tape, slots = Tape(), count()
    pair = Pair.of(lambda: tape.input(next(slots)))
    entries, velocity, gamma, acceleration = stages(equations, pair)

    def cost(values: Sequence[Scalar]) -> int:
        found = program("counted", tape, dict(enumerate(values))).operations
        return found["+"] + found["-"] + found["*"]

    return Operations(
        cost(entries), cost([*entries, *velocity]), cost([*entries, *acceleration]), cost(gamma)
    )


def _times(rows: Sequence[Row], i: Twist, j: Twist) -> list[Scalar]:
    """Return the rows times the velocities or accelerations of both bodies, without zero blocks."""
    found: list[Scalar] = []
    for row in rows:
        terms = [
            k * x
            for block, values in zip(row, (i.v, i.w, j.v, j.w), strict=True)
            for k, x in zip(block, values, strict=True)
            if not (isinstance(k, float) and k == 0.0)
        ]
        found.append(reduce(add, terms))
    return found


def _less(left: Sequence[Scalar], right: Sequence[Scalar]) -> list[Scalar]:
    """Return the differences; a literal zero on the right costs nothing."""
    return [
        a if isinstance(b, float) and b == 0.0 else a - b for a, b in zip(left, right, strict=True)
    ]


def count_operations() -> list[Counted]:
    """Return Table 3 beside our counts, condition by condition."""
    found = [
        Counted(name, SIMPLIFIED if name in ("d11", "d12", "d21") else DOTS, TABLE_3, each)
        for name, each in PRINTED.items()
    ]
    tally = [0]
    pair = Pair.of(lambda: Executed(tally))
    for name, rows, way, equations in _as_printed(
        lambda: Vec3(*(Executed(tally) for _ in range(3)))
    ):
        found.append(Counted(name, rows, way, count_executed(equations, pair, tally)))
    # general numbers: no two equal, none a sum or a product of others
    f, g, h, s_i, s_j = (Vec3(0.137 + k, -0.731 * k - 0.29, 0.457 - 1.193 * k) for k in range(5))
    for both in zip(conditions(f, g, h, s_i, s_j), conditions(X, Y, Z, s_i, s_j), strict=True):
        for style, way in TRACED.items():
            found.append(
                Counted(
                    both[0].name,
                    DOTS,
                    way,
                    *(count_traced(each.unsimplified_rows(style)) for each in both),
                )
            )
        if both[0].is_simplified:
            for style in ("paper", "native"):
                counts = (count_traced(each.simplified_rows(style)) for each in both)
                found.append(Counted(both[0].name, SIMPLIFIED, TRACED[style], *counts))
    # stable: keeps the order of counting within a condition
    return sorted(found, key=lambda each: each.condition)


def _as_printed(vector: Callable[[], Vec3]) -> Iterator[tuple[str, str, str, Sequence[Countable]]]:
    """Yield condition, rows, form and equations of the printed tables, from constants."""
    f, g, h, s_i, s_j, *constant = (vector() for _ in range(8))
    for way, formed in ((MULTIPLIED_OUT, True), (FROM_THE_LEFT, False)):
        simplified: dict[str, Countable] = {"d11": PrintedDot11(f, g, formed=formed)}
        if formed:  # these have no product with two orders
            simplified |= {"d12": PrintedDot12(Mat3(*constant)), "d21": PrintedDot21(f, g)}
        for condition in conditions(f, g, h, s_i, s_j):
            yield condition.name, DOTS, way, condition.printed_rows(formed=formed)
            if condition.name in simplified:
                yield condition.name, SIMPLIFIED, way, [simplified[condition.name]]


def verdict(counts: Sequence[Counted]) -> list[str]:
    """Return the conclusions from the counts."""
    by = {(each.condition, each.rows, each.way): each.general_axes for each in counts}
    simplified = [
        each.condition for each in counts if each.rows == SIMPLIFIED and each.way == TABLE_3
    ]
    said: list[str] = []
    products: list[float] = []
    geometry: list[float] = []
    for style in ("paper", "native"):
        for stage, letter in (("jacobian", "J"), ("gamma", "gamma")):
            steps: list[str] = []
            for name in simplified:
                ways = (DOTS, MULTIPLIED_OUT), (DOTS, TRACED[style]), (SIMPLIFIED, TRACED[style])
                full, dots, simple = (getattr(by[name, *way], stage) for way in ways)
                steps.append(f"{name} {full} > {dots} > {simple}")
                products.append(full / dots)
                geometry += [dots / simple] if simple else []
            said.append(f"{letter} in {AXES[style]}: {', '.join(steps)}")
    return [
        (
            "Full matrices multiplied out > the same dot products by vectors, nothing twice >"
            f" simplified: {'; '.join(said)}."
        ),
        (
            "Not multiplying full matrices, and nothing twice, gains a factor of"
            f" {min(products):.1f} to {max(products):.1f}; the simplification itself"
            f" {min(geometry):.1f} to {max(geometry):.1f}, and everything where nothing is left"
            " (d12)."
        ),
        _met(counts, by["d21", SIMPLIFIED, MULTIPLIED_OUT].gamma),
    ]


def _met(counts: Sequence[Counted], gamma: int | None) -> str:
    """Return the figures of Table 3 met, or nearly met, by a count."""
    met: list[str] = []
    nearly: list[str] = []
    for name, row in PRINTED.items():
        ours = [
            o
            for c in counts
            if c.condition == name and c.way != TABLE_3
            for o in (c.general_axes, c.unit_axes)
            if o
        ]
        for stage in ("jacobian", "velocity", "acceleration"):
            value = getattr(row, stage)
            nearest = min(
                (getattr(each, stage) for each in ours), key=lambda each: abs(each - value)
            )
            if nearest == value:
                met.append(f"{name} {stage} {value}")
            elif abs(nearest - value) <= NEARLY * value:
                nearly.append(f"{name} {stage} {value} ({nearest})")
    return (
        f"No one convention gives Table 3. Of its 15 figures some count meets {len(met)}"
        f" ({', '.join(met)}), and {len(nearly)} to {NEARLY:.0%} ({', '.join(nearly)}). d21's"
        f" acceleration, 18, is less than its Jacobian: gamma as printed takes {gamma}."
    )
