"""A study: which variants of which case, and what is wanted of them. Plain data, sent anywhere.
Made ready, it solves chunks of the variants.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...algebra import Vec3
from ...case.case import Case, Quantity, without_forces
from ...case.held import require_no_held
from ...case.measures import ForceMeasure
from ...case.rotation import counted
from ...case.variation.modes import Mode
from ...case.variation.sampling import Stream, generator
from ...case.variation.variation import Variation
from ...errors import KincheckError
from ...jet import Jet
from ...kinematics import ForcesOfDesigns, NativeSolver, PreparedDesigns, Variants, placed
from ...mechanism.motions import Path
from ...trajectory import PER_TIME, QUANTITIES, Array
from .chunk import Chunk, Unsolved
from .limit_counts import COUNTS, RowLimit, limit_counts
from .streaming_totals import Totals

# Variants that are solved together: what calls cost that reduce them is lost among as many.
# `solve_designs`, which reduces nothing, is as fast with a quarter of them.
TOGETHER = 1024
# A study is in so many chunks for threads and workers to share, as far as that makes none smaller
# than the least, nor larger than the most: each costs the other threads a pause of Python's lock,
# and on a cluster the scheduler a millisecond.
CHUNKS, LEAST, MOST = 64, 64, 4096
# Where the values of all variants are stored, so many are held at once.
MOST_STORED = 256
# Messages of a chunk that are passed on; all variants without a solution are counted.
MOST_MESSAGES = 50


@dataclass(frozen=True, eq=False)
class ReducedQuantity:
    """One quantity that is reduced: an output, or its first or second derivative by time."""

    output: Quantity
    derivative: int

    @property
    def name(self) -> str:
        """The name of the output, with that of its derivative as in reference tables."""
        return self.output.name + (f".{QUANTITIES[self.derivative]}" if self.derivative else "")

    @property
    def unit(self) -> str:
        """The unit, SI."""
        return self.output.unit + PER_TIME[self.derivative]


@dataclass(frozen=True, eq=False)
class Study:
    """Variants of a case.

    Attributes:
        case: its reference and scene are of no use here.
        samples: how many variants.
        order: derivatives of the outputs by time that are wanted besides: 0, 1 or 2.
        tol: largest accepted constraint residual, relative to the mechanism's size.
        subset: share of the variants whose values are kept for quantiles.
        picked: variants whose values are wanted, to be cross-checked.
        whole: the values of all variants are wanted, to be stored.
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
        """Variants of a chunk, solved in one thread; the study alone decides: sums are equal."""
        share = self.samples // CHUNKS
        return min(MOST_STORED if self.whole else MOST, max(LEAST, share - share % LEAST))

    @property
    def chunks(self) -> int:
        """How many chunks the variants are in."""
        return -(-self.samples // self.of_a_chunk)

    @cached_property
    def rows(self) -> tuple[ReducedQuantity, ...]:
        """What is reduced: outputs, each with its derivatives as far as wanted and known."""
        return tuple(
            ReducedQuantity(output, derivative)
            for output in self.case.outputs
            for derivative in range(min(self.order + 1, output.orders))
        )  # fmt: skip

    @cached_property
    def limits(self) -> tuple[RowLimit, ...]:
        """The limits of the variation, by rows.

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
    """A study with its model compiled: solves chunks, in any order and in several threads."""

    study: Study
    designs: PreparedDesigns

    @staticmethod
    def of(study: Study) -> Ready:
        """Return a study made ready; no derivative is solved that no output needs."""
        case = study.case
        # an output of one derivative less is a quotient of velocities, and of two less has their
        # derivatives in it
        order = max(
            3 - output.orders + min(study.order, output.orders - 1) for output in case.outputs
        )
        varied = tuple(study.variation.places)
        solver = NativeSolver(order=order)
        designs = solver.prepare_designs(
            case.mechanism, case.sweep.path, varied, without_forces(case).points, case.forces
        )
        return Ready(study, designs)

    def along(self, path: Path) -> Ready:
        """The same model on another path of the same drivers."""
        return Ready(self.study, self.designs.along(path))

    @property
    def lanes(self) -> int:
        """Variants that are solved at once."""
        return self.designs.at_once(TOGETHER)

    @cached_property
    def nominal(self) -> Array:
        """The rows at the nominal design, shape (rows, n)."""
        return self.values(np.zeros((len(self.study.variation.coordinates), 1)))[0][:, :, 0]

    def values(self, offsets: Array) -> tuple[Array, NDArray[np.bool_], int, Mapping[int, str]]:
        """The rows of variants, NaN where there is none, shape (rows, n, V); which samples are
        solved (n, V); retried; messages.
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
        # what is not known is NaN, and what is made of it becomes NaN
        with np.errstate(all="ignore"):
            case = self.study.case
            path = case.sweep.path
            moved = without_forces(case).outputs
            jets = {o.name: counted(o.of(at, design), o.period, path) for o in moved}
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
        """Where the numbers of each varied place are."""
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
            limited += limit_counts(values, study.limits)
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
    """Return of changes, shape (rows, n, V), the largest in size over the samples, signed, shape
    (rows, V); NaN without any.
    """
    sizes = np.nan_to_num(np.abs(changes), nan=-1.0)
    return np.take_along_axis(changes, sizes.argmax(axis=1)[:, None, :], axis=1)[:, 0]
