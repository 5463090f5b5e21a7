"""Counts of variants by specification limits, chunk by chunk."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array

COUNTS = 5
"""Counts of a limit, five numbers of variants: all; with a sample below; with a sample above; with
a sample outside; with missing samples and none outside.
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


def limit_counts(values: Array, limits: Sequence[RowLimit]) -> NDArray[np.int64]:
    """Return the counts of each limit, then of all together, shape (limits + 1, COUNTS).

    Args:
        values: values of variants, NaN if missing, shape (rows, n, V).
    """
    found = np.zeros((len(limits) + 1, COUNTS), dtype=np.int64)
    if not limits:
        return found
    states: list[NDArray[np.bool_]] = []
    for each in limits:
        row = values[each.row]
        below, above = (row < each.low).any(axis=0), (row > each.high).any(axis=0)
        states.append(np.stack([below, above, below | above, np.isnan(row).any(axis=0)]))
    states.append(np.logical_or.reduce(states))
    for counts, state in zip(found, states, strict=True):
        state[3] &= ~state[2]
        counts[:] = [values.shape[2], *state.sum(axis=1)]
    return found
