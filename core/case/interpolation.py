"""Curves on a grid of their own: the samples they share with a sweep, and interpolation with an
estimate of its error.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Array

FEWEST = 4
"""Fewest rows to interpolate a curve with an estimate of the error."""
# Slopes are taken over this part of the range at least, so that noise of near rows is no slope.
_WINDOW = 0.02
# Rows are taken in blocks, with as many rows beside them as change a spline there by 1e-12.
_BLOCK, _NEAR = 64, 40


def matched(rows: Array, at: Array, allowed: float) -> NDArray[np.intp] | None:
    """Return the row of each sample, -1 where there is none; None if a row is at no sample.

    Args:
        rows, at: driver values of the curve and of the sweep.
        allowed: largest difference of equal ones.
    """
    if len(rows) == len(at) and (np.abs(rows - at) <= allowed).all():
        return np.arange(len(at))
    order = np.argsort(at, kind="stable")
    above = np.clip(np.searchsorted(at[order], rows), 0, len(at) - 1)
    near = np.stack([order[np.maximum(above - 1, 0)], order[above]])
    best = np.take_along_axis(near, np.abs(at[near] - rows).argmin(axis=0)[None], 0)[0]
    if (np.abs(at[best] - rows) > allowed).any() or len(set(best.tolist())) < len(rows):
        return None
    found = np.full(len(at), -1)
    found[best] = np.arange(len(rows))
    return found


def interpolated(x: Array, y: Array, at: Array) -> tuple[Array, Array]:
    """Return values of the cubic spline through a curve, and their error, at samples within it.

    The error is that of rows predicted from the others, by splines through every second row: the
    largest of the four rows around a sample. For a smooth curve it is some 15 times the spline's
    own, and for a noisy one it has the noise. A gap wider than those is taken for as much worse.

    Args:
        x: driver values of the curve, increasing, at least `FEWEST`.
        y: its values.
        at: samples, not outside x but for rounding.
    """
    # slow to import, and rarely wanted
    from scipy.interpolate import CubicSpline  # pyright: ignore[reportMissingTypeStubs]

    spline: Any = CubicSpline
    count = len(x)
    error = np.zeros(count)
    for first in (1, 2):
        left_out = np.arange(first, count - 1, 2)
        kept = np.setdiff1d(np.arange(count), left_out)
        error[left_out] = np.abs(spline(x[kept], y[kept])(x[left_out]) - y[left_out])
    above = np.clip(np.searchsorted(x, at), 1, count - 1)
    around = np.stack([np.clip(above + k, 1, count - 2) for k in (-2, -1, 0, 1)])
    # a row was predicted across the gap that it left; a wider gap around a sample has more of it
    wider = (x[above] - x[above - 1]) / (x[around + 1] - x[around - 1])
    largest: Array = np.max(error[around] * np.maximum(1.0, wider**4), axis=0)
    return spline(x, y)(at), largest


def bounded(x: Array, half: Array, at: Array, within: NDArray[np.bool_]) -> Array:
    """Return by how much the spline through a curve changes at most, if each row changes by up to
    half a unit of its last digit; zero at samples outside.

    A row changes the spline ever less at intervals away from it: there, by a factor of two or more
    for each, because twice the sum of two neighbours is the diagonal of the spline's equations.

    Args:
        x: driver values of the curve, increasing, at least `FEWEST`.
        half: largest changes of its rows.
        at: samples.
        within: those that are not outside x.
    """
    from scipy.interpolate import CubicSpline  # pyright: ignore[reportMissingTypeStubs]

    spline: Any = CubicSpline
    found = np.zeros_like(at)
    if not half.any():
        return found
    block = np.clip(np.searchsorted(x, at), 1, len(x) - 1) // _BLOCK
    for k in np.unique(block[within]).tolist():
        here = within & (block == k)
        near = slice(max(0, k * _BLOCK - _NEAR), (k + 1) * _BLOCK + _NEAR)
        weights: Array = spline(x[near], np.eye(len(x[near])))(at[here])
        found[here] = np.abs(weights) @ half[near]
    return found


def slopes(x: Array, y: Array, at: Array) -> Array:
    """Return the absolute slope of a curve near samples.

    Args:
        x: driver values, not decreasing, at least two.
    """
    reach = _WINDOW * float(x[-1] - x[0])
    above = np.clip(np.searchsorted(x, at), 1, len(x) - 1)
    below: NDArray[np.intp] = np.searchsorted(x, at - reach)
    beyond: NDArray[np.intp] = np.searchsorted(x, at + reach, side="right")
    low, high = np.minimum(below, above - 1), np.maximum(beyond - 1, above)
    base: Array = x[high] - x[low]
    rise: Array = y[high] - y[low]
    return np.abs(rise) / np.where(base > 0.0, base, np.inf)
