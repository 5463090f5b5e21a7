"""Variation of a design: independent coordinates, their effect on the geometry, and the offsets of
each variant by index.

Seed and index define a variant. Each block of `DRAWN` variants has its own generator; its seed is a
child of the study's seed sequence, by the block's number. So any machine can compute any variants,
and a single variant can be reproduced.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import IntEnum, StrEnum
from functools import cached_property, lru_cache
from itertools import groupby
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...caches import cache_last
from ...errors import KincheckError
from ...trajectory import Array
from .study_choices import Mode, Sampling
from .varied_places import Moves


class Law(StrEnum):
    """Distribution of a coordinate."""

    NORMAL = "normal"
    TRUNCATED_NORMAL = "truncated_normal"
    UNIFORM = "uniform"
    TRIANGULAR = "triangular"
    VALUES = "values"


def quantile(law: Law, probability: Array, scale: float, half_width: float) -> Array:
    """Return the quantiles of a distribution at these probabilities, in the same shape.

    Args:
        probability: between 0 and 1, both excluded.
        scale: standard deviation of a normal distribution, before truncation [unit].
        half_width: largest offset of the other distributions [unit].
    """
    match law:
        case Law.NORMAL:
            return scale * _special().ndtri(probability)
        case Law.TRUNCATED_NORMAL:
            outside = float(_special().ndtr(np.array(-half_width / scale)))
            offsets = scale * _special().ndtri(outside + probability * (1.0 - 2.0 * outside))
            return np.clip(offsets, -half_width, half_width)  # round-off at the ends
        case Law.TRIANGULAR:  # with its mode at the nominal value
            low = np.sqrt(2.0 * np.minimum(probability, 1.0 - probability)) - 1.0
            return half_width * np.where(probability < 0.5, low, -low)
        case Law.UNIFORM:
            return half_width * (2.0 * probability - 1.0)
        case Law.VALUES:
            raise ValueError("listed offsets have no distribution")


def _special() -> Any:
    """Return the module with the normal distribution: `ndtr` is the share below a value, `ndtri`
    its inverse. Few studies need its import.
    """
    import scipy.special  # pyright: ignore[reportMissingTypeStubs]

    return scipy.special


# Correlated coordinates: a Gaussian copula. Each coordinate is a function of a standard normal
# number z: its quantile at the share of z, the probability of a smaller number. The matrix
# correlates the numbers z. So normal coordinates have exactly these correlations. Others have
# nearly the same: for two uniform coordinates the correlation is 6/pi asin(r/2) instead of r, a
# difference of 0.018 at most.

# Matrices in files have rounded digits: this is the largest accepted negative eigenvalue.
DIGITS = 1e-9


@dataclass(frozen=True, eq=False)
class Correlation:
    """Correlation of some coordinates, by a matrix.

    Attributes:
        rows: indices of the coordinates, each once.
        matrix: symmetric, positive semidefinite, ones on the diagonal, shape (rows, rows).
    """

    rows: tuple[int, ...]
    matrix: Array

    @cached_property
    def factor(self) -> Array:
        """The lower triangle L of the matrix L L^T; a column is zero if its coordinate depends on
        earlier coordinates alone.
        """
        size = len(self.matrix)
        found = np.zeros((size, size))
        for k in range(size):
            rest = self.matrix[k:, k] - found[k:, :k] @ found[k, :k]
            if rest[0] > DIGITS:
                found[k:, k] = rest / np.sqrt(rest[0])
        return found

    def correlate(self, independent: Array) -> Array:
        """Return correlated standard normal numbers from independent ones, shape (rows, V).

        The sum is computed term by term, as the rounding of a matrix product may depend on the
        number of columns and on the machine.
        """
        found = np.zeros_like(independent)
        for row, column in np.argwhere(self.factor).tolist():
            found[row] += self.factor[row, column] * independent[column]
        return found


def problem_of(matrix: Sequence[Sequence[float]], names: Sequence[str]) -> str:
    """Return the reason why a matrix is no correlation matrix of the named coordinates, and the
    expectation; empty if it is one.
    """
    size = len(names)
    lengths = [len(row) for row in matrix]
    if lengths != [size] * size:
        rows = ", ".join(map(str, lengths))
        return (
            f"found {len(lengths)} rows of {rows} numbers, expected {size} rows of {size}, as there"
            f" are {size} coordinates; complete the matrix"
        )
    values = np.array(matrix, dtype=np.float64)
    for i, j in np.argwhere(~(np.abs(values) <= 1.0)).tolist():
        return (
            f"found {matrix[i][j]:g} for {names[i]} and {names[j]}, expected a number from -1 to 1;"
            " correct it"
        )
    for k in range(size):
        if values[k, k] != 1.0:
            return (
                f"found {matrix[k][k]:g} on the diagonal for {names[k]}, expected 1; give"
                " correlations, not covariances"
            )
    for i, j in np.argwhere(values != values.T).tolist():
        return (
            f"found {matrix[i][j]:g} for {names[i]} and {names[j]}, but {matrix[j][i]:g} for"
            f" {names[j]} and {names[i]}, expected a symmetric matrix; correct one"
        )
    least = float(np.linalg.eigvalsh(values)[0])
    if least < -DIGITS:
        return (
            f"found the eigenvalue {least:.3g}, expected a positive semidefinite matrix, as all"
            " correlations of data are; bring the numbers closer to zero"
        )
    return ""


# Samplings of a Monte Carlo study: points of the unit cube, by seed and block. Random points and
# points of a Sobol sequence do not depend on their number: a longer series begins with the same
# points. The points of a Latin hypercube do depend on it: each coordinate has one point in every
# interval of length 1 / count. The order of its intervals is kept in memory: four bytes for each
# point and coordinate.

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
            f"--sampling sobol: {count} variants, expected at most {2**BITS}. Take fewer, or"
            " --sampling random."
        )
    size = 4 * coordinates * count
    if sampling is Sampling.LATIN and size > LATIN_BYTES:
        raise KincheckError(
            f"--sampling latin: the orders of {count} variants and {coordinates} coordinates take"
            f" {size / 1e9:.3g} GB of memory, expected at most {LATIN_BYTES / 1e9:g}. Take fewer"
            " variants, or --sampling sobol, which needs none."
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


@cache_last(2, per_thread=True)
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


@dataclass(frozen=True)
class FileUnits:
    """Names of the units of a study's outputs, for their display and limits."""

    length: str = "m"
    angle: str = "rad"


