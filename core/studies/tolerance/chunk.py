"""The result of one chunk of a study's variants: plain data, picklable; and counts by limits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array
from .reduce import Summary

COUNTS = 7
"""Counts of a limit, seven numbers of variants: all; incomplete; with a sample below, and with a
sample above; then of the complete ones: with a sample below, above and outside.
"""


@dataclass(frozen=True)
class RowLimit:
    """Limits of a row of a study [SI]; infinite without a limit."""

    row: int
    low: float
    high: float

    @property
    def size(self) -> float:
        """The largest absolute value of the finite limits."""
        return max(abs(each) for each in (self.low, self.high) if math.isfinite(each))


def limit_counts(
    values: Array, solved: NDArray[np.bool_], nominal: Array, limits: Sequence[RowLimit]
) -> NDArray[np.int64]:
    """Return the counts of each limit, then of all together, shape (limits + 1, COUNTS).

    A variant is incomplete if a sample is not reached, or if the limited row lacks a value at a
    sample where the nominal design has one, or at all samples.

    Args:
        values: values of variants, NaN if missing, shape (rows, n, V).
        solved: whether each sample is reached, shape (n, V).
        nominal: values of the nominal design, shape (rows, n).
    """
    states: list[NDArray[np.bool_]] = []
    for each in limits:
        row, missing = values[each.row], np.isnan(values[each.row])
        lacking = missing[np.isfinite(nominal[each.row])].any(axis=0) | missing.all(axis=0)
        incomplete = ~solved.all(axis=0) | lacking
        below, above = (row < each.low).any(axis=0), (row > each.high).any(axis=0)
        states.append(np.stack([incomplete, below, above]))
    states.append(np.logical_or.reduce(states))
    found = np.empty((len(states), COUNTS), dtype=np.int64)
    for counts, (incomplete, below, above) in zip(found, states, strict=True):
        complete = [each & ~incomplete for each in (below, above, below | above)]
        some = [incomplete, below, above, *complete]
        counts[:] = [values.shape[2], *(each.sum() for each in some)]
    return found


@dataclass(frozen=True)
class Unsolved:
    """A variant without a solution at some samples, and the reason."""

    variant: int
    samples: int
    message: str


@dataclass(frozen=True, eq=False)
class Chunk:
    """The result of a chunk of variants.

    Attributes:
        count: number of variants.
        kept: values of the random subset, shape (rows, n, subset size).
        picked: values of picked variants, by variant, shape (rows, n).
        unsolved: the first variants without a solution at some samples.
        failures: number of all such variants.
        retried: number of variants solved again alone, with divided steps.
        limited: counts of variants by specification limit, see `limit_counts`.
        effects: the largest change of each row over the samples, signed, shape (rows, count); None
            unless the mode varies one coordinate at a time.
        values: values of all variants, shape (rows, n, count); None unless the study stores them.
        offsets: their offsets, shape (coordinates, count); None unless the study stores them.
    """

    index: int
    count: int
    summary: Summary
    kept: Array
    picked: Mapping[int, Array]
    unsolved: tuple[Unsolved, ...]
    failures: int
    retried: int
    limited: NDArray[np.int64]
    effects: Array | None = None
    values: Array | None = None
    offsets: Array | None = None
