"""Levels of a series: the exact segmentation into parts of constant level, with L1 cost.

`ruptures` also segments exactly, but cannot require each change to be significant, and has no
wheels after Python 3.13.
"""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

from ...case.case import Array

SURE = 6.0
"""Smallest distance of two levels in standard errors of a median. In 24 runs with times that
include waiting, where any level is due to chance, the largest was 4.4. A change of level must also
reduce the sum of distances from the medians by this many.
"""

# For normal values with standard deviation 1: standard error of a median times the root of their
# number, mean |difference| of two values, and interquartile range.
MEDIAN_ERROR, DIFFERENCE, QUARTILES = 1.253, 1.128, 1.349


def change_points(values: Array, *, least: float, lasting: int) -> list[int]:
    """Return the indices at which the level of a series changes.

    Among all segmentations with only significant changes, the result has the least sum of distances
    from the medians of the parts, plus a penalty for each change. A change is significant if
    - the medians of `lasting` values before and after it differ by `least`: a slow drift is
      no change;
    - three quarters of the shorter part (of three values, all) lie beyond the median of the longer
      by `least`;
    - the medians of the parts differ by `SURE` standard errors.

    Medians and distances, instead of means and squares, keep one outlier from being a level.

    Args:
        values: shape (n,).
        least: the smallest significant distance of two levels.
        lasting: the fewest values of a level.
    """
    count = len(values)
    if count < 2 * lasting or np.ptp(values) < least:
        return []
    near = np.median(np.lib.stride_tricks.sliding_window_view(values, lasting), axis=1)
    jump = near[lasting:] - near[:-lasting]
    ends = [0, *(lasting + k for k in range(len(jump)) if abs(jump[k]) >= least), count]
    if len(ends) == 2:
        return []
    cost, middle, low, high, width = _parts(values, ends, lasting)
    deviation = _deviation(values)
    # best[i, j]: cost of the division up to ends[j] whose last part begins at ends[i]
    # before[i, j]: where the part before that one begins
    best = np.full(cost.shape, np.inf)
    best[0] = cost[0]
    before = np.zeros(cost.shape, int)
    for i in range(1, len(ends) - 1):
        left, right = (slice(0, i), i, None), (i, None, slice(i + 1, None))
        a = np.array([[ends[i] - end] for end in ends[:i]])
        b = np.array([[end - ends[i] for end in ends[i + 1 :]]])
        up = math.copysign(1.0, jump[ends[i] - lasting])
        outer, inner = (high, low) if up > 0 else (low, high)
        apart: Array = up * (middle[right] - middle[left])
        by_left: Array = up * (middle[right] - outer[left])
        by_right: Array = up * (inner[right] - middle[left])
        inside: Array = (a * width[left] + b * width[right]) / (a + b) / QUARTILES
        error = MEDIAN_ERROR * np.maximum(deviation, inside) * np.sqrt(1 / a + 1 / b)
        sure = (np.where(a <= b, by_left, by_right) >= least) & (apart >= SURE * error)
        costs = np.where(sure, best[:i, i, None], np.inf)
        before[i, i + 1 :] = costs.argmin(axis=0)
        best[i, i + 1 :] = costs.min(axis=0) + SURE * MEDIAN_ERROR * deviation + cost[i, i + 1 :]
    i, j = int(best[:, -1].argmin()), len(ends) - 1
    found: list[int] = []
    while i:
        found.append(int(ends[i]))
        i, j = int(before[i, j]), i
    return found[::-1]


def _deviation(values: Array) -> float:
    """Return the standard deviation from the mean difference of successive values, without the
    largest two.

    A temporary level makes two large differences, and single outliers make more. With many
    outliers, three in a row may be chance, which a median would ignore.
    """
    differences = np.sort(np.abs(np.diff(values)))
    calm = differences[: -2 if len(differences) > 3 else -1]
    return float(calm.mean()) / DIFFERENCE if calm.size else 0.0


def _parts(values: Array, ends: list[int], lasting: int) -> Array:
    """Return cost, median, lower and upper quartile, and interquartile range of all parts from one
    end to another.

    The quartiles are values of the part, rounded outwards; their distance is interpolated. A part
    below the shortest length costs infinity.
    """
    table = np.zeros((5, len(ends), len(ends)))
    table[0] = math.inf
    for (i, start), (j, stop) in combinations(enumerate(ends), 2):
        count = stop - start
        if count < lasting:
            continue
        part = sorted(values[start:stop].tolist())
        k, rest = divmod(count - 1, 4)
        low, high = part[k], part[-1 - k]
        inner = rest / 4 * (part[min(k + 1, count - 1)] - low + high - part[max(-2 - k, -count)])
        cost = sum(part[count - count // 2 :]) - sum(part[: count // 2])
        table[:, i, j] = (
            cost,
            (part[(count - 1) // 2] + part[count // 2]) / 2,
            low,
            high,
            high - low - inner,
        )
    return table