SI = FileUnits()


@dataclass(frozen=True)
class Limit:
    """Limits of an output, or of its derivative by time, at every sample.

    Attributes:
        output: name of the output; with the suffix of a derivative, as in camber.velocity.
        low, high: smallest and largest value [SI unit of the output]; infinite without a limit.
    """

    output: str
    low: float = -math.inf
    high: float = math.inf


NODES = 40
"""Nodes that integrate a normal density over nine deviations to round-off."""


@dataclass(frozen=True)
class Coordinate:
    """One independently varied number: a coordinate of a hardpoint, a component of a direction, a
    length, or a number of a load.

    Attributes:
        hardpoint: name of the hardpoint in the file.
        axis: x, y or z; empty for a length.
        unit: m, or rad for components of a direction.
        law: distribution of the offsets from the nominal value.
        scale: standard deviation, half width, or largest offset [unit].
        values: offsets in a grid or one at a time [unit]; empty if drawn.
        bound: largest offset of a truncated normal distribution [unit]; zero for other laws.
    """

    hardpoint: str
    axis: str
    unit: str
    law: Law
    scale: float
    values: tuple[float, ...] = ()
    bound: float = 0.0

    @property
    def name(self) -> str:
        """The name in results."""
        return f"{self.hardpoint}.{self.axis}" if self.axis else self.hardpoint

    @property
    def standard_deviation(self) -> float:
        """The standard deviation of its offsets, listed ones being equally frequent [unit]."""
        match self.law:
            case Law.NORMAL:
                return self.scale
            case Law.UNIFORM:
                return self.scale / math.sqrt(3.0)
            case Law.TRIANGULAR:
                return self.scale / math.sqrt(6.0)
            case Law.TRUNCATED_NORMAL:
                # by quadrature: beyond nine deviations nothing is left to cut off
                nodes, weights = np.polynomial.legendre.leggauss(NODES)
                x = 0.5 * min(self.bound / self.scale, 9.0) * (1.0 + nodes)
                weights = weights * np.exp(-0.5 * x * x)
                return self.scale * math.sqrt(float(weights @ (x * x)) / float(weights.sum()))
            case Law.VALUES:
                return float(np.std(self.values))


