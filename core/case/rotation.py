"""Rotations of bodies by the directions of their markers: Euler parameters, rotation vectors, and
the turns of an angle or of a body along a sweep.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..algebra import Vec3, cross, quat
from ..jet import Jet, arctan2, doubles, sqrt
from ..trajectory import Array

# Below this square of |e| = sin(angle / 2) a series is exact in double precision, and a quotient by
# |e| loses digits.
_SMALL, _TERMS = 1e-3, 7


def euler_parameters(x: Vec3, y: Vec3) -> list[Jet]:
    """Return e0..e3 of the rotation from the global x and y axes to the unit vectors x and y.

    The parameters and their negatives are the same rotation, and either is returned; `signs` tells
    which along a sweep. The largest of e0..e3 is found by a root and the others by division by it,
    so that none is singular.
    """
    z = cross(x, y)
    products: list[list[Jet]] = [  # 4 e_i e_j
        [1.0 + x.x + y.y + z.z, y.z - z.y, z.x - x.z, x.y - y.x],
        [y.z - z.y, 1.0 + x.x - y.y - z.z, x.y + y.x, z.x + x.z],
        [z.x - x.z, x.y + y.x, 1.0 - x.x + y.y - z.z, y.z + z.y],
        [x.y - y.x, z.x + x.z, y.z + z.y, 1.0 - x.x - y.y + z.z],
    ]
    largest = np.argmax([doubles(products[k][k]) for k in range(4)], axis=0)
    own = sqrt(_select(largest, [products[k][k] for k in range(4)]))
    return [_select(largest, products[i]) / (2.0 * own) for i in range(4)]


def smallest(e: Sequence[Jet], within: float = 0.0) -> list[Jet]:
    """Return the Euler parameters of the same rotation with e0 not negative, for one up to half a
    turn.

    Args:
        within: a rotation that is larger by no more than this keeps its sign [rad].
    """
    return signed(np.where(floats(e)[0] < -0.5 * within, -1.0, 1.0), e)


def signed(sign: Array, e: Sequence[Jet]) -> list[Jet]:
    """Return Euler parameters with another sign at the samples."""
    return [sign * each for each in e]


def floats(e: Sequence[Jet]) -> Array:
    """Return the values of jets as doubles, shape (4, n, ...)."""
    return np.array([doubles(each) for each in e])


def angular_velocity(e: Sequence[Jet]) -> Array:
    """Return the angular velocity of Euler parameters as doubles [rad/s], global axes, shape
    (3, n, ...); NaN if unknown.
    """
    rates = np.array([np.asarray(each.v).astype(np.float64) for each in e])
    return np.array([*(2.0 * (quat(rates) * quat(floats(e)).conjugate()).e)])


def rotation_vector(e: Sequence[Jet]) -> list[Jet]:
    """Return axis times angle [rad] of Euler parameters of about half a turn at most."""
    e0, *along = e
    square = along[0] * along[0] + along[1] * along[1] + along[2] * along[2]
    # exact numbers, which are objects, have digits enough for the quotient
    rounded = np.asarray(square.x).dtype != object
    small = (doubles(square) < _SMALL) & (doubles(e0) > 0.0) & rounded
    root = sqrt(_select(small.astype(int), [square, e0 * e0]))  # any number where it is small
    quotient = 2.0 * arctan2(root, e0) / root
    series, coefficient = 0.0 * square, 2.0
    power = 0.0 * square + 1.0
    for k in range(_TERMS):  # of 2 arcsin(r) / r
        series = series + coefficient * power
        power = power * square
        coefficient *= (2 * k + 1) ** 2 / ((2 * k + 2) * (2 * k + 3))
    factor = _select(small.astype(int), [quotient, series])
    return [factor * each for each in along]


def _select(which: NDArray[Any], jets: Sequence[Jet]) -> Jet:
    """Return the jet that is chosen in each lane, by its index."""

    def chosen(order: str) -> Any:
        return np.choose(which, [getattr(jet, order) for jet in jets])

    return Jet(*(chosen(order) for order in ("x", "v", "a")))
