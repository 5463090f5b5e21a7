"""What runs programs: lanes that programs read and write in place, and the loops over them that follow a motion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Array
from .straight_line import Program
from .trace import NODES

DONE, ITERATIONS, MARGIN = "done", "iterations", "margin"
"""Slots that an attempt writes: whether Newton's iteration ended, after how many, and by how much the lane may be accepted."""


@dataclass(frozen=True)
class Plan:
    """The programs of a model, and what the loops over its lanes are made of.

    An attempt runs `predict`, then `newton` until the slot `residual` of every lane is below the tolerance or not finite, then the
    programs in `after`, and at last the test whose margin is positive where the lane may be accepted: `alone` for lanes that know
    nothing of each other, `joined` for lanes that are neighbours on one way.

    Where there is a program `extrapolate` it takes the place of `predict` for lanes that follow a group that was accepted whole:
    it goes by what stands in those lanes, so that `onward` need not be run for them.

    Attributes:
        programs: by name; they share one layout of slots.
        slots: place of every scalar in a lane, by name.
        after: names of the programs that end an attempt.
        onward: names of the programs that make a solved lane ready to be predicted from.
        sampled: slots that are given anew at every sample.
        carried: slots of a solved lane, and the slots it is predicted from that take them over, one after the other.
        kept: slots that are stored of every sample.
        fixed: slots that differ from part to part of a large mechanism, and are the same in all lanes.
        taken: slots that a part takes from what was solved before it.
        loops: methods of the executor that are used besides `run` and `attempt`: "follow", "fan" or "parts".
        tolerance: of the residual before an iteration; that iteration is the last.
        most: iterations at most.
    """

    programs: Mapping[str, Program]
    slots: Mapping[str, int]
    after: Sequence[str] = ()
    onward: Sequence[str] = ()
    sampled: Sequence[int] = ()
    carried: Sequence[tuple[int, int]] = ()
    kept: Sequence[int] = ()
    fixed: Sequence[int] = ()
    taken: Sequence[int] = ()
    loops: Sequence[str] = ()
    tolerance: float = 0.0
    most: int = 0

    def extrapolates(self, lanes: int) -> bool:
        """Whether a group of that many lanes is followed by extrapolation."""
        return "extrapolate" in self.programs and lanes >= NODES


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of a large mechanism that share a plan. All arrays are contiguous, and live as long as what is called with them.

    Attributes:
        members: which rows of `fixed` they are, in order.
        fixed: values of `Plan.fixed`, shape (all members, fixed).
        samples: values of `Plan.sampled`, shape (sampled, room).
        taken: rows of the world that `Plan.taken` come from, shape (parts, taken).
        world: all that has been solved, shape (rows, room); takes `Plan.kept` of a member from row `base + member * kept` on.
    """

    members: NDArray[np.int64]
    fixed: Array
    samples: Array
    taken: NDArray[np.int64]
    world: Array
    base: int


class Executor(Protocol):
    """A plan bound to a number of lanes. Lanes that divide by zero hold inf or nan afterwards; nothing is raised."""

    @property
    def lanes(self) -> int: ...
    @property
    def margin(self) -> int:
        """Samples that `follow` may read beyond the last."""
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

    def run(self, name: str) -> None:
        """Run one program over all lanes."""
        ...

    def attempt(self) -> None:
        """Make an attempt at all lanes, each alone."""
        ...

    def table(self, rows: int, n: int, at: int) -> tuple[Array, int]:
        """Room for what `follow` keeps of n samples, shape (rows, columns), and the column of the first; both ways from the sample
        `at` its vectors are cache lines.
        """
        ...

    @property
    def anchor(self) -> Array:
        """Slots of where the motion stands that `follow` follows, shape (slots,)."""
        ...

    def follow(self, samples: Array, at: int, stop: int, out: Array, first: int, step: int) -> int:
        """Follow one motion: attempt its next samples as neighbouring lanes, go on from the last one accepted, until none is.

        The anchor goes along.

        Args:
            samples: `Plan.sampled` of the samples of the motion, shape (sampled, n + margin), contiguous; the last column repeated
                at the end.
            at, stop: the sample that comes next, and the one before which to end.
            out: takes `Plan.kept` of the samples; a `table`.
            first, step: column of the first of the samples, and from each to the next: 1 or -1.

        Returns:
            The first sample that was not accepted, or stop.
        """
        ...

    @property
    def room(self) -> int:
        """Lanes with those that fill up the last vector."""
        ...

    def fan(self, samples: Array, out: Array, first: int, step: int) -> None:
        """Follow as many motions as there are lanes through the same samples, each lane alone.

        Args:
            samples: `Plan.sampled`, shape (sampled, n).
            out: takes `Plan.kept`, shape (kept, columns, room), contiguous; NaN from where a lane was not accepted.
            first, step: column of the first sample, and from each to the next: 1 or -1.
        """
        ...

    def groups(self, lanes: int) -> int:
        """How many groups of vectors hold so many lanes."""
        ...

    def parts(self, parts: Parts) -> Callable[[int], object]:
        """A call that attempts parts of a large mechanism, one after the other, by what stands in their arrays when it is called.

        What is called is told in how many groups; each lane is attempted alone.
        """
        ...
