"""What runs programs: lanes that programs read and write in place, and the loops over them that
follow a motion.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Array
from .straight_line import Program
from .tape import groups_behind

Table = TypeVar("Table", bound=NDArray[Any])

DONE, ITERATIONS, MARGIN = "done", "iterations", "margin"
"""Slots that an attempt writes: whether Newton's iteration ended, after how many, and by how much
the lane may be accepted.
"""
LINE = 8
"""Numbers in a cache line."""


@dataclass(frozen=True)
class Plan:
    """The programs of a model, and what the loops over its lanes are made of.

    An attempt runs `predict`, then `newton` until the slot `residual` of every lane is below the
    tolerance or not finite, then the programs in `after`, and at last those of a test, whose margin
    is positive where the lane may be accepted.

    Where there is a program `extrapolate` it takes the place of `predict` for lanes that follow a
    group that was accepted whole: it goes by what stands in those lanes, and needs nothing of what
    `onward` puts out. Where groups are of few lanes it goes by several of them, and remembers the
    earlier ones itself. What is carried of the last lane it may put out, too. So does `extend`, for
    lanes that have come through `NODES` samples: it goes by what is remembered of these.

    Attributes:
        programs: by name; they share one layout of slots.
        slots: place of every scalar in a lane, by name.
        after: names of the programs that end an attempt.
        alone, joined: names of the programs that test lanes: that know nothing of each other, or
            are neighbours on one way.
        onward: names of the programs that make a solved lane ready to be predicted from; they may
            be in `after` too.
        sampled: slots that are given anew at every sample; what `extrapolate` is given holds for
            groups that begin at a multiple of their lanes.
        behind: how many groups `extrapolate` goes by.
        remembered: slots of which `fan` keeps what was there at the last `NODES` samples, for
            `extend`, and `follow` what was there in all groups but the last that `extrapolate` goes
            by.
        past: the slot they begin to keep them at: those of sample k are at place k modulo `NODES`,
            those of groups in order.
        carried: slots of a solved lane, and the slots it is predicted from that take them over, one
            after the other.
        continued: the same where those after it are not predicted by `predict`; `carried`, unless
            it is given.
        kept: slots that are stored of every sample.
        largest, smallest: slots of which the largest and the smallest are found: by `follow` over
            the samples it keeps, by `parts` over the parts.
        fixed: slots that differ from part to part of a large mechanism, and are the same in all
            lanes.
        taken: slots that a part takes from what was solved before it.
        tolerance: of the residual before an iteration; that iteration is the last.
        most: iterations at most.
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
        """Names of the programs that make a lane ready to be predicted from once its attempt has
        ended.
        """
        return [name for name in self.onward if name not in self.after]

    @property
    def best(self) -> Array:
        """Where the worst of anything begins, shape (largest and smallest, 1)."""
        return np.array([[0.0]] * len(self.largest) + [[np.inf]] * len(self.smallest))

    @property
    def carried_on(self) -> Sequence[tuple[int, int]]:
        """What is carried where those after it are not predicted by `predict`."""
        return self.continued or self.carried

    @property
    def left(self) -> Sequence[tuple[int, int]]:
        """Slots that are carried to slots that are fixed, and the places of those among them."""
        place = {slot: k for k, slot in enumerate(self.fixed)}
        return [(source, place[target]) for source, target in self.carried if target in place]

    @property
    def moved(self) -> Sequence[tuple[int, int]]:
        """What of `carried_on` is to be copied before `extrapolate`, which puts out the rest
        itself.
        """
        return [
            pair for pair in self.carried_on if pair[1] not in self.programs["extrapolate"].outputs
        ]

    def extrapolates(self, lanes: int) -> bool:
        """Whether groups of that many lanes are followed by extrapolation."""
        return "extrapolate" in self.programs and groups_behind(lanes) == self.behind


def shifted(past: int, remembered: Sequence[int], behind: int) -> Sequence[tuple[int, int]]:
    """Slots of the last group and those before, and where they are remembered when it becomes one
    of those; see `Plan`.
    """
    count = len(remembered)
    places = [*range(past, past + (behind - 1) * count), *remembered]
    return list(zip(places[count:], places, strict=False))


