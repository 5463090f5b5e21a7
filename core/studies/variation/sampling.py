"""Samplings of a Monte Carlo study: points of the unit cube, by seed and block.

Random points and points of a Sobol sequence do not depend on their number: a longer series begins
with the same points. The points of a Latin hypercube do depend on it: each coordinate has one point
in every interval of length 1 / count. The order of its intervals is kept in memory: four bytes for
each point and coordinate.
"""

from __future__ import annotations

from enum import IntEnum
from functools import lru_cache
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...caches import keep_last
from ...errors import KincheckError
from ...trajectory import Array
from .modes import Sampling

DRAWN = 256
"""Number of variants drawn together. It is no setting: another number gives a seed other variants.
"""
# Binary digits of a Sobol point: the largest number with which scipy can skip points.
BITS = 32
# Largest table of a Latin hypercube [bytes].
LATIN_BYTES = 1_000_000_000
# Half a step of numbers with 52 binary digits: no point is 0 or 1, as a normal distribution has no
# quantiles there.
MIDDLE = 2.0**-53


class Stream(IntEnum):
    """Purpose of random numbers; each purpose has its own generators."""

    GEOMETRY = 0
    SUBSET = 1
    LATIN = 2
    SOBOL = 3


def generator(seed: int, place: int, stream: Stream) -> np.random.Generator:
    """Return the Philox generator of a draw of a stream, seeded by a child of the study's seed."""
    return np.random.Generator(
        np.random.Philox(np.random.SeedSequence(seed, spawn_key=(place, int(stream))))
    )


def points(sampling: Sampling, seed: int, block: int, coordinates: int, count: int) -> Array:
    """Return all points of a block in the unit cube, shape (coordinates, DRAWN).

    Args:
        count: number of all points of a Latin hypercube; later points of a block have no meaning.
    """
    if sampling is Sampling.SOBOL:
        found = _sobol(seed, coordinates).block(block)
    else:
        found = generator(seed, block, Stream.GEOMETRY).random((coordinates, DRAWN))
    if sampling is Sampling.LATIN:
        intervals = _orders(seed, coordinates, count)[:, block * DRAWN : (block + 1) * DRAWN]
        some = slice(0, intervals.shape[1])
        found[:, some] = (intervals + found[:, some]) / count
    cells = 2.0**52
    return np.minimum(np.floor(found * cells), cells - 1.0) / cells + MIDDLE


def check_count(sampling: Sampling, coordinates: int, count: int) -> None:
    """Raise KincheckError if a sampling cannot have as many points."""
    if sampling is Sampling.SOBOL and count > 2**BITS:
        raise KincheckError(
            f"--sampling sobol: {count} variants, expected at most {2**BITS}; take fewer, or"
            " --sampling random"
        )
    size = 4 * coordinates * count
    if sampling is Sampling.LATIN and size > LATIN_BYTES:
        raise KincheckError(
            f"--sampling latin: the orders of {count} variants and {coordinates} coordinates take"
            f" {size / 1e9:.3g} GB of memory, expected at most {LATIN_BYTES / 1e9:g}; take fewer"
            " variants, or --sampling sobol, which needs none"
        )


class _Sobol:
    """A scrambled Sobol sequence with a current position, for one thread."""

    def __init__(self, seed: int, coordinates: int) -> None:
        from scipy.stats import qmc  # pyright: ignore[reportMissingTypeStubs]

        make: Any = qmc.Sobol
        random = generator(seed, 0, Stream.SOBOL)
        self._engine = make(coordinates, scramble=True, bits=BITS, seed=random)

    def block(self, index: int) -> Array:
        """Return the points of a block, shape (coordinates, DRAWN)."""
        first = index * DRAWN
        if first < self._engine.num_generated:
            self._engine.reset()
        if ahead := first - self._engine.num_generated:
            self._engine.fast_forward(ahead)
        return np.ascontiguousarray(self._engine.random(DRAWN).T)


@keep_last(2, per_thread=True)
def _sobol(seed: int, coordinates: int) -> _Sobol:
    return _Sobol(seed, coordinates)


_lock = Lock()


def _orders(seed: int, coordinates: int, count: int) -> NDArray[np.uint32]:
    with _lock:  # one table for all threads
        return _orders_of(seed, coordinates, count)


@lru_cache(maxsize=1)
def _orders_of(seed: int, coordinates: int, count: int) -> NDArray[np.uint32]:
    """Return the interval of each point, shape (coordinates, count): a permutation of each row.

    `scipy.stats.qmc.LatinHypercube` does the same, but holds all points at once, and takes twenty
    times as long.
    """
    found = np.empty((coordinates, count), dtype=np.uint32)
    for row, each in enumerate(found):
        each[:] = np.arange(count, dtype=np.uint32)
        generator(seed, row, Stream.LATIN).shuffle(each)
    return found
