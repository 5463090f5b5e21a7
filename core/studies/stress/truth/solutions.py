"""Solved samples of a motion, the condition of their equations, and the change of the Jacobian
between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....trajectory import Array
from .evaluation import Poses, cross
from .long_double import Real

# Singular values below this fraction of the largest belong to redundant rows, as in
# `redundancy.RANK_TOLERANCE`.
RANK = 1e-9


# Largest error of a polished sample, as a fraction of its condition: a hundredth of an engine's
# allowed error.
POLISHED = 1e-16


@dataclass(frozen=True, eq=False)
class Solved:
    """Solved samples.

    Attributes:
        times: times of the samples [s], shape (n,).
        angles: angles of the turns, including full turns [rad], shape (turns, n).
        inverse: inverse or pseudo-inverse of the Jacobian, shape (n, unknowns, rows).
        jacobian: shape (n, rows, unknowns).
        v, a: rates and accelerations of the unknowns, shape (bodies, 6, n).
        step: Newton's last step over the condition; above `POLISHED` there is no solution.
    """

    times: Array
    poses: Poses
    angles: Real
    jacobian: Array
    inverse: Array
    v: Real
    a: Real
    step: Array

    @property
    def condition(self) -> Array:
        """Return the condition of the inverse, shape (n,)."""
        return condition(self.inverse)

    def at(self, k: int) -> Solved:
        """Return one sample."""
        one = slice(k, k + 1)
        return Solved(
            self.times[one],
            self.poses.at(one),
            self.angles[:, one],
            self.jacobian[one],
            self.inverse[one],
            self.v[..., one],
            self.a[..., one],
            self.step[one],
        )

    def repeated(self, count: int) -> Solved:
        """Return copies of one sample."""
        lanes = [
            np.repeat(each, count, axis=-1)
            for each in (self.poses.u, self.poses.q, self.angles, self.v, self.a)
        ]
        u, q, angles, v, a = lanes
        first = [
            np.repeat(each, count, axis=0)
            for each in (self.times, self.jacobian, self.inverse, self.step)
        ]
        times, jacobian, inverse, step = first
        return Solved(times, Poses(u, q), angles, jacobian, inverse, v, a, step)


def condition(inverse: Array) -> Array:
    """Return the largest displacement of any unknown [units, rad] per unit error of each row, shape
    (n,).
    """
    return np.maximum(1.0, np.abs(inverse).sum(axis=2).max(axis=1))


def inverted(jacobian: Array) -> Array:
    """Return the inverses, or the pseudo-inverses for redundant rows; NaN if there is none."""
    finite = np.isfinite(jacobian).all(axis=(1, 2), keepdims=True)
    sound = np.where(finite, jacobian, 0.0)
    try:
        if jacobian.shape[1] == jacobian.shape[2]:
            found = np.linalg.inv(sound)
        else:  # full column rank: five times faster than with singular values
            q, r = np.linalg.qr(sound)
            found = np.linalg.inv(r) @ np.moveaxis(q, 1, 2)
    except np.linalg.LinAlgError:  # some matrix is singular; the others have inverses
        found = np.linalg.pinv(sound, rcond=RANK)
    return np.where(finite, found, np.nan)


def changes(knots: Sequence[Solved], nearest: NDArray[np.intp], new: Solved) -> tuple[Array, Array]:
    """Return the change of J from knots to other samples, in all directions and along the step;
    infinite beyond a gap.
    """
    inverse, jacobian = (
        np.concatenate([getattr(k, name) for k in knots])[nearest]
        for name in ("inverse", "jacobian")
    )
    product = inverse @ new.jacobian
    turned = np.linalg.slogdet(product)[0] <= 0.0
    product[:, range(product.shape[1]), range(product.shape[1])] -= 1.0
    whole = np.abs(product).sum(axis=2).max(axis=1)
    way = _way(knots, nearest, new)
    back = (new.inverse @ (jacobian - new.jacobian)) @ way
    longest = np.abs(way).max(axis=(1, 2))
    bent = np.maximum(np.abs(product @ way).max(axis=(1, 2)), np.abs(back).max(axis=(1, 2)))
    along = np.divide(bent, longest, out=np.zeros_like(bent), where=longest > 0.0)
    return np.where(turned, np.inf, whole), np.where(turned, np.inf, along)


def _way(knots: Sequence[Solved], nearest: NDArray[np.intp], new: Solved) -> Array:
    """Return the unknowns' change from knots to other samples, shape (n, unknowns, 1)."""
    u = new.poses.u[1:] - np.concatenate([k.poses.u[1:] for k in knots], axis=-1)[..., nearest]
    q0 = np.concatenate([k.poses.q[1:] for k in knots], axis=-1)[..., nearest]
    turn = 2.0 * _vector(new.poses.q[1:], q0)
    return (
        np.concatenate([u, turn], axis=1).reshape(-1, u.shape[-1]).T[..., None].astype(np.float64)
    )


def _vector(q: Real, p: Real) -> Real:
    """Return the vector part of q p*, shape (bodies, 3, n): half of a small turn from p to q."""
    return p[:, :1] * q[:, 1:] - q[:, :1] * p[:, 1:] - cross(q[:, 1:], p[:, 1:])
