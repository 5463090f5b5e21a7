"""The result of one chunk of a study's variants: plain data, picklable."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array
from .reduce import Summary


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
