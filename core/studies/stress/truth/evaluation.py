"""Evaluation of the conditions at poses of many samples at once: residuals, Jacobian, and the
second derivative without J times the accelerations.

Quaternions give the rotations of bodies since the design. The unknowns of a body are its
translation and its rotation in global axes (dA = w x A). Let s be an arm, r = w x (w x s) and a' =
w x a. The first derivatives and the parts beyond are

    dot     (a . b)'   = w_i . (a x b) + w_j . (b x a)
                       beyond: a'' . b + 2 a' . b' + a . b''
    slide   (a . d)'   = w_i . (a x d) + a . d',  d' = v_j + w_j x s_j - v_i - w_i x s_i
                       beyond: a'' . d + 2 a' . d' + a . (r_j - r_i)
    rod     d . d' / L
                       beyond: (d' . d' + d . (r_j - r_i)) / L
    turn    h_i . (w_j - w_i)
                       beyond: h_i' . (w_j - w_i)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .constraint_rows import Conditions, Term
from .long_double import PI, Real, extended

Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of all bodies over n samples; body 0 is the ground.

    Attributes:
        u: displacement of the centres [units], shape (bodies + 1, 3, n).
        q: rotation since the design, unit quaternions, shape (bodies + 1, 4, n).
    """

    u: Real
    q: Real

    @staticmethod
    def design(bodies: int, n: int) -> Poses:
        """Return all bodies at the design position."""
        q = np.zeros((bodies + 1, 4, n), dtype=np.longdouble)
        q[:, 0] = 1.0
        return Poses(np.zeros((bodies + 1, 3, n), dtype=np.longdouble), q)

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.u.shape[-1]

    @cached_property
    def turned(self) -> Real:
        """R - I, shape (bodies + 1, 3, 3, n); exactly zero at the design."""
        e0, x, y, z = np.moveaxis(self.q, 1, 0)
        rows = (
            (-(y * y + z * z), x * y - e0 * z, x * z + e0 * y),
            (x * y + e0 * z, -(x * x + z * z), y * z - e0 * x),
            (x * z - e0 * y, y * z + e0 * x, -(x * x + y * y)),
        )
        return 2.0 * np.moveaxis(np.array(rows), 2, 0)

    def at(self, samples: Indices | slice) -> Poses:
        """Return some of the samples."""
        return Poses(self.u[..., samples], self.q[..., samples])

    def moved(self, step: Real) -> Poses:
        """Return the poses after a step of every body: translation, rotation, (bodies, 6, n)."""
        u, q = self.u.copy(), self.q.copy()
        u[1:] += step[:, :3]
        q[1:] += 0.5 * spun(step[:, 3:], q[1:])
        # tangent step and projection onto the sphere turn by 2 atan(|w| / 2): |w| up to third order
        return Poses(u, q / np.sqrt((q * q).sum(axis=1, keepdims=True)))


def spun(w: Real, q: Real) -> Real:
    """Return the quaternion product (0, w) q, shape (bodies, 4, n)."""
    vector = w * q[:, :1] + cross(w, q[:, 1:])
    return np.concatenate([-(w * q[:, 1:]).sum(axis=1, keepdims=True), vector], axis=1)


def cross(a: Real, b: Real) -> Real:
    """Return the cross product along axis 1."""
    ax, ay, az, bx, by, bz = a[:, 0], a[:, 1], a[:, 2], b[:, 0], b[:, 1], b[:, 2]
    first = ay * bz - az * by
    found = np.empty((len(first), 3, *first.shape[1:]), dtype=first.dtype)
    found[:, 0], found[:, 1], found[:, 2] = first, az * bx - ax * bz, ax * by - ay * bx
    return found


def inner(a: Real, b: Real) -> Real:
    """Return the scalar product along axis 1."""
    return (a * b).sum(axis=1)


