"""How a design is varied: independent coordinates, what each moves, and the numbers of every
variant by its index.

A variant is known by seed and index alone: `DRAWN` of them are drawn by a generator of their own,
whose seed sequence is the study's spawned by their place, so that any machine can make any
variants, and one can be made again by itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from functools import cached_property
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array

DRAWN = 256
"""Variants that are drawn together; part of what a seed means, and no setting for that reason."""


class Mode(StrEnum):
    """Which variants there are."""

    MONTE_CARLO = "monte_carlo"
    GRID = "grid"
    ONE_AT_A_TIME = "one_at_a_time"


class Law(StrEnum):
    """How a coordinate is distributed."""

    NORMAL = "normal"
    UNIFORM = "uniform"
    VALUES = "values"


class Stream(IntEnum):
    """What random numbers are drawn for; each has generators of its own."""

    GEOMETRY = 0
    SUBSET = 1


@dataclass(frozen=True)
class Coordinate:
    """One number that varies independently: a coordinate of a hardpoint, a component of a
    direction, a length.

    Attributes:
        hardpoint: name in the file.
        axis: x, y or z; empty of a length.
        unit: m, or rad of a direction's components.
        law: of the offsets from the nominal value.
        scale: standard deviation, half width, or the largest offset [unit].
        values: the offsets of a grid or of one at a time [unit]; empty where it is drawn.
    """

    hardpoint: str
    axis: str
    unit: str
    law: Law
    scale: float
    values: tuple[float, ...] = ()

    @property
    def name(self) -> str:
        """What results call it by."""
        return f"{self.hardpoint}.{self.axis}" if self.axis else self.hardpoint


@dataclass(frozen=True, eq=False)
class Variation:
    """The coordinates that vary, and how the places of the geometry follow them: nominal + moves @
    offsets.

    Attributes:
        places: names of the varied places (see `analysis.equations.geometry.places`), with how many
            numbers each has.
        nominal: numbers of the varied places at the nominal design [m or -], shape (numbers,).
        moves: shape (numbers, coordinates).
    """

    mode: Mode
    coordinates: tuple[Coordinate, ...]
    places: Mapping[str, int]
    nominal: Array
    moves: Array

    @property
    def count(self) -> int | None:
        """How many variants there are; None where as many as are asked for."""
        sizes = [len(each.values) for each in self.coordinates]
        if self.mode is Mode.MONTE_CARLO:
            return None
        if self.mode is Mode.ONE_AT_A_TIME:
            return 1 + sum(sizes)
        count = 1
        for size in sizes:  # in whole numbers without end: a grid outgrows 64 bits soon
            count *= size
        return count

    def geometry(self, offsets: Array) -> Array:
        """Numbers of the varied places, shape (numbers, V), from offsets, shape (coordinates, V).

        Term by term: a matrix product may round differently with the number of columns and with the
        machine.
        """
        found = np.repeat(self.nominal[:, None], offsets.shape[1], axis=1)
        for number, coordinate in np.argwhere(self.moves).tolist():
            found[number] += self.moves[number, coordinate] * offsets[coordinate]
        return found

    def values(self, offsets: Array) -> dict[str, tuple[float, ...]]:
        """The value of every varied place of one variant, from its offsets, shape
        (coordinates,).
        """
        numbers = iter(self.geometry(offsets[:, None])[:, 0].tolist())
        return {
            place: tuple(next(numbers) for _ in range(size)) for place, size in self.places.items()
        }

    def offsets(self, seed: int, first: int, count: int) -> Array:
        """Offsets of variants from the nominal design [units], shape (coordinates, count)."""
        if self.mode is Mode.MONTE_CARLO:
            return self._drawn(seed, first, count)
        return self._listed(first + np.arange(count))

    def of_variant(self, seed: int, index: int) -> Array:
        """Offsets of one variant [units], shape (coordinates,)."""
        return self.offsets(seed, index, 1)[:, 0]

    def _drawn(self, seed: int, first: int, count: int) -> Array:
        places = range(first // DRAWN, -(-(first + count) // DRAWN))
        found = np.concatenate(
            [self._draw(generator(seed, place, Stream.GEOMETRY)) for place in places], axis=1
        )
        skipped = first - places.start * DRAWN
        return found[:, skipped : skipped + count]

    def _draw(self, random: np.random.Generator) -> Array:
        """A whole draw, however much of it is wanted: what a variant is must not depend on how many
        there are.
        """
        rows = list[Array]()
        # those of one law by one call, without Python's lock
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
        if self.mode is Mode.GRID:  # the last coordinate goes fastest
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
        """Coordinate and offset of every variant of one at a time but the first."""
        pairs = [(row, value) for row, each in enumerate(self.coordinates) for value in each.values]
        return np.array([row for row, _ in pairs], dtype=np.int64), np.array(
            [value for _, value in pairs]
        )


def generator(seed: int, place: int, stream: Stream) -> np.random.Generator:
    """Philox, seeded by a child of the study's seed sequence: the place-th draw of a stream."""
    return np.random.Generator(
        np.random.Philox(np.random.SeedSequence(seed, spawn_key=(place, int(stream))))
    )
