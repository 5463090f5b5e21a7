"""Reduction of many variants: running extremes, mean and spread, and quantiles of kept values.

Summaries are merged in the order of the chunks, so sums have the same round-off every time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array

QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)


@dataclass(frozen=True, eq=False)
class Summary:
    """Statistics of quantities over variants, for each quantity and sample: shape (quantities, n).

    Attributes:
        count: number of variants with a value.
        least, most, mean: minimum, maximum and mean; NaN without a value.
        squares: sum of the squared distances from the mean.
        extremes: for each quantity, the variants with the minimum and the maximum over all
            samples, shape (quantities, 2); -1 without a value.
    """

    count: NDArray[np.int64]
    least: Array
    most: Array
    mean: Array
    squares: Array
    extremes: NDArray[np.int64]

    @property
    def deviation(self) -> Array:
        """Sample standard deviation, over count - 1; NaN for fewer than two variants."""
        with np.errstate(all="ignore"):
            return np.where(self.count > 1, np.sqrt(self.squares / (self.count - 1)), np.nan)


def empty_summary(quantities: int, n: int) -> Summary:
    """Return the summary of no variants."""
    none, unknown = np.zeros((quantities, n)), np.full((quantities, n), np.nan)
    extremes = np.full((quantities, 2), -1, dtype=np.int64)
    return Summary(none.astype(np.int64), unknown, unknown.copy(), unknown.copy(), none, extremes)


def summary_of(values: Array, first: int) -> Summary:
    """Return the summary of variants, by distances from their mean: these lose no digits if all
    numbers are far from zero.

    Args:
        values: shape (quantities, n, V), NaN if missing.
        first: index of the first variant.
    """
    found = empty_summary(*values.shape[:2])
    # one after the other: what is read again is still in the cache
    with np.errstate(all="ignore"):
        for q, each in enumerate(values):
            total, count, missing = each.sum(axis=1), each.shape[1], None
            lowest, highest = np.argmin, np.argmax
            if not np.isfinite(total).all():  # rare: most studies are spared the search for NaN
                missing, lowest, highest = np.isnan(each), np.nanargmin, np.nanargmax
                total, count = np.nansum(each, axis=1), (~missing).sum(axis=1)
            found.count[q], found.mean[q] = count, total / count
            away = each - found.mean[q, :, None]
            if missing is not None:
                away[missing] = 0.0
            found.squares[q] = np.vecdot(away, away)
            ends = np.fmin.reduce(each, axis=1), np.fmax.reduce(each, axis=1)
            found.least[q], found.most[q] = ends
            for k, outermost in enumerate((lowest, highest) if found.count[q].any() else ()):
                sample = int(outermost(ends[k]))
                found.extremes[q, k] = first + (each[sample] == ends[k][sample]).argmax()
    return found


def merge(a: Summary, b: Summary) -> Summary:
    """Return the summary of the variants of both; b's variants come after a's.

    Mean and squares by Chan, Golub and LeVeque: Updating formulae and a pairwise algorithm
    for computing sample variances (1979). Their formulae lose no digits if the mean is much larger
    than the spread.
    """
    count = a.count + b.count
    with np.errstate(all="ignore"):
        share = b.count / count
        step = b.mean - a.mean
        mean = np.where(a.count == 0, b.mean, np.where(b.count == 0, a.mean, a.mean + step * share))
        both = np.where((a.count == 0) | (b.count == 0), 0.0, step * step * a.count * share)
        least, most = np.fmin(a.least, b.least), np.fmax(a.most, b.most)
        # take b's variant only if it is further out, or a has none: of equal ones the first stays
        none = a.extremes[:, 0] < 0
        below = none | (np.fmin.reduce(b.least, axis=1) < np.fmin.reduce(a.least, axis=1))
        above = none | (np.fmax.reduce(b.most, axis=1) > np.fmax.reduce(a.most, axis=1))
    extremes = np.where(np.stack([below, above], axis=1), b.extremes, a.extremes)
    return Summary(count, least, most, mean, a.squares + b.squares + both, extremes)


@dataclass(frozen=True, eq=False)
class Quantiles:
    """Quantiles of one quantity over variants.

    Attributes:
        values: linear interpolation between sorted neighbours, shape (len(QUANTILES), n).
        errors: standard errors, of the same shape; None if the quantiles are exact. An error is
            half the distance between the quantiles at p - s and p + s. Here s =
            sqrt(p (1 - p) / m) is the standard error of the share of m variants below a value.
        kept: number of variants used for the quantiles.
    """

    values: Array
    errors: Array | None
    kept: int


def quantiles(kept: Sequence[Array], *, exact: bool) -> Quantiles:
    """Return the quantiles of variants; NaN at a sample without a value.

    Args:
        kept: values, shape (n, V) each.
        exact: whether these are all variants, not a random subset.
    """
    values = np.concatenate(kept, axis=1)
    count = values.shape[1]
    p = np.array(QUANTILES)
    s = np.sqrt(p * (1.0 - p) / max(count, 1))
    wanted = p if exact else np.concatenate([p, np.clip(p - s, 0.0, 1.0), np.clip(p + s, 0.0, 1.0)])
    if count == 0:
        found = np.full((len(wanted), len(values)), np.nan)
    elif np.isnan(values.sum()):
        found = np.full((len(wanted), len(values)), np.nan)
        some = ~np.isnan(values).all(axis=1)
        found[:, some] = np.nanquantile(values[some], wanted, axis=1)
    else:
        # vectorized, in half the time of a search for each quantile
        values.sort(axis=1)
        found = np.quantile(values, wanted, axis=1, overwrite_input=True)
    if exact:
        return Quantiles(found, None, count)
    here, below, above = found.reshape(3, len(p), -1)
    return Quantiles(here, 0.5 * (above - below), count)
