"""Running totals of numbers in lanes. They are a traced program, so every executor can reduce."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from ...caches import keep_last
from ...program import Plan, Tape, maximum, minimum, program, where_larger
from ...program.llvm.compiler import available
from ...program.llvm.executor import Executor, bind
from ...program.llvm.jit import LlvmCode
from ...trajectory import Array
from .reduce import Summary

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
    code = _code() if available() else None
    return bind(plan(), code.width if code else NUMPY_LANES, code)


@cache
def _code() -> LlvmCode:
    return LlvmCode(plan())
