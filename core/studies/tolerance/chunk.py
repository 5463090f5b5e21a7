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
    values: Array, limits: Sequence[RowLimit], incomplete: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """Return the counts of each limit, then of all together, shape (limits + 1, COUNTS).

    Args:
        values: values of variants, NaN if missing, shape (rows, n, V).
        incomplete: whether a variant lacks values of the limited row, shape (limits, V).
    """
    found = np.zeros((len(limits) + 1, COUNTS), dtype=np.int64)
    if not limits:
        return found
    states: list[NDArray[np.bool_]] = []
    for each, lacking in zip(limits, incomplete, strict=True):
        row = values[each.row]
        states.append(np.stack([lacking, (row < each.low).any(0), (row > each.high).any(0)]))
    states.append(np.logical_or.reduce(states))
    for counts, (lacking, below, above) in zip(found, states, strict=True):
        complete = [each & ~lacking for each in (below, above, below | above)]
        some = [lacking, below, above, *complete]
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
