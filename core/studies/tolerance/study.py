"""A study of design variants: a case, its variants, and the values to reduce or keep.

A `Study` is plain data, picklable. A `Ready` study has a compiled model, and solves chunks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...algebra import Vec3
from ...case.case import Case, Quantity, without_forces
from ...case.closing import require_no_held
from ...case.measures import ForceMeasure
from ...case.turns import counted
from ...errors import KincheckError
from ...jet import Jet
from ...kinematics import ForcesOfDesigns, NativeSolver, PreparedDesigns, Variants, placed
from ...mechanism.motions import Path
from ...trajectory import PER_TIME, QUANTITIES, Array
from ..variation.modes import Mode
from ..variation.sampling import Stream, generator
from ..variation.variation import Variation
from .chunk import COUNTS, Chunk, RowLimit, Unsolved, limit_counts
from .streaming_totals import Totals

# Variants solved together: enough to make the cost of the calls for their reduction negligible.
# `solve_designs` reduces nothing, and is as fast with a quarter of them.
TOGETHER = 1024
# Number of chunks for threads and workers to share, and the least and largest number of variants in
# a chunk. A chunk has a price: the other threads wait for Python's lock, and the scheduler of a
# cluster spends a millisecond.
CHUNKS, LEAST, MOST = 64, 64, 4096
# Largest chunk if the values of all variants are stored, to limit the memory.
MOST_STORED = 256
# Largest number of messages kept from a chunk; the count of unsolved variants is complete.
MOST_MESSAGES = 50


@dataclass(frozen=True, eq=False)
class ReducedQuantity:
    """A reduced quantity: an output, or its first or second derivative by time."""

    output: Quantity
    derivative: int

    @property
    def name(self) -> str:
        """The name of the output, with the suffix of its derivative as in reference tables."""
        return self.output.name + (f".{QUANTITIES[self.derivative]}" if self.derivative else "")

    @property
    def unit(self) -> str:
        """The SI unit."""
        return self.output.unit + PER_TIME[self.derivative]


@dataclass(frozen=True, eq=False)
class Study:
    """Variants of a case.

    Attributes:
        case: the case; its reference and scene are not used.
        samples: number of variants.
        order: highest time derivative of the outputs to reduce: 0, 1 or 2.
        tol: largest accepted constraint residual, relative to the mechanism's size.
        subset: share of the variants in the random subset for quantiles.
        picked: variants to cross-check; their values are kept.
        whole: whether to keep the values of all variants, for a store.
    """

    case: Case
    variation: Variation
    samples: int
    seed: int
    order: int = 0
    tol: float = 1e-12
    subset: float = 1.0
    picked: frozenset[int] = frozenset()
    whole: bool = False

    def __post_init__(self) -> None:
        require_no_held(self.case)

    @property
    def of_a_chunk(self) -> int:
        """Variants in a chunk. It depends on the study alone, so sums have the same round-off."""
        share = self.samples // CHUNKS
        return min(MOST_STORED if self.whole else MOST, max(LEAST, share - share % LEAST))

    @property
    def chunks(self) -> int:
        """The number of chunks."""
        return -(-self.samples // self.of_a_chunk)

    @cached_property
    def rows(self) -> tuple[ReducedQuantity, ...]:
        """The reduced quantities: each output with its requested and known derivatives."""
        return tuple(
            ReducedQuantity(output, derivative)
            for output in self.case.outputs
            for derivative in range(min(self.order + 1, output.orders))
        )  # fmt: skip

    @cached_property
    def limits(self) -> tuple[RowLimit, ...]:
        """The limits of the variation, by row.

        Raises:
            KincheckError: a limited derivative is not reduced.
        """
        names = [row.name for row in self.rows]
        for each in self.variation.limits:
            if each.output not in names:
                raise KincheckError(
                    f"limits of {each.output}: the study has no such row; give --order 1 for"
                    " velocities and 2 for accelerations too"
                )
        return tuple(
            RowLimit(names.index(each.output), each.low, each.high)
            for each in self.variation.limits
        )

    def of_variant(self, index: int) -> Case:
        """The case with the geometry of one variant."""
        values = self.variation.values(self.variation.of_variant(self.seed, index))
        name = f"{self.case.name} variant {index} of seed {self.seed}"
        return replace(
            self.case, name=name, mechanism=placed(self.case.mechanism, values), reference={}
        )


@dataclass(eq=False)
class Ready:
    """A study with a compiled model: it solves chunks, in any order and in several threads."""

    study: Study
    designs: PreparedDesigns
    path: Path

    @staticmethod
    def of(study: Study) -> Ready:
        """Return the study with a compiled model; the model solves only needed derivatives."""
        case = study.case
        # an output with one derivative less is a quotient of velocities; with two less it
        # contains derivatives of velocities
        order = max(
            3 - output.orders + min(study.order, output.orders - 1) for output in case.outputs
        )
        varied = tuple(study.variation.places)
        solver = NativeSolver(order=order)
        designs = solver.prepare_designs(
            case.mechanism, case.sweep.path, varied, without_forces(case).points, case.forces
        )
        return Ready(study, designs, case.sweep.path)

    def along(self, path: Path) -> Ready:
        """Return the same model on another path of the same drivers."""
        return Ready(self.study, self.designs.along(path), path)

    @property
    def lanes(self) -> int:
        """The number of variants solved at once."""
        return self.designs.at_once(TOGETHER)

    @cached_property
    def nominal(self) -> Array:
        """The values of the rows at the nominal design, shape (rows, n)."""
        return self.values(np.zeros((len(self.study.variation.coordinates), 1)))[0][:, :, 0]

    def values(self, offsets: Array) -> tuple[Array, NDArray[np.bool_], int, Mapping[int, str]]:
        """Return the results of variants.

        Returns:
            The values of the rows, shape (rows, n, V), NaN if missing; whether each sample is
            solved, shape (n, V); the number of retried variants; messages by variant.
        """
        geometry = self.study.variation.geometry(offsets)
        found = self.designs.solve(geometry, self.study.tol)
        forces = self.designs.forces(found, geometry, self.study.tol)
        rows = self._rows(found, geometry, forces)
        return rows, found.solved, found.retried, found.messages

    def _rows(self, found: Variants, geometry: Array, forces: ForcesOfDesigns | None) -> Array:
        at: dict[str, Vec3] = {}
        design: dict[str, Vec3] = {}
        numbers = self._numbers
        unknown = np.full((1, 1), np.nan)
        for name in without_forces(self.study.case).points:
            known = self.designs.motion(found, name)
            x, v, a = (known[k] if k < len(known) else (unknown,) * 3 for k in range(3))
            at[name] = Vec3(*(Jet(*each) for each in zip(x, v, a, strict=True)))
            place = f"points.{name}.position"
            where = (
                geometry[numbers[place]]
                if place in numbers
                else np.array(self.study.case.mechanism.point(name).position)
            )
            design[name] = Vec3(*(Jet(each, np.zeros(()), np.zeros(())) for each in where))
        values = np.empty((len(self.study.rows), *found.solved.shape))
        # unknown numbers are NaN, and every result of them is NaN
        with np.errstate(all="ignore"):
            case, path = self.study.case, self.path
            moved = without_forces(case).outputs
            jets = {o.name: counted(case.mechanism, path, o, at, design) for o in moved}
            for k, row in enumerate(self.study.rows):
                if isinstance(row.output, ForceMeasure):
                    assert forces is not None  # the case asks for them
                    values[k] = forces.read(row.output.values)
                    continue
                jet = jets[row.output.name]
                values[k] = (jet.x, jet.v, jet.a)[row.derivative]
        if not np.isfinite(values.sum()):
            values[~np.isfinite(values)] = np.nan
        return values

    @cached_property
    def _numbers(self) -> dict[str, slice]:
        """The slice of each varied place in the geometry."""
        found: dict[str, slice] = {}
        first = 0
        for place, size in self.study.variation.places.items():
            found[place] = slice(first, first := first + size)
        return found

    def chunk(self, index: int) -> Chunk:
        """Solve a chunk."""
        study, first = self.study, index * self.study.of_a_chunk
        count = min(study.of_a_chunk, study.samples - first)
        offsets = study.variation.offsets(study.seed, first, count)
        chosen = generator(study.seed, index, Stream.SUBSET).random(count) < study.subset
        totals, picked, kept = (
            Totals(len(study.rows), len(study.case.sweep.values)),
            dict[int, Array](),
            list[Array](),
        )
        unsolved: list[Unsolved] = []
        effects: list[Array] = []
        stored: list[Array] = []
        failures = retried = 0
        limited = np.zeros((len(study.limits) + 1, COUNTS), dtype=np.int64)
        for start in range(0, count, self.lanes):
            part = slice(start, min(start + self.lanes, count))
            values, solved, again, messages = self.values(offsets[:, part])
            totals.take(values, first + start)
            if study.limits:
                limited += limit_counts(values, solved, self.nominal, study.limits)
            kept.append(values[:, :, chosen[part]])
            picked |= {k: values[:, :, k - first - start].copy() for k in self._picked(first, part)}
            failures += len(messages)
            retried += again
            some = sorted(messages)[:MOST_MESSAGES]
            unsolved += [
                Unsolved(first + start + k, int((~solved[:, k]).sum()), messages[k]) for k in some
            ]
            if study.variation.mode is Mode.ONE_AT_A_TIME:
                effects.append(largest(values - self.nominal[:, :, None]))
            if study.whole:
                stored.append(values)
        return Chunk(
            index,
            count,
            totals.summary(),
            np.concatenate(kept, axis=2),
            picked,
            tuple(unsolved[:MOST_MESSAGES]),
            failures,
            retried,
            limited,
            np.concatenate(effects, axis=1) if effects else None,
            np.concatenate(stored, axis=2) if stored else None,
            offsets if study.whole else None,
        )

    def _picked(self, first: int, part: slice) -> Sequence[int]:
        if not self.study.picked:
            return ()
        return [k for k in range(first + part.start, first + part.stop) if k in self.study.picked]


def largest(changes: Array) -> Array:
    """Return the changes of largest size over the samples, signed, shape (rows, V).

    Args:
        changes: shape (rows, n, V). The result is NaN if all samples are NaN.
    """
    sizes = np.nan_to_num(np.abs(changes), nan=-1.0)
    return np.take_along_axis(changes, sizes.argmax(axis=1)[:, None, :], axis=1)[:, 0]
