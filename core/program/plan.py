"""Plans: the programs of a model, the slots of its lanes, and the order in which executors run
them; the data of executors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Array
from .straight_line import Program
from .tape import groups_behind

DONE, ITERATIONS, MARGIN = "done", "iterations", "margin"
"""Slots of an attempt: whether Newton converged, the number of iterations, and the acceptance
margin.
"""


@dataclass(frozen=True)
class Plan:
    """The programs of a model, and the slots and names for the loops over its lanes.

    An attempt runs `predict`, then `newton` until the slot `residual` of every lane is below the
    tolerance or not finite, then the programs in `after`, and at last those of a test. A lane is
    accepted if its margin is positive.

    `extrapolate`, if present, replaces `predict` for lanes after a group with all lanes accepted.
    It uses the slots of that group and no output of `onward`. If groups have few lanes it uses
    several groups and stores the earlier ones itself. It may also put out the carried slots.
    `extend` replaces `predict` for lanes that passed `NODES` samples; it uses the remembered slots
    of these.

    Attributes:
        programs: by name; they share one layout of slots.
        slots: position of every scalar in a lane, by name.
        after: names of the programs that end an attempt.
        alone, joined: names of the programs that test independent lanes, or neighbouring lanes of
            one motion.
        onward: names of the programs that make a solved lane ready for a prediction; they may also
            be in `after`.
        sampled: slots with a new value at every sample. Those of `extrapolate` are valid for groups
            that begin at a multiple of their lanes.
        behind: number of groups `extrapolate` uses.
        remembered: slots that `run_motions` stores at the last `NODES` samples, for `extend`;
            `follow` stores them of all groups for `extrapolate` but the last.
        past: first slot of the store: sample k is at position k modulo `NODES`, groups are in
            order.
        carried: slots of a solved lane, and the slots of the next prediction that take their
            values, in order of copying.
        continued: the same for lanes not predicted by `predict`; default `carried`.
        kept: slots stored at every sample.
        largest, smallest: slots reduced to their largest and smallest value: by `follow` over the
            stored samples, by `parts` over the parts.
        fixed: slots that differ between the parts of a large mechanism, and are equal in all lanes.
        taken: slots of a part that read results of earlier parts.
        tolerance: of the residual before an iteration; this iteration is the last.
        most: maximum number of iterations.
    """

    programs: Mapping[str, Program]
    slots: Mapping[str, int]
    after: Sequence[str] = ()
    alone: Sequence[str] = ()
    joined: Sequence[str] = ()
    onward: Sequence[str] = ()
    sampled: Sequence[int] = ()
    behind: int = 1
    remembered: Sequence[int] = ()
    past: int = 0
    carried: Sequence[tuple[int, int]] = ()
    continued: Sequence[tuple[int, int]] = ()
    kept: Sequence[int] = ()
    largest: Sequence[int] = ()
    smallest: Sequence[int] = ()
    fixed: Sequence[int] = ()
    taken: Sequence[int] = ()
    tolerance: float = 0.0
    most: int = 0

    @property
    def remaining(self) -> list[str]:
        """Names of the `onward` programs still to run after an attempt."""
        return [name for name in self.onward if name not in self.after]

    @property
    def best(self) -> Array:
        """Start values of the largest and smallest, shape (largest and smallest, 1)."""
        return np.array([[0.0]] * len(self.largest) + [[np.inf]] * len(self.smallest))

    @property
    def carried_on(self) -> Sequence[tuple[int, int]]:
        """Carried slots for lanes not predicted by `predict`."""
        return self.continued or self.carried

    def fixed_from(self, slots: Sequence[int]) -> list[tuple[int, int]]:
        """Return positions of carried slots among these, and of their targets in `fixed`."""
        found, place = ({slot: k for k, slot in enumerate(each)} for each in (slots, self.fixed))
        return [(found[a], place[b]) for a, b in self.carried if a in found and b in place]

    @property
    def moves(self) -> Sequence[tuple[int, int]]:
        """Slots of `carried_on` to copy before `extrapolate`, which puts out the rest itself."""
        return [
            pair for pair in self.carried_on if pair[1] not in self.programs["extrapolate"].outputs
        ]

    def extrapolates(self, lanes: int) -> bool:
        """Return whether groups with so many lanes are followed by extrapolation."""
        return "extrapolate" in self.programs and groups_behind(lanes) == self.behind


def shifted(past: int, remembered: Sequence[int], behind: int) -> Sequence[tuple[int, int]]:
    """Return source and target slots that store the last group as an earlier one; see `Plan`."""
    count = len(remembered)
    places = [*range(past, past + (behind - 1) * count), *remembered]
    return list(zip(places[count:], places, strict=False))


@dataclass(frozen=True, eq=False)
class Side:
    """The samples on one side of the start of a motion, outwards.

    Attributes:
        samples: `Plan.sampled` of each, shape (sampled, count + margin), contiguous; the last
            column is repeated at the end.
        count: number of samples.
        first, step: column of the first among all samples, and the step to the next: 1 or -1.
    """

    samples: Array
    count: int
    first: int
    step: int


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of a large mechanism with a common plan. All arrays are contiguous, and must outlive
    the call made from them.

    Attributes:
        members: rows of `fixed` of these parts, in order.
        fixed: values of `Plan.fixed`, shape (all members, fixed); in and out: see `NumpyExecutor`.
        samples: values of `Plan.sampled`, shape (sampled, room).
        taken: rows of the world that `Plan.taken` read, shape (parts, taken).
        world: all solved values, shape (rows, room); output `Plan.kept` of a member from row `base
            + member * kept`.
        worst: in and out: the largest of `Plan.largest` and the smallest of `Plan.smallest` per
            lane, over its previous value and all parts, NaN if any is; shape (largest and smallest,
            room).
    """

    members: NDArray[np.int64]
    fixed: Array
    samples: Array
    taken: NDArray[np.int64]
    world: Array
    base: int
    worst: Array
