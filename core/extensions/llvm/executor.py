"""Execution of plans by machine code over vectors of lanes: a call per motion, without the GIL."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from ...program.plan import Parts, Side
from ...trajectory import Array
from .jit import LlvmCode
from .loops import MOTION, SIDE
from .plan import BYTES, LINE, address, aligned

OUT, FORGET = (MOTION.index(each) for each in ("ptr out", "i64 forget"))
REACHED = SIDE.index("i64 reached")


class LlvmExecutor:
    """A plan bound to lanes: groups of a vector's width W, memory of shape (groups, slots, W).

    Copies of the last lane fill up the last group.
    """

    def __init__(self, code: LlvmCode, lanes: int) -> None:
        self.lanes, self.group, self.margin, self._code = lanes, code.width, code.width, code
        self._groups = self.groups(lanes)
        self._memory = aligned(self._groups * code.stride * code.width).reshape(
            self._groups, code.stride, code.width
        )
        self.clear()
        self._address = address(self._memory)

    def clear(self) -> None:
        """See `NumpyExecutor`."""
        self._memory[:] = 0.0

    def put(self, slots: Sequence[int], values: Array) -> None:
        """See `NumpyExecutor`."""
        # equal values of all lanes need no arrangement
        self._memory[:, _places(slots)] = values if values.shape[1] == 1 else self._arrange(values)

    def get(self, slots: Sequence[int]) -> Array:
        """See `NumpyExecutor`."""
        found = np.empty((len(slots), self._groups, self.group))
        found[:] = self._memory[:, _places(slots)].transpose(1, 0, 2)
        return found.reshape(len(slots), -1)[:, : self.lanes]

    def window(self, slots: range) -> Array:
        """See `NumpyExecutor`."""
        return self._memory[:, _places(slots)]

    def _arrange(self, table: Array) -> Array:
        """Return a table of slots by lanes in memory layout; the last lane fills up the last
        vector.
        """
        padded = table
        if self.room > self.lanes:
            padded = np.empty((len(table), self.room))
            padded[:, : self.lanes] = table
            padded[:, self.lanes :] = padded[:, self.lanes - 1 : self.lanes]
        return padded.reshape(len(table), self._groups, self.group).transpose(1, 0, 2)

    def run(self, name: str) -> None:
        """See `NumpyExecutor`."""
        code = self._code
        code.call("follow", "run_program")(self._address, self._groups, code.memory.entry(name))
        self._code.count(self._groups)

    def attempt(self) -> None:
        """See `NumpyExecutor`."""
        self._code.call("follow", "attempt")(self._address, self._groups)
        self._code.count(self._groups)

    def carry(self) -> None:
        """See `NumpyExecutor`."""
        self._code.call("follow", "carry")(self._address, self._groups)

    def track(self, sides: Sequence[Side], start: Array, n: int) -> LlvmTrack:
        """See `NumpyExecutor`."""
        return LlvmTrack(self._code, self._memory, sides, start, n)

    @property
    def room(self) -> int:
        """See `NumpyExecutor`."""
        return self._groups * self.group

    def table(self, columns: int) -> Array:
        """See `NumpyExecutor`."""
        shape = len(self._code.plan.kept), columns, self.room
        return aligned(math.prod(shape)).reshape(shape)

    def run_motions(self, samples: Array, out: Array, worst: Array, first: int, step: int) -> None:
        """See `NumpyExecutor`."""
        stride, wanted = samples.strides[0] // samples.itemsize, samples.shape[1]
        given = self._address, self._groups, samples.ctypes.data, stride, wanted
        self._code.call("fan", "fan")(
            *given, out.ctypes.data, *out.shape[1:], first, step, worst.ctypes.data
        )
        self._code.count(self._groups * wanted)

    def groups(self, lanes: int) -> int:
        """See `NumpyExecutor`."""
        return -(-lanes // self._code.width)

    def parts(self, parts: Parts) -> Callable[[int], object]:
        """See `NumpyExecutor`."""
        samples, addresses = (
            parts.samples,
            [each.ctypes.data for each in (parts.taken, parts.world)],
        )
        own = [each.ctypes.data for each in (parts.members, parts.fixed, parts.ahead, samples)]
        tables = *own, samples.shape[1], *addresses, parts.base, parts.worst.ctypes.data
        call = partial(
            self._code.call("parts", "parts"), self._address, len(parts.members), *tables
        )

        def count(groups: int) -> None:
            call(groups)
            self._code.count(groups * len(parts.members))

        return count


class LlvmTrack:
    """See `NumpyTrack`. Vectors of samples are aligned to cache lines on both sides of the start: a
    vector across two lines takes longer.
    """

    def __init__(
        self, code: LlvmCode, memory: Array, sides: Sequence[Side], start: Array, n: int
    ) -> None:
        plan, width = code.plan, code.width
        self._start, self.anchors = start.copy(), np.tile(start, (len(sides), 1))
        self.worst = np.zeros(len(plan.largest) + len(plan.smallest))
        below = min((side.first for side in sides if side.step > 0), default=n)
        margin = width + -below % width  # a vector may be written beyond either end
        row = margin + n + width
        row += -row % LINE
        self._shape, self._strides, self._margin = (
            (len(plan.kept), n),
            (row * BYTES, BYTES),
            margin * BYTES,
        )
        self._room = len(plan.kept) * row + LINE
        start_at, anchors = address(self._start), [address(anchor) for anchor in self.anchors]
        # in the order of MOTION and SIDE
        self._motion = np.array(
            [address(memory), start_at, address(self.worst), 0, row, 1, len(sides)], np.int64
        )
        tables = [_in_lines(side.samples) for side in sides]
        fields = [
            (address(table), table.shape[1], margin + side.first, side.step, side.count, anchor, 0)
            for side, table, anchor in zip(sides, tables, anchors, strict=True)
        ]
        # never empty: an empty array has no address
        self._sides = np.array([*fields, (0,) * len(SIDE)], np.int64)
        self._counts, motion = [side.count for side in sides], address(self._motion)
        self._run = partial(code.call("follow", "run"), motion, address(self._sides))
        follow = partial(code.call("follow", "follow"), motion)
        places = [
            (address(each), anchor) for each, anchor in zip(self._sides, anchors, strict=False)
        ]
        self._follow = [
            {True: partial(follow, at, start_at), False: partial(follow, at, anchor)}
            for at, anchor in places
        ]
        self._code, self._groups = code, sum(-(-side.count // width) for side in sides)
        self._alive = memory, tables  # keeps their addresses valid

    def begin(self) -> Array:
        """See `NumpyTrack`."""
        room = np.empty(self._room)
        start = address(room)
        skip = -start % (LINE * BYTES)
        self._motion[OUT] = start + skip
        self._motion[FORGET] = 1
        return np.ndarray(self._shape, np.float64, room, skip + self._margin, self._strides)

    def run(self) -> Sequence[int]:
        """See `NumpyTrack`."""
        early = self._run()
        self._code.count(self._groups)
        return self._sides[: len(self._counts), REACHED].tolist() if early else self._counts

    def follow(self, side: int, at: int, stop: int, *, anew: bool) -> int:
        """See `NumpyTrack`."""
        return self._follow[side][anew](at, stop)


def _places(slots: Sequence[int]) -> Sequence[int] | slice:
    """Return slots as an index; numpy would convert a range to an array each time."""
    return slice(slots.start, slots.stop) if isinstance(slots, range) and slots.step == 1 else slots


def _in_lines(samples: Array) -> Array:
    """Return a copy with each row aligned to a cache line."""
    rows, columns = samples.shape
    room = columns + -columns % LINE
    found = aligned(rows * room).reshape(rows, room)
    found[:, :columns] = samples
    return found
