"""Execution of plans by machine code over vectors of lanes: a call per motion, without the GIL."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...program.plan import Parts, Side
from ...trajectory import Array
from .jit import LlvmCode
from .loops import MOTION, SIDE
from .plan import BYTES, LINE, address, aligned
from .walk import PART, WALK

OUT, FORGET = (MOTION.index(each) for each in ("ptr out", "i64 forget"))
REACHED = SIDE.index("i64 reached")
SAMPLES, OUT_OF_WALK = PART.index("ptr samples"), WALK.index("ptr out")


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

    def parts(self, parts: Parts) -> LlvmParts:
        """See `NumpyExecutor`."""
        return LlvmParts(self._code, self._address, parts)


class LlvmParts:
    """See `NumpyExecutor.parts`.

    Attributes:
        fields: in the order of `PART`.
    """

    def __init__(self, code: LlvmCode, memory: int, parts: Parts) -> None:
        own, samples = [parts.members, parts.fixed, parts.samples], parts.samples.shape[1]
        own_at = [each.ctypes.data for each in own]
        world = parts.taken.ctypes.data, parts.world.ctypes.data, parts.world.shape[1], parts.base
        fields = code.memory.address, memory, len(parts.members), *own_at, samples, *world
        self.fields = np.array([*fields, parts.worst.ctypes.data], np.int64)
        self.parts, self._code = parts, code
        self._call = partial(code.call("parts", "parts"), address(self.fields))

    @property
    def width(self) -> int:
        """The lanes of a group."""
        return self._code.width

    def walk(self, fields: int) -> Callable[[int], int]:
        """Return the function of a walk with these fields."""
        return partial(self._code.call("parts", "walk"), fields)

    def __call__(self, lane: int, groups: int) -> None:
        """Attempt the parts; see `NumpyExecutor.parts`."""
        # the sample of the lane is the one before
        self._call(lane + 1 if lane >= 0 else 0, lane, groups)
        self.count(groups)

    def count(self, groups: int) -> None:
        """Count groups of lanes run so far; see `LlvmCode`."""
        self._code.count(groups * len(self.parts.members))


class LlvmWalk:
    """A walk over samples through parts of a mechanism; see `loops.parts`.

    Args:
        calls: of the parts, in order; they share world and tests.
        many: samples at once.
        wanted: rows of the world to store at each sample.
        best: start values of the tests.
        deciding: rows of the residual, of sigma and of the margin among the tests.
    """

    def __init__(
        self,
        calls: Sequence[LlvmParts],
        many: int,
        wanted: NDArray[np.int64],
        best: Array,
        deciding: Sequence[int],
    ) -> None:
        self._calls, self._many = calls, many
        parts, tests = calls[0].parts, np.arange(len(best))
        self._parts = np.stack([each.fields for each in calls])
        self._alive = wanted, tests, best, parts
        room, at = parts.worst.shape[1], [each.ctypes.data for each in (wanted, tests)]
        given = self._parts.ctypes.data, len(calls), many, parts.world.ctypes.data
        worst = parts.worst.ctypes.data
        closures, sigmas, margins = (worst + BYTES * room * row for row in deciding)
        fields = *given, worst, room, best.ctypes.data, at[0], len(wanted), at[1], len(tests)
        self._rows, self._wanted = len(wanted) + len(tests), len(wanted)
        self._fields = np.array([*fields, 0, 0, closures, sigmas, margins, 0, 0], np.int64)
        self._limits = self._fields.view(np.float64)[-2:]
        self._run = calls[0].walk(address(self._fields))

    def __call__(
        self, samples: Sequence[Array], count: int, limits: tuple[float, float]
    ) -> tuple[Array, Array]:
        """Follow samples; return the wanted values and the tests of those followed.

        Args:
            samples: see `Parts`, for each of the calls; `many` more columns than samples.
            limits: the least residual that counts, and its bound by the square of sigma.
        """
        columns = count + self._many
        out, wanted = np.empty((self._rows, columns)), self._wanted
        at = {id(each): (each.ctypes.data, each.strides[0] // BYTES) for each in samples}
        self._parts[:, SAMPLES : SAMPLES + 2] = [at[id(each)] for each in samples]
        self._fields[OUT_OF_WALK : OUT_OF_WALK + 2] = address(out), columns
        self._limits[:] = limits
        followed = self._run(count)
        for each in self._calls:
            each.count(-(-count // self._calls[0].width))
        return out[:wanted, :followed], out[wanted:, :followed]


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