@dataclass(frozen=True, eq=False)
class Variation(Moves):
    """The varied coordinates, and the moves of places by their offsets.

    Attributes:
        correlations: correlations of drawn coordinates, each coordinate in one of them at most.
        sampling: choice of the drawn points.
        drawn: number of drawn variants; a Latin hypercube depends on it.
        limits: specification limits of outputs.
        units: units of the file, for the display of outputs.
    """

    mode: Mode
    coordinates: tuple[Coordinate, ...]
    correlations: tuple[Correlation, ...] = ()
    sampling: Sampling = Sampling.RANDOM
    drawn: int = 0
    limits: tuple[Limit, ...] = ()
    units: FileUnits = SI

    @property
    def count(self) -> int | None:
        """The number of variants; None for a Monte Carlo study of any number."""
        sizes = [len(each.values) for each in self.coordinates]
        if self.mode is Mode.MONTE_CARLO:
            return None
        if self.mode is Mode.ONE_AT_A_TIME:
            return 1 + sum(sizes)
        count = 1
        for size in sizes:  # unbounded integers: a grid soon outgrows 64 bits
            count *= size
        return count

    def sampled(self, sampling: Sampling, count: int) -> Variation:
        """Return the variation with another choice of the drawn points.

        Args:
            count: number of variants.

        Raises:
            KincheckError: nothing is drawn, or the sampling cannot have as many points.
        """
        if sampling is not Sampling.RANDOM and self.mode is not Mode.MONTE_CARLO:
            raise KincheckError(
                f"--sampling {sampling}: {self.mode} draws nothing. Leave it out, or set mode ="
                ' "monte_carlo"'
            )
        check_count(sampling, len(self.coordinates), count)
        # only a Latin hypercube depends on the number; other samplings keep none
        drawn = count if sampling is Sampling.LATIN else 0
        return replace(self, sampling=sampling, drawn=drawn)

    def offsets(self, seed: int, first: int, count: int) -> Array:
        """Return offsets of variants from the nominal design [units], (coordinates, count)."""
        if self.mode is Mode.MONTE_CARLO:
            return self._drawn(seed, first, count)
        return self._listed_offsets(first + np.arange(count))

    def of_variant(self, seed: int, index: int) -> Array:
        """Return offsets of one variant [units], shape (coordinates,)."""
        return self.offsets(seed, index, 1)[:, 0]

    def _drawn(self, seed: int, first: int, count: int) -> Array:
        places = range(first // DRAWN, -(-(first + count) // DRAWN))
        found = np.concatenate([self._draw(seed, place) for place in places], axis=1)
        skipped = first - places.start * DRAWN
        return found[:, skipped : skipped + count]

    def _draw(self, seed: int, block: int) -> Array:
        """Draw a whole block, even if only part of it is needed, so a variant does not depend on
        the number of variants.
        """
        laws = {each.law for each in self.coordinates}
        plain = self.sampling is Sampling.RANDOM and laws <= {Law.NORMAL, Law.UNIFORM}
        if plain and not self.correlations:
            return self._independent(generator(seed, block, Stream.GEOMETRY))
        at = points(self.sampling, seed, block, len(self.coordinates), self.drawn)
        normal = dict[int, Array]()
        for each in self.correlations:
            rows = [*each.rows]
            normal |= zip(rows, each.correlate(_special().ndtri(at[rows])), strict=True)
        found = np.empty_like(at)
        for row, each in enumerate(self.coordinates):
            if each.law is Law.NORMAL and row in normal:
                found[row] = each.scale * normal[row]
                continue
            share = _special().ndtr(normal[row]) if row in normal else at[row]
            found[row] = quantile(each.law, share, each.scale, each.bound or each.scale)
        return found

    def _independent(self, random: np.random.Generator) -> Array:
        """Draw normal and uniform coordinates directly."""
        rows = list[Array]()
        # one call for all coordinates of a law, without Python's lock
        for law, some in groupby(self.coordinates, lambda each: each.law):
            scale = np.array([each.scale for each in some])[:, None]
            shape = len(scale), DRAWN
            rows.append(
                scale
                * (
                    random.standard_normal(shape)
                    if law is Law.NORMAL
                    else random.uniform(-1.0, 1.0, shape)
                )
            )
        return np.concatenate(rows)

    def _listed_offsets(self, indices: NDArray[np.int64]) -> Array:
        found = np.zeros((len(self.coordinates), len(indices)))
        if self.mode is Mode.GRID:  # the last coordinate varies fastest
            for row in reversed(range(len(self.coordinates))):
                values = np.array(self.coordinates[row].values)
                indices, digit = np.divmod(indices, len(values))
                found[row] = values[digit]
            return found
        rows, offsets = self._steps
        some = indices > 0  # the first is the nominal design
        found[rows[indices[some] - 1], np.flatnonzero(some)] = offsets[indices[some] - 1]
        return found

    @cached_property
    def _steps(self) -> tuple[NDArray[np.int64], Array]:
        """Return the coordinate and the offset of each one-at-a-time variant except the first."""
        pairs = [(row, value) for row, each in enumerate(self.coordinates) for value in each.values]
        return np.array([row for row, _ in pairs], dtype=np.int64), np.array(
            [value for _, value in pairs]
        )
