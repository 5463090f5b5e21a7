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
from collections.abc import Callable, Sequence
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
    rotation_less_identity,
    vec,
)
from ..program.tape import Gradient, Tape, Traced, changes, folded


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
        return a + self.D @ a

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
        traced = _Derivation(self, i, j)
        vectors = [
            vec(traced.values([slopes.get(k + part, 0.0) for part in range(3)]))
            for slopes in changes(traced.tape, traced.phi, traced.slopes)
            for k in range(0, 12, 3)
        ]
        return tuple(Row(*vectors[k : k + 4]) for k in range(0, len(vectors), 4))

    def gamma(self, i: Pose, j: Pose, vi: Twist, vj: Twist) -> tuple[Scalar, ...]:
        """Return the right-hand sides of the acceleration equations: required values of rows .
        acceleration; by default from the derivative of rows and nu.
        """
        traced = _Derivation(self, i, j, vi, vj)
        if type(self).rows is Primitive.rows:
            speeds = traced.rates(traced.phi)
        else:
            pair = traced.i, traced.j
            speeds = [
                row.part("i", traced.vi) + row.part("j", traced.vj) - value
                for row, value in zip(
                    traced.primitive.rows(*pair), traced.primitive.nu(*pair), strict=True
                )
            ]
        return tuple(-x for x in traced.values(traced.rates(speeds)))

    def nu(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        """Return the right-hand sides of the velocity equations: zero unless driven, linear in the
        drive's rate; by default from phi.
        """
        if not hasattr(self, "drive"):
            return (0.0,) * self.n
        traced = _Derivation(self, i, j)
        return tuple(-x for x in traced.values(traced.rates(traced.phi)))

    def branch(self, i: Pose, j: Pose) -> tuple[Scalar, ...]:
        """Return numbers that are positive on the intended branch of phi = 0; empty without
        spurious zeros.
        """
        return ()


class _Derivation:
    """A primitive and the motion of its bodies as inputs of a tape of its own, to differentiate its
    equations by their operations.

    Attributes:
        slopes: derivatives of the inputs of poses by (dr_i, dpi_i, dr_j, dpi_j).
        speeds: derivatives of the inputs by time, at constant velocities.
    """

    def __init__(
        self,
        primitive: Any,
        i: Pose,
        j: Pose,
        vi: Twist = GROUND_TWIST,
        vj: Twist = GROUND_TWIST,
    ) -> None:
        self.tape = Tape()
        self.given: dict[int, Scalar] = {}
        self.i, self.j = (
            Pose(
                self._vector(p.u),
                Quat(self._input(p.q.e0), self._vector(p.q.e)),
                Mat3(*map(self._vector, p.D)),
            )
            for p in (i, j)
        )
        self.vi, self.vj = (Twist(self._vector(t.v), self._vector(t.w)) for t in (vi, vj))
        motion = [x for t in (self.vi, self.vj) for a in (t.v, t.w) for x in a]
        self.slopes: dict[Traced, Gradient] = {}
        for first, pose in ((0, self.i), (6, self.j)):
            turned = [
                [*(Quat(0.0, 0.5 * axis) * pose.q), *(x for c in pose.A.T for x in cross(axis, c))]
                for axis in (X, Y, Z)
            ]
            self.slopes |= {x: {first + k: 1.0} for k, x in enumerate(pose.u)}
            for x, *about in zip(
                (*pose.q, *(x for c in pose.D.T for x in c)), *turned, strict=True
            ):
                self.slopes[x] = {first + 3 + k: slope for k, slope in enumerate(about)}
        self.speeds: dict[Traced, Gradient] = {
            x: {0: sum((k * motion[n] for n, k in slopes.items()), 0.0)}
            for x, slopes in self.slopes.items()
        }
        # numbers of other kinds are inputs too
        self.primitive: Primitive = map_numbers(
            primitive, lambda x: self._input(x) if _is_varied(x) else x, _is_varied
        )
        if hasattr(primitive, "drive"):
            self.primitive = replace(self.primitive, drive=self._lift_drive(primitive.drive))

    @property
    def phi(self) -> tuple[Scalar, ...]:
        """The residuals."""
        return self.primitive.phi(self.i, self.j)

    def rates(self, values: Sequence[Scalar]) -> list[Scalar]:
        """Return the derivatives of traced values by time, at constant velocities."""
        return [each.get(0, 0.0) for each in changes(self.tape, values, self.speeds)]

    def values(self, traced: Sequence[Scalar]) -> list[Scalar]:
        """Return the traced scalars for the motion and the geometry that were given."""
        return folded(self.tape, traced, self.given)

    def _input(self, value: Scalar) -> Traced:
        self.given[len(self.given)] = value
        return self.tape.input(len(self.given) - 1)

    def _vector(self, a: Vec3) -> Vec3:
        return vec([*map(self._input, a)])

    def _lift_drive(self, drive: Drive) -> Drive:
        given = {each.name: self._input(getattr(drive, each.name)) for each in fields(drive)}
        driven = Drive(**given)
        half = 0.5 * driven.c_t
        for x, speed in (
            (driven.c, driven.c_t),
            (driven.c_t, driven.c_tt),
            (driven.half_cos, -driven.half_sin * half),
            (driven.half_sin, driven.half_cos * half),
        ):
            self.speeds[x] = {0: speed}
        return driven


def _is_varied(value: Any) -> bool:
    """Return whether a value is a number of another kind, such as one of varied geometry."""
    return hasattr(value, "__truediv__") and not isinstance(value, int | float | complex)


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