@dataclass(frozen=True, eq=False)
class Side:
    """The samples on one side of where a motion starts, outwards.

    Attributes:
        samples: `Plan.sampled` of each, shape (sampled, count + margin), contiguous; the last
            column repeated at the end.
        count: how many there are.
        first, step: column of the first among all samples, and from each to the next: 1 or -1.
    """

    samples: Array
    count: int
    first: int
    step: int


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of a large mechanism that share a plan. All arrays are contiguous, and live as long as
    what is called with them.

    Attributes:
        members: which rows of `fixed` they are, in order.
        fixed: values of `Plan.fixed`, shape (all members, fixed).
        ahead: takes those of the lanes after the last one, of the same shape: of what is carried,
            what that is carried from.
        samples: values of `Plan.sampled`, shape (sampled, room).
        taken: rows of the world that `Plan.taken` come from, shape (parts, taken).
        world: all that has been solved, shape (rows, room); takes `Plan.kept` of a member from row
            `base + member * kept` on.
        worst: takes the largest of `Plan.largest` and the smallest of `Plan.smallest`, lane by
            lane, of what stood there and of all parts, NaN where that is among them; shape (largest
            and smallest, room).
    """

    members: NDArray[np.int64]
    fixed: Array
    ahead: Array
    samples: Array
    taken: NDArray[np.int64]
    world: Array
    base: int
    worst: Array


class Executor(Protocol):
    """A plan bound to a number of lanes. Lanes that divide by zero hold inf or nan afterwards;
    nothing is raised.
    """

    @property
    def lanes(self) -> int: ...
    @property
    def group(self) -> int:
        """Lanes that a track attempts together."""
        ...

    @property
    def margin(self) -> int:
        """Samples that a track may read beyond the last."""
        ...

    def clear(self) -> None:
        """Set all slots of all lanes to zero."""
        ...

    def put(self, slots: Sequence[int], values: Array) -> None:
        """Set slots of all lanes, shape (slots, lanes) or (slots, 1)."""
        ...

    def get(self, slots: Sequence[int]) -> Array:
        """A copy of slots of all lanes, shape (slots, lanes)."""
        ...

    def window(self, slots: range) -> Array:
        """The memory of slots itself, shaped as what `arranged` gives."""
        ...

    def arranged(self, table: Table) -> Table:
        """A table of slots by lanes as it would stand in memory; what fills up the last vector is
        as the last lane.
        """
        ...

    def run(self, name: str) -> None:
        """Run one of `Plan.programs` over all lanes."""
        ...

    def attempt(self) -> None:
        """Make an attempt at all lanes, each alone."""
        ...

    def carry(self) -> None:
        """Have solved lanes predicted from: `Plan.carried`."""
        ...

    def track(self, sides: Sequence[Side], start: Array, n: int) -> Track:
        """Bind the samples of one motion, n in all, and where it starts: what `Plan.carried` takes
        over, in that order.
        """
        ...

    @property
    def room(self) -> int:
        """Lanes with those that fill up the last vector."""
        ...

    def table(self, columns: int) -> Array:
        """Room for what `fan` puts out, shape (kept, columns, room)."""
        ...

    def fan(self, samples: Array, out: Array, worst: Array, first: int, step: int) -> None:
        """Follow as many motions as there are lanes through the same samples, each lane alone.

        Args:
            samples: `Plan.sampled`, shape (sampled, n).
            out: a table, which takes `Plan.kept`; NaN from where a lane was not accepted.
            worst: takes the largest of `Plan.largest` and the smallest of `Plan.smallest`, lane by
                lane, of what stood there and of all samples; NaN where a lane was not accepted.
                Shape (largest and smallest, room).
            first, step: column of the first sample, and from each to the next: 1 or -1.
        """
        ...

    def fold(self, table: Array, totals: Array) -> None:
        """Take numbers into totals, column by column, in the first group of lanes.

        `Plan.kept` are set to what stood in the totals; then as many groups of numbers as there are
        slots in `Plan.taken` are read at a time, and the programs in `after` run; at the end
        `Plan.kept` are put out.

        Args:
            table: shape (columns, room), contiguous; what is read at a time fits into the room a
                whole number of times.
            totals: shape (kept, columns, group), contiguous.
        """
        ...

    def groups(self, lanes: int) -> int:
        """How many groups of vectors hold so many lanes."""
        ...

    def parts(self, parts: Parts) -> Callable[[int], object]:
        """A call that attempts parts of a large mechanism, one after the other, by what stands in
        their arrays when it is called.

        What is called is told in how many groups; each lane is attempted alone.
        """
        ...


class Track(Protocol):
    """A motion that an executor follows along both sides of where it starts, through samples it
    knows.

    Attributes:
        anchors: where the motion stands on each side: what `Plan.carried` takes over, a row a side.
        worst: the largest of `Plan.largest`, or zero, and the smallest of `Plan.smallest`, over all
            samples kept since `begin`.
    """

    anchors: Array
    worst: Array

    def begin(self) -> Array:
        """Room for `Plan.kept` of all samples, shape (kept, n), which is filled from now on.

        Hold it as long as samples are followed: it is not held here, for it may be large, and
        belongs to whoever asked for it.
        """
        ...

    def run(self) -> Sequence[int]:
        """Follow every side from the start to its end: the first sample of each that was not
        accepted, or how many there are.

        The anchor of a side that came to its end is of no use: nothing is made ready there to go
        on.
        """
        ...

    def follow(self, side: int, at: int, stop: int, *, anew: bool) -> int:
        """Attempt the next samples of a side as neighbouring lanes, go on from the last one
        accepted, until none is.

        Args:
            at, stop: the sample that comes next, and the one before which to end.
            anew: from the start, and not from the side's anchor. That goes along.

        Returns:
            The first sample that was not accepted, or stop.
        """
        ...
