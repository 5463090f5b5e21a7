"""Vectors, quaternions and rotations over any scalar: floats, arrays of lanes, traced scalars,
balls.

The operators are all an equation needs, so a primitive is written once and run by every executor.
Nothing here compares or branches on a value: a traced scalar has none.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias, TypeGuard, cast

import numpy as np
from numpy.typing import NDArray

Scalar: TypeAlias = Any
"""A number of any kind with + - * / and unary minus."""


def root(a: Scalar) -> Scalar:
    """Return the square root of a number, or of lanes."""
    if hasattr(a, "sqrt"):  # a number that knows its own
        return a.sqrt()
    return math.sqrt(a) if isinstance(a, int | float) else np.sqrt(a)


def power(a: Scalar, n: float) -> Scalar:
    """Return a whole positive power as products; the operator ** of numbers without one."""
    if not isinstance(n, int) or n < 1:
        raise TypeError(f"power {n!r}: only whole powers from 1; write / or root for others")
    if n == 1:
        return a
    half = power(a, n // 2)
    return half * half * a if n % 2 else half * half


def is_literal_zero(a: Scalar) -> bool:
    """Return whether it is a Python zero, known before any computation: its products vanish from
    every program.
    """
    return isinstance(a, int | float) and a == 0


def is_array(a: Any) -> TypeGuard[NDArray[Any]]:
    """Return whether a scalar is an array of lanes."""
    return isinstance(a, np.ndarray)


def where_larger(a: Scalar, b: Scalar, p: Scalar, q: Scalar) -> Scalar:
    """Return p if |a| > |b|, else q; a traced number decides at run time, lanes each by their own
    values in double precision.
    """
    later = next((x for x in (a, b) if hasattr(x, "where_larger")), None)
    if later is not None:
        return later.where_larger(a, b, p, q)
    if is_array(a) or is_array(b):
        first, second = (np.abs(np.asarray(x, dtype=np.float64)) for x in (a, b))
        return cast("NDArray[Any]", np.where(first > second, p, q))
    return p if abs(a) > abs(b) else q


def arc_tangent(y: Scalar, x: Scalar) -> Scalar:
    """Return the angle of the direction (x, y) [rad], in -pi..pi, of numbers or of lanes."""
    later = next((each for each in (y, x) if hasattr(each, "arc_tangent")), None)
    return np.arctan2(y, x) if later is None else later.arc_tangent(y, x)


@dataclass(frozen=True, slots=True)
class Vec3:
    """A vector of three scalars; the context sets the axes."""

    __array_ufunc__: ClassVar[None] = None  # an array of lanes times a vector is a vector of arrays
    x: Scalar
    y: Scalar
    z: Scalar

    def __iter__(self) -> Iterator[Scalar]:
        return iter((self.x, self.y, self.z))

    def __add__(self, b: Vec3) -> Vec3:
        return Vec3(self.x + b.x, self.y + b.y, self.z + b.z)

    def __sub__(self, b: Vec3) -> Vec3:
        return Vec3(self.x - b.x, self.y - b.y, self.z - b.z)

    def __neg__(self) -> Vec3:
        return Vec3(-self.x, -self.y, -self.z)

    def __rmul__(self, k: Scalar) -> Vec3:
        return Vec3(k * self.x, k * self.y, k * self.z)

    def __matmul__(self, b: Vec3) -> Scalar:
        """Return the scalar product."""
        return self.x * b.x + self.y * b.y + self.z * b.z


ZERO = Vec3(0.0, 0.0, 0.0)
X, Y, Z = Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 1.0)


def vec(values: Sequence[Scalar]) -> Vec3:
    """Return three scalars as a vector."""
    x, y, z = values
    return Vec3(x, y, z)


def triple(a: Iterable[Any]) -> tuple[float, float, float]:
    """Return a vector of numbers as descriptions of mechanisms have it."""
    x, y, z = map(float, a)
    return x, y, z


def cross(a: Vec3, b: Vec3) -> Vec3:
    """Return the vector product a x b."""
    return Vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)


@dataclass(frozen=True, slots=True)
class Mat3:
    """A 3 x 3 matrix, by rows."""

    x: Vec3
    y: Vec3
    z: Vec3

    def __iter__(self) -> Iterator[Vec3]:
        return iter((self.x, self.y, self.z))

    @property
    def T(self) -> Mat3:
        """The transpose."""
        x, y, z = self.x, self.y, self.z
        return Mat3(Vec3(x.x, y.x, z.x), Vec3(x.y, y.y, z.y), Vec3(x.z, y.z, z.z))

    def __add__(self, B: Mat3) -> Mat3:
        return Mat3(self.x + B.x, self.y + B.y, self.z + B.z)

    def __matmul__(self, a: Vec3) -> Vec3:
        """Return the product with a vector."""
        return Vec3(self.x @ a, self.y @ a, self.z @ a)

    def times(self, B: Mat3) -> Mat3:
        """Return the product with a matrix."""
        columns = B.T
        return Mat3(self @ columns.x, self @ columns.y, self @ columns.z).T


UNIT = Mat3(X, Y, Z)


@dataclass(frozen=True, slots=True)
class Quat:
    """Euler parameters e0 + e of a rotation."""

    e0: Scalar
    e: Vec3

    def __iter__(self) -> Iterator[Scalar]:
        return iter((self.e0, self.e.x, self.e.y, self.e.z))

    def __mul__(self, b: Quat) -> Quat:
        """Return the quaternion product: the rotation b followed, in the same axes, by this one."""
        return Quat(
            self.e0 * b.e0 - self.e @ b.e, self.e0 * b.e + b.e0 * self.e + cross(self.e, b.e)
        )

    def conjugate(self) -> Quat:
        """Return the opposite rotation."""
        return Quat(self.e0, -self.e)


IDENTITY = Quat(1.0, ZERO)


def quat(values: Iterable[Scalar]) -> Quat:
    """Return Euler parameters from a sequence e0, e1, e2, e3; of an array, its rows."""
    e0, x, y, z = values
    return Quat(e0, Vec3(x, y, z))


def angle_about(axis: Vec3, q: Quat) -> Any:
    """Return the angle of a rotation about its unit axis [rad], in the range -2 pi to 2 pi.

    The rotations q and -q are equal, and their angles differ by a turn.
    """
    return 2.0 * np.arctan2(axis @ q.e, q.e0)


def turned_by(q: Quat, half: Vec3) -> Quat:
    """Return the unit quaternion (1, half) q / |(1, half) q|: q turned by about 2 half, global
    axes.

    The rotation applied is 2 atan|half|, which agrees with the exponential to second order. Each
    call normalises, so the length stays one to round-off for any number of steps.
    """
    p = Quat(1.0, half) * q
    length = root(p.e0 * p.e0 + p.e @ p.e)
    k = 1.0 / length
    return Quat(k * p.e0, k * p.e)


def rotation_less_identity(q: Quat) -> Mat3:
    """Return A(q) - I, eq. (1) of the paper with the identity taken off before rounding.

    Near the design pose A - I is small; forming A first would round it at 1e-16 of one rather than
    of itself.
    """
    e0, (x, y, z) = q.e0, q.e
    xx, yy, zz = 2.0 * (x * x), 2.0 * (y * y), 2.0 * (z * z)
    xy, xz, yz = 2.0 * (x * y), 2.0 * (x * z), 2.0 * (y * z)
    wx, wy, wz = 2.0 * (e0 * x), 2.0 * (e0 * y), 2.0 * (e0 * z)
    return Mat3(
        Vec3(-(yy + zz), xy - wz, xz + wy),
        Vec3(xy + wz, -(xx + zz), yz - wx),
        Vec3(xz - wy, yz + wx, -(xx + yy)),
    )
