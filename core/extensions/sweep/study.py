"""A study of design variants: a case, its variants, and the values to reduce or keep.

A `Study` is plain data, picklable. A `Ready` study has a compiled model: it solves chunks of
variants.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...case.case import Case, Quantity
from ...errors import KincheckError
from ...kinematics import placed
from ...mechanism.motions import Path
from ...trajectory import PER_TIME, QUANTITIES, Array
from ..designs.outputs import DesignOutputs
from .statistics import Summary, empty_summary, merge, summary_of
from .study_choices import Mode
from .variation import Stream, Variation, generator

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
    if not limits:
        return np.zeros((1, COUNTS), dtype=np.int64)
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


# Number of chunks for threads and workers to share, and the least and largest number of variants in
# a chunk. A chunk has a price: the other threads wait for Python's lock, and the scheduler of a
# cluster spends a millisecond.
CHUNKS, LEAST, MOST = 64, 64, 4096
# Largest chunk if the values of all variants are stored, to limit the memory.
MOST_STORED = 256
# Largest number of messages kept; the count of unsolved variants is complete.
MOST_MESSAGES = 50


@dataclass(frozen=True)
class Unsolved:
    """A variant without a solution at some samples, and the reason."""

    variant: int
    samples: int
    message: str


@dataclass(frozen=True, eq=False)
class Chunk:
    """Results of consecutive variants: plain data, picklable. A sum is of the variants of both.

    Attributes:
        index: number of the chunk; of a sum, the last one.
        count: number of variants.
        kept: values of the random subset, in parts of shape (rows, n, some).
        picked: values of picked variants, by variant, shape (rows, n).
        unsolved: the first variants without a solution at some samples.
        failures: number of all such variants.
        retried: number of variants solved again alone, with divided steps.
        limited: counts of variants by specification limit, see `limit_counts`.
        effects: the largest change of each row over the samples, signed, in parts of shape (rows,
            some); of no variants unless the mode varies one coordinate at a time.
        stored: values of all variants, shape (rows, n, some), and their offsets, shape
            (coordinates, some), in parts; none unless the study stores them.
    """

    index: int
    count: int
    summary: Summary
    kept: tuple[Array, ...]
    picked: Mapping[int, Array]
    unsolved: tuple[Unsolved, ...]
    failures: int
    retried: int
    limited: NDArray[np.int64]
    effects: tuple[Array, ...] = ()
    stored: tuple[tuple[Array, Array], ...] = ()

    def __add__(self, later: Chunk) -> Chunk:
        return Chunk(
            later.index,
            self.count + later.count,
            merge(self.summary, later.summary),
            self.kept + later.kept,
            {**self.picked, **later.picked},
            (self.unsolved + later.unsolved)[:MOST_MESSAGES],
            self.failures + later.failures,
            self.retried + later.retried,
            self.limited + later.limited,
            self.effects + later.effects,
            self.stored + later.stored,
        )


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
                    f"limits of {each.output}: the study has no such row. Give --order 1 for"
                    " velocities and 2 for accelerations too."
                )
        return tuple(
            RowLimit(names.index(each.output), each.low, each.high)
            for each in self.variation.limits
        )

    @property
    def empty_chunk(self) -> Chunk:
        """The results of no variants, before the first chunk."""
        rows, n = len(self.rows), len(self.case.sweep.values)
        limited = np.zeros((len(self.limits) + 1, COUNTS), dtype=np.int64)
        kept = (np.empty((rows, n, 0)),)
        effects = (np.empty((rows, 0)),)
        return Chunk(-1, 0, empty_summary(rows, n), kept, {}, (), 0, 0, limited, effects)

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
    outputs: DesignOutputs

    @staticmethod
    def of(study: Study) -> Ready:
        """Return the study with a compiled model; the model solves only needed derivatives."""
        places = study.variation.places
        return Ready(study, DesignOutputs.of(study.case, places, derivative=study.order))

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
        solved = self.outputs.solve(self.study.variation.geometry(offsets), self.study.tol)
        rows = np.empty((len(self.study.rows), *solved.solved.shape))
        for k, row in enumerate(self.study.rows):
            rows[k] = solved.values(row.output.name, row.derivative)
        return rows, solved.solved, solved.found.retried, solved.found.messages

    def chunk(self, index: int) -> Chunk:
        """Solve a chunk."""
        study, first = self.study, index * self.study.of_a_chunk
        count = min(study.of_a_chunk, study.samples - first)
        offsets = study.variation.offsets(study.seed, first, count)
        chosen = generator(study.seed, index, Stream.SUBSET).random(count) < study.subset
        found = study.empty_chunk
        # in equal parts: one executor serves all
        size = math.ceil(count / math.ceil(count / self.outputs.at_once))
        for start in range(0, count, size):
            part = slice(start, start + size)
            found += self._part(index, first + start, offsets[:, part], chosen[part])
        return found

    def _part(self, index: int, first: int, offsets: Array, chosen: NDArray[np.bool_]) -> Chunk:
        """Solve the variants from a first one on, all at once.

        Args:
            chosen: whether each is in the random subset, shape (V,).
        """
        study, count = self.study, len(chosen)
        values, solved, retried, messages = self.values(offsets)
        alone = study.variation.mode is Mode.ONE_AT_A_TIME
        return Chunk(
            index,
            count,
            summary_of(values, first),
            (values if chosen.all() else np.compress(chosen, values, axis=2),)
            if chosen.any()
            else (),
            {
                k: values[:, :, k - first].copy()
                for k in study.picked.intersection(range(first, first + count))
            },
            tuple(
                Unsolved(first + k, int((~solved[:, k]).sum()), messages[k])
                for k in sorted(messages)[:MOST_MESSAGES]
            ),
            len(messages),
            retried,
            limit_counts(values, solved, self.nominal, study.limits),
            (largest(values - self.nominal[:, :, None]),) if alone else (),
            ((values, offsets),) if study.whole else (),
        )


def largest(changes: Array) -> Array:
    """Return the changes of largest size over the samples, signed, shape (rows, V).

    Args:
        changes: shape (rows, n, V). The result is NaN if all samples are NaN.
    """
    sizes = np.nan_to_num(np.abs(changes), nan=-1.0)
    return np.take_along_axis(changes, sizes.argmax(axis=1)[:, None, :], axis=1)[:, 0]


@dataclass(frozen=True, eq=False)
class Gradients:
    """Derivatives of the rows of a study by its coordinates, at the nominal design: exact slopes.

    Attributes:
        along: over the samples [unit of row / unit of coordinate], shape (coordinates, rows, n);
            NaN if the nominal design has no value, or a force no slope there.
        design: at the design position, shape (coordinates, rows); None if the case does not
            pass through it.
    """

    along: Array
    design: Array | None


def gradients(study: Study) -> Gradients:
    """Return the gradients of a study."""
    case, variation, path = study.case, study.variation, study.case.sweep.path
    orders = {each.output.name: each.derivative + 1 for each in study.rows}
    made = DesignOutputs.of(case, variation.places, derivative=study.order, slopes=orders)
    n, start = len(path.times), made.designs.route.begin
    if start.starts_at_design:  # one sample more, at the design position
        path = Path(path.motions, np.append(path.times, start.time), path.design)
    solved = made.on_path(path).solve(variation.nominal[:, None], study.tol)
    found = {(name, order): each for name, order, each in solved.slopes(variation.moves)}
    rows = [found[each.output.name, each.derivative][:, :, 0] for each in study.rows]
    along = np.stack(rows, axis=1)
    return Gradients(along[:, :, :n], along[:, :, n] if start.starts_at_design else None)
