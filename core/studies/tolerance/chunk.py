"""What one chunk of a study's variants gives. Plain data, sent anywhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array
from .reduce import Summary


@dataclass(frozen=True)
class Unsolved:
    """A variant that has no solution at some samples, and why."""

    variant: int
    samples: int
    message: str


@dataclass(frozen=True, eq=False)
class Chunk:
    """What became of a chunk of variants.

    Attributes:
        count: of variants.
        kept: values of the random subset, shape (rows, n, some).
        picked: values of picked variants, by variant, shape (rows, n).
        unsolved: the first of the variants without a solution somewhere.
        failures: how many those are.
        retried: variants that were solved again alone, with divided steps.
        limited: counts of the variants that keep the limits, see `limit_counts`.
        effects: one at a time only: the largest change of each row over the samples, signed, shape
            (rows, count).
        values, offsets: where all are wanted: shape (rows, n, count) and (coordinates, count).
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
