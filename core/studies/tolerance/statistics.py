"""Reduction of many variants: running extremes, mean and spread, and quantiles of kept values.

Summaries are merged in the order of the chunks, so sums have the same round-off every time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ...caches import keep_last
from ...program import Executor, NumpyExecutor, Plan, Tape, maximum, minimum, program, where_larger
from ...program.llvm.compiler import available
from ...program.llvm.executor import LlvmExecutor
from ...program.llvm.jit import LlvmCode
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


def nothing(quantities: int, n: int) -> Summary:
    """Return the summary of no variants."""
    none, unknown = np.zeros((quantities, n)), np.full((quantities, n), np.nan)
    extremes = np.full((quantities, 2), -1, dtype=np.int64)
    return Summary(none.astype(np.int64), unknown, unknown, unknown, none, extremes)


def merged(a: Summary, b: Summary) -> Summary:
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


# Running totals of numbers in lanes. They are a traced program, so every executor can reduce.

# MERGED

BEGIN = {
    "count": 0.0,
    "first": math.nan,
    "sum": 0.0,
    "squares": 0.0,
    "least": math.inf,
    "most": -math.inf,
}
"""Totals of a lane and their initial values: the count of finite numbers, the first of these, the
sums of the distances from the first and of their squares, and the extremes. Distances from the
first number lose no digits if all numbers are far from zero."""
AT_A_TIME = 8
"""Numbers of each lane taken in one call of the program."""
NUMPY_LANES = 128
"""Lanes of the numpy executor; times `AT_A_TIME`, the number of variants solved together."""


@cache
def plan() -> Plan:
    """Return the plan of the totals; infinite numbers count as missing."""
    tape, slots = Tape(), range(len(BEGIN), len(BEGIN) + AT_A_TIME)
    count, first, total, squares, least, most = map(tape.input, range(len(BEGIN)))
    for value in map(tape.input, slots):
        first = where_larger(count, 0.0, first, value)
        away = where_larger(math.inf, value, value - first, 0.0)  # the condition is false for NaN
        count = count + where_larger(math.inf, value, 1.0, 0.0)
        total, squares = total + away, squares + away * away
        least = minimum(least, where_larger(math.inf, value, value, math.inf))
        most = maximum(most, where_larger(math.inf, value, value, -math.inf))
    taken = program("take", tape, dict(enumerate((count, first, total, squares, least, most))))
    names = {
        **{name: k for k, name in enumerate(BEGIN)},
        **{f"value {k}": slot for k, slot in enumerate(slots)},
    }
    return Plan({"take": taken}, names, after=("take",), taken=slots, kept=range(len(BEGIN)))


class Totals:
    """Totals of quantities at n samples, lane by lane; each variant goes to a lane. Use an object
    only in the thread of its creation.

    Attributes:
        found: the totals, shape (quantities, len(BEGIN), n, lanes).
        extremes: see `Summary.extremes`.
    """

    def __init__(self, quantities: int, n: int) -> None:
        # an executor for this thread alone: its lanes hold the totals during `take`
        self._executor = _executor()
        self.found = np.empty((quantities, len(BEGIN), n, self._executor.group))
        self.found[:] = np.array([*BEGIN.values()])[:, None, None]
        self.extremes = np.full((quantities, 2), -1, dtype=np.int64)
        self._outermost = np.full((2, quantities), np.inf)

    def take(self, values: Array, first: int) -> None:
        """Add variants to the totals.

        Args:
            values: values of the variants, NaN if missing, shape (quantities, n, V).
            first: index of the first variant.
        """
        table = values
        if (
            short := -values.shape[2] % (AT_A_TIME * self._executor.group)
        ) or not values.flags.c_contiguous:
            table = np.pad(values, ((0, 0), (0, 0), (0, short)), constant_values=np.nan)
        for rows, totals in zip(table, self.found, strict=True):
            self._executor.fold(rows, totals)
        for which, lanes in enumerate((self["least"], -self["most"])):
            by_sample = lanes.min(axis=2)
            outermost = by_sample.min(axis=1)
            for q in np.flatnonzero(outermost < self._outermost[which]).tolist():
                sample = by_sample[q].argmin()
                self.extremes[q, which] = (
                    first + (values[q, sample] == (1, -1)[which] * outermost[q]).argmax()
                )
            self._outermost[which] = outermost

    def summary(self) -> Summary:
        """Return the summary of all added variants."""
        count, total = self["count"], self["sum"]
        whole, some = count.sum(axis=2), count > 0.0
        with np.errstate(all="ignore"):  # a lane without a number has weight zero
            mean = np.where(some, self["first"] + total / count, 0.0)
            squares = np.where(some, self["squares"] - total * total / count, 0.0)
            mean_of_all = (count * mean).sum(axis=2) / whole
        least, most = self["least"].min(axis=2), self["most"].max(axis=2)
        least[whole == 0.0] = most[whole == 0.0] = np.nan
        squares += np.where(some, count * (mean - mean_of_all[:, :, None]) ** 2, 0.0)
        return Summary(
            whole.astype(np.int64), least, most, mean_of_all, squares.sum(axis=2), self.extremes
        )

    def __getitem__(self, name: str) -> Array:
        """Return one kind of totals by its name, shape (quantities, n, lanes)."""
        return self.found[:, [*BEGIN].index(name)]


@keep_last(1, per_thread=True)
def _executor() -> Executor:
    return (
        LlvmExecutor(_code(), _code().width) if available() else NumpyExecutor(plan(), NUMPY_LANES)
    )


@cache
def _code() -> LlvmCode:
    return LlvmCode(plan())
