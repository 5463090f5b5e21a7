"""Variation of a design: independent coordinates, their effect on the geometry, and the offsets of
each variant by index.

Seed and index define a variant. Each block of `DRAWN` variants has its own generator; its seed is a
child of the study's seed sequence, by the block's number. So any machine can compute any variants,
and a single variant can be reproduced.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from ...errors import KincheckError
from ...trajectory import Array
from .correlations import Correlation
from .distributions import Law, normal_quantile, normal_share, quantile
from .file_units import SI, FileUnits
from .limits import Limit
from .modes import Mode, Sampling
from .sampling import DRAWN, Stream, check_count, generator, points


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


@dataclass(frozen=True, eq=False)
class Variation:
    """The varied coordinates, and their linear effect on geometry: nominal + moves @ offsets.

    Attributes:
        places: names of the varied places (see `kinematics.formulation.parameters.places`), each
            with its count of numbers.
        nominal: numbers of the varied places at the nominal design [m or -], shape (numbers,).
        moves: changes of these numbers per unit offset, shape (numbers, coordinates).
        correlations: correlations of drawn coordinates, each coordinate in one of them at most.
        sampling: choice of the drawn points.
        drawn: number of drawn variants; a Latin hypercube depends on it.
        limits: specification limits of outputs.
        units: units of the file, for the display of outputs.
    """

    mode: Mode
    coordinates: tuple[Coordinate, ...]
    places: Mapping[str, int]
    nominal: Array
    moves: Array
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
                f"--sampling {sampling}: {self.mode} draws nothing; leave it out, or set mode ="
                ' "monte_carlo"'
            )
        check_count(sampling, len(self.coordinates), count)
        # only a Latin hypercube depends on the number; other samplings keep none
        drawn = count if sampling is Sampling.LATIN else 0
        return replace(self, sampling=sampling, drawn=drawn)

    def geometry(self, offsets: Array) -> Array:
        """Return numbers of the varied places, shape (numbers, V), from offsets, shape
        (coordinates, V).

        The sum is computed term by term, as the rounding of a matrix product may depend on the
        number of columns and on the machine.
        """
        found = np.repeat(self.nominal[:, None], offsets.shape[1], axis=1)
        for number, coordinate in np.argwhere(self.moves).tolist():
            found[number] += self.moves[number, coordinate] * offsets[coordinate]
        return found

    def values(self, offsets: Array) -> dict[str, tuple[float, ...]]:
        """Return the value of each varied place of one variant; offsets of shape (coordinates,)."""
        numbers = iter(self.geometry(offsets[:, None])[:, 0].tolist())
        return {
            place: tuple(next(numbers) for _ in range(size)) for place, size in self.places.items()
        }

    def offsets(self, seed: int, first: int, count: int) -> Array:
        """Return offsets of variants from the nominal design [units], (coordinates, count)."""
        if self.mode is Mode.MONTE_CARLO:
            return self._drawn(seed, first, count)
        return self._listed(first + np.arange(count))

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
            normal |= zip(rows, each.mixed(normal_quantile(at[rows])), strict=True)
        found = np.empty_like(at)
        for row, each in enumerate(self.coordinates):
            if each.law is Law.NORMAL and row in normal:
                found[row] = each.scale * normal[row]
                continue
            share = normal_share(normal[row]) if row in normal else at[row]
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

    def _listed(self, indices: NDArray[np.int64]) -> Array:
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
