"""What a primitive sees of its two bodies, and what it gives back.

Conventions of every primitive (formulation section 1, in the native row style):

- The state of a body is its displacement u from the design position and the rotation q since then.
  Body axes are parallel to the global ones at design, so a body-fixed vector a is given by its
  global components at design; now it is A a.
- Unknowns per body are (dr, dpi) with dpi the virtual rotation in global axes; velocities are (v,
  w), accelerations (vdot, wdot), all global.
- Phi = 0;  rows . velocity = nu;  rows . acceleration = gamma.
- The ground is a body that never moves: its u, D, v and w are literal zeros and vanish from every
  program.

These rows are the paper's times A^T. The paper's own, in body axes, and conventional ones by full
matrix products are in `core.extensions.laboratory.paper.rows`, to measure the paper's claims.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from typing import Any, ClassVar, NamedTuple, cast

from ..algebra import (
    IDENTITY,
    UNIT,
    ZERO,
    Mat3,
    Quat,
    Scalar,
    Vec3,
    X,
    Y,
    Z,
    cross,
    quat,
    rotation_less_identity,
    vec,
)
from ..program.moving import Moving, changes_of


@dataclass(frozen=True, slots=True)
class Pose:
    """Pose of a body: displacement u of its origin, rotation q since design, D = A(q) - I."""

    u: Vec3
    q: Quat
    D: Mat3

    @staticmethod
    def of(u: Vec3, q: Quat) -> Pose:
        """Return the pose with displacement u and rotation q."""
        return Pose(u, q, rotation_less_identity(q))

    def swing(self, a: Vec3) -> Vec3:
        """Return A a - a: the change of a body-fixed vector since design."""
        return self.D @ a

    def turn(self, a: Vec3) -> Vec3:
        """Return A a: a body-fixed vector now, global axes."""
        return a + self.swing(a)

    @property
    def A(self) -> Mat3:
        """The rotation since design, body -> global."""
        return UNIT + self.D


@dataclass(frozen=True, slots=True)
class Twist:
    """Motion of a body: velocity v of its origin and angular velocity w, global axes."""

    v: Vec3
    w: Vec3

    def of(self, arm: Vec3) -> Vec3:
        """Return the velocity of the point at the end of the (turned) arm."""
        return self.v + cross(self.w, arm)

    def centripetal(self, arm: Vec3) -> Vec3:
        """Return w x (w x arm): the acceleration of the point without vdot and wdot."""
        return cross(self.w, cross(self.w, arm))


GROUND_POSE = Pose.of(ZERO, IDENTITY)
GROUND_TWIST = Twist(ZERO, ZERO)


class Row(NamedTuple):
    """One row of the Jacobian: coefficients of dr_i, dpi_i, dr_j, dpi_j, global axes."""

    ri: Vec3
    pi: Vec3
    rj: Vec3
    pj: Vec3

    def part(self, body: str, twist: Twist) -> Scalar:
        """Return the part of row . velocity of one body, "i" or "j"."""
        return (
            self.ri @ twist.v + self.pi @ twist.w
            if body == "i"
            else self.rj @ twist.v + self.pj @ twist.w
        )


@dataclass(frozen=True)
class Drive:
    """The motion of a driver, as it enters an equation: value c and its derivatives by time.

    half_cos and half_sin are those of c/2, for a driven angle; programs call no transcendental
    function themselves.
    """

    c: Scalar = 0.0
    c_t: Scalar = 0.0
    c_tt: Scalar = 0.0
    half_cos: Scalar = 1.0
    half_sin: Scalar = 0.0


@dataclass(frozen=True)
class Primitive(ABC):
    """One geometric condition between bodies i and j. Fields are body-fixed vectors, given by their
    components at design.
    """

    n: ClassVar[int]
    """Number of equations."""
    steady: ClassVar[bool] = False
    """Whether the rows keep their directions as body i turns."""

    @abstractmethod
    def phi(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        """Return the residuals; zero when the condition holds. Lengths [m] or plain numbers."""

    def rows(self, i: Pose, j: Pose) -> tuple[Row, ...]:
        """Return the rows of the Jacobian; by default the derivative of phi, without the terms that
        a simplified row leaves out.
        """
        lifted = _Derivation(self, i, j)
        return tuple(map(lifted.row, lifted.phi))

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        """Return the right-hand sides of the acceleration equations: required values of rows .
        acceleration; by default from the derivative of rows and nu.
        """
        inner = _Derivation(self, i, j)
        pair, own = inner.pair, inner.primitive
        if type(self).rows is Primitive.rows:
            outer = _Derivation(own, *pair)
            speeds = outer.rates(outer.phi, vi, vj)
        else:
            speeds = [
                row.part("i", vi) + row.part("j", vj) - value
                for row, value in zip(own.rows(*pair), own.nu(*pair), strict=True)
            ]
        return tuple(-x for x in inner.rates(speeds, vi, vj))

    def nu(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        """Return the right-hand sides of the velocity equations: zero unless driven, linear in the
        drive's rate; by default from phi.
        """
        if not hasattr(self, "drive"):
            return (0.0,) * self.n
        lifted = _Derivation(self, i, j)
        return tuple(-x for x in lifted.rates(lifted.phi, GROUND_TWIST, GROUND_TWIST))

    def branch(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        """Return numbers that are positive on the intended branch of phi = 0; empty without
        spurious zeros.
        """
        return ()


class _Lifted(Pose):
    """A pose of body "i" or "j" in a derivation: its numbers move, and each vector turned by it.

    Attributes:
        turned: these vectors, by their keys.
    """

    body: str
    given: Pose
    turned: dict[Hashable, Vec3]
    kept: list[Vec3]

    def __init__(self, body: str, given: Pose) -> None:
        numbers: dict[str, object] = {
            "u": vec(_moving(given.u, body, "u")),
            "q": quat(_moving(given.q, body, "q")),
            "body": body,
            "given": given,
            "turned": {},
            "kept": [],
        }
        for name, value in numbers.items():
            object.__setattr__(self, name, value)

    def __getattr__(self, name: str) -> Mat3:
        if name != "D":
            raise AttributeError(name)
        return Mat3(*map(self.swing, (X, Y, Z))).T  # few equations read it

    def swing(self, a: Vec3) -> Vec3:
        key, found = tuple(map(id, a)), self.given.swing(a)
        self.turned[key] = a + found
        self.kept.append(a)  # an identity is that of another number once this one is gone
        return vec(_moving(found, self.body, key))


class _Derivation:
    """A primitive and the poses of its bodies as numbers that move: with u, with the Euler
    parameters q, and with each vector that a body turns, whose change is a vector product with the
    rotation. So derived equations have the operations of those written by hand.
    """

    def __init__(self, primitive: Any, i: Pose, j: Pose) -> None:
        self.pair = _Lifted("i", i), _Lifted("j", j)
        self.primitive: Primitive = primitive
        self._drive: Drive | None = getattr(primitive, "drive", None)
        if self._drive:
            numbers = [getattr(self._drive, each.name) for each in fields(Drive)]
            self.primitive = replace(primitive, drive=Drive(*_moving(numbers, "drive", "")))

    @property
    def phi(self) -> tuple[Scalar, ...]:
        """The residuals."""
        return self.primitive.phi(*self.pair)

    def row(self, value: Scalar) -> Row:
        """Return the derivatives of a number by (dr_i, dpi_i, dr_j, dpi_j)."""
        by, found = changes_of(value), list[Vec3]()

        def of(*part: Hashable, count: int = 3) -> list[Scalar]:
            return [by.get((*part, k), 0.0) for k in range(count)]

        used = {key[:2] for key in by}
        for pose in self.pair:
            about = ZERO
            for key, arm in pose.turned.items():
                if (pose.body, key) in used:
                    about = about + cross(arm, vec(of(pose.body, key)))
            if (pose.body, "q") in used:
                g, q = quat(of(pose.body, "q", count=4)), pose.given.q
                about = about + 0.5 * ((q.e0 * g.e - g.e0 * q.e) + cross(q.e, g.e))
            found += vec(of(pose.body, "u")), about
        return Row(*found)

    def rates(self, values: Iterable[Scalar], vi: Twist, vj: Twist) -> list[Scalar]:
        """Return the derivatives of numbers by time, at constant velocities."""
        speeds: dict[tuple[str, Hashable], Iterable[Scalar]] = {}
        for pose, twist in zip(self.pair, (vi, vj), strict=True):
            speeds[pose.body, "u"] = twist.v
            speeds[pose.body, "q"] = Quat(0.0, 0.5 * twist.w) * pose.given.q
            speeds |= {(pose.body, key): cross(twist.w, a) for key, a in pose.turned.items()}
        if drive := self._drive:
            half = 0.5 * drive.c_t
            turning = -drive.half_sin * half, drive.half_cos * half
            speeds["drive", ""] = drive.c_t, drive.c_tt, 0.0, *turning
        speed = {(*part, k): x for part, each in speeds.items() for k, x in enumerate(each)}
        return [sum((slope * speed[k] for k, slope in changes_of(x).items()), 0.0) for x in values]


def _moving(values: Iterable[Scalar], *part: Hashable) -> list[Moving]:
    return [Moving(x, {(*part, k): 1.0}) for k, x in enumerate(values)]


def map_numbers(
    value: Any, change: Callable[[Any], Any], is_number: Callable[[Any], bool] | None = None
) -> Any:
    """Return a value with its numbers, and all else that has no parts, passed to a function; the
    parts of tuples, lists, dictionaries and data classes are looked into.

    Args:
        is_number: whether a value is one number, although it may have parts.
    """

    def map_part(part: Any) -> Any:
        if is_number is not None and is_number(part):
            return change(part)
        if isinstance(part, tuple | list):
            parts = cast("tuple[Any, ...]", part)
            return (
                [*map(map_part, parts)] if isinstance(part, list) else tuple(map(map_part, parts))
            )
        if isinstance(part, dict):
            return {key: map_part(each) for key, each in cast("dict[Any, Any]", part).items()}
        names = field_names(part.__class__)
        if names is None:
            return change(part)
        new = {name: map_part(getattr(part, name)) for name in names}
        return replace(part, **{k: x for k, x in new.items() if x is not getattr(part, k)})

    return map_part(value)


@cache
def field_names(kind: Any) -> tuple[str, ...] | None:
    """Return the names of the fields of a data class; None of another type."""
    return tuple(each.name for each in fields(kind)) if is_dataclass(kind) else None