@dataclass(frozen=True, eq=False)
class _Kind:
    """The terms of one kind as arrays: bodies, rows and weights (m,), vectors (m, 3, 1)."""

    i: Indices
    j: Indices
    row: Indices
    weight: Real
    vectors: Sequence[Real]

    @staticmethod
    def of(terms: Sequence[Term]) -> _Kind | None:
        if not terms:
            return None
        i, j, row = (np.array([getattr(t, name) for t in terms]) for name in ("i", "j", "row"))
        vectors = [
            np.stack(each)[..., None] for each in zip(*(t.vectors for t in terms), strict=True)
        ]
        return _Kind(i, j, row, extended([t.weight for t in terms])[:, None], vectors)


class Evaluator:
    """The rows of a mechanism at poses."""

    def __init__(self, stated: Conditions) -> None:
        self.stated, self.bodies = stated, len(stated.bodies)
        self.dots, self.slides, self.rods, self.turns = (
            _Kind.of(each) for each in (stated.dots, stated.slides, stated.rods, stated.turns)
        )

    @property
    def unknowns(self) -> int:
        """Number of unknowns: six for each moving body."""
        return 6 * self.bodies

    def angles(self, poses: Poses) -> Real:
        """Return the angle of every turn, within half a turn of zero [rad], shape (turns, n)."""
        k = self.turns
        if k is None:
            return np.zeros((0, poses.samples), dtype=np.longdouble)
        f_i, g_i, f_j = (
            _carried(poses, b, a)
            for b, a in ((k.i, k.vectors[0]), (k.i, k.vectors[1]), (k.j, k.vectors[0]))
        )
        return np.arctan2(inner(g_i, f_j), inner(f_i, f_j))

    def residual(self, poses: Poses, driven: Real, near: Real) -> Real:
        """Return the residuals of all rows, shape (rows, n).

        Args:
            driven: values of the drivers [m or rad], shape (drivers, n).
            near: angles near those of the turns [rad], shape (turns, n).
        """
        found = np.repeat(-self.stated.constants[:, None], poses.samples, axis=1)
        for row, values in self._values(poses, near):
            np.add.at(found, row, values)
        for (row, size), value in zip(self.stated.driven, driven, strict=True):
            found[row] -= extended(size) * value
        return found

    def _values(self, poses: Poses, near: Real) -> list[tuple[Indices, Real]]:
        found: list[tuple[Indices, Real]] = []
        if k := self.dots:
            found.append(
                (
                    k.row,
                    k.weight
                    * inner(_carried(poses, k.i, k.vectors[0]), _carried(poses, k.j, k.vectors[1])),
                )
            )
        if k := self.slides:
            found.append(
                (k.row, k.weight * inner(_carried(poses, k.i, k.vectors[0]), _line(poses, k, 1)[0]))
            )
        if k := self.rods:
            d, length = _line(poses, k, 0)[0], k.vectors[3][:, 0]
            found.append((k.row, k.weight * (inner(d, d) - length * length) / (2.0 * length)))
        if k := self.turns:
            angle = self.angles(poses)
            whole = 2.0 * PI * np.rint((near - angle) / (2.0 * PI))
            found.append((k.row, k.weight * (angle + whole)))
        return found

    def jacobian(self, poses: Poses) -> NDArray[np.float64]:
        """Return the derivative of the rows by the unknowns in doubles, shape
        (n, rows, unknowns).
        """
        found = np.zeros((self.stated.rows, self.bodies + 1, 6, poses.samples))
        for k, parts in self._gradients(poses):
            for body, (shift, turn) in zip((k.i, k.j), parts, strict=True):
                if shift is not None:
                    np.add.at(
                        found[:, :, :3],
                        (k.row, body),
                        (k.weight[..., None] * shift).astype(np.float64),
                    )
                np.add.at(
                    found[:, :, 3:], (k.row, body), (k.weight[..., None] * turn).astype(np.float64)
                )
        return np.ascontiguousarray(
            np.moveaxis(found[:, 1:].reshape(self.stated.rows, self.unknowns, -1), -1, 0)
        )

    def _gradients(self, poses: Poses) -> list[tuple[_Kind, list[tuple[Real | None, Real]]]]:
        """Return for each kind the derivatives by translation and rotation of body i, then of body
        j, each of shape (m, 3, n).
        """
        found: list[tuple[_Kind, list[tuple[Real | None, Real]]]] = []
        if k := self.dots:
            a, b = _carried(poses, k.i, k.vectors[0]), _carried(poses, k.j, k.vectors[1])
            turning = cross(a, b)
            found.append((k, [(None, turning), (None, -turning)]))
        if k := self.slides:
            a, (d, s_i, s_j) = _carried(poses, k.i, k.vectors[0]), _line(poses, k, 1)
            found.append((k, [(-a, cross(a, d) - cross(s_i, a)), (a, cross(s_j, a))]))
        if k := self.rods:
            d, s_i, s_j = _line(poses, k, 0)
            a = d / k.vectors[3][:, :1]
            found.append((k, [(-a, -cross(s_i, a)), (a, cross(s_j, a))]))
        if k := self.turns:
            h = _carried(poses, k.i, k.vectors[2])
            found.append((k, [(None, -h), (None, h)]))
        return found

    def beyond(self, poses: Poses, rates: Real) -> Real:
        """Return the rows' second time derivative minus J times the accelerations, shape (rows, n).

        Args:
            rates: rates of the unknowns, shape (bodies, 6, n).
        """
        found = np.zeros((self.stated.rows, poses.samples), dtype=np.longdouble)
        still = np.zeros((1, 3, poses.samples), dtype=np.longdouble)
        v, w = (np.concatenate([still, rates[:, part]]) for part in (slice(0, 3), slice(3, 6)))

        def swing(body: Indices, a: Real) -> tuple[Real, Real]:
            first = cross(w[body], a)
            return first, cross(w[body], first)

        def parting(k: _Kind, s_i: Real, s_j: Real) -> tuple[Real, Real]:
            (at_i, bent_i), (at_j, bent_j) = swing(k.i, s_i), swing(k.j, s_j)
            return v[k.j] + at_j - v[k.i] - at_i, bent_j - bent_i

        if k := self.dots:
            a, b = _carried(poses, k.i, k.vectors[0]), _carried(poses, k.j, k.vectors[1])
            (a_t, a_tt), (b_t, b_tt) = swing(k.i, a), swing(k.j, b)
            np.add.at(
                found, k.row, k.weight * (inner(a_tt, b) + 2.0 * inner(a_t, b_t) + inner(a, b_tt))
            )
        if k := self.slides:
            a, (d, s_i, s_j) = _carried(poses, k.i, k.vectors[0]), _line(poses, k, 1)
            (a_t, a_tt), (d_t, bent) = swing(k.i, a), parting(k, s_i, s_j)
            np.add.at(
                found, k.row, k.weight * (inner(a_tt, d) + 2.0 * inner(a_t, d_t) + inner(a, bent))
            )
        if k := self.rods:
            d, s_i, s_j = _line(poses, k, 0)
            d_t, bent = parting(k, s_i, s_j)
            np.add.at(
                found, k.row, k.weight * (inner(d_t, d_t) + inner(d, bent)) / k.vectors[3][:, 0]
            )
        if k := self.turns:
            h_t, _ = swing(k.i, _carried(poses, k.i, k.vectors[2]))
            np.add.at(found, k.row, k.weight * inner(h_t, w[k.j] - w[k.i]))
        return found


def _carried(poses: Poses, body: Indices, a: Real) -> Real:
    """Return vectors of bodies in their current directions, shape (m, 3, n)."""
    return a + (poses.turned[body] * a[:, None]).sum(axis=2)


def _line(poses: Poses, k: _Kind, first: int) -> tuple[Real, Real, Real]:
    """Return d and the arms of body i and j; vectors first, first + 1, first + 2 are the arms and
    d at design.
    """
    s_i, s_j, d0 = (k.vectors[first + each] for each in range(3))
    now_i, now_j = _carried(poses, k.i, s_i), _carried(poses, k.j, s_j)
    return d0 + (poses.u[k.j] + (now_j - s_j)) - (poses.u[k.i] + (now_i - s_i)), now_i, now_j
