"""Run programs as machine code over vectors of lanes: one call for a whole motion, without Python's lock."""

from __future__ import annotations

import ctypes
import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Array
from . import compiled, llvm_code, llvm_fan, llvm_follow, llvm_loops, llvm_programs, llvm_tables
from .executor import LINE, Parts, Plan, Side, Table

BYTES = 8
"""Of a number."""
OUT, FORGET = (llvm_follow.MOTION.index(each) for each in ("ptr out", "i64 forget"))
REACHED = llvm_follow.SIDE.index("i64 reached")
SOURCES = llvm_code, llvm_fan, llvm_follow, llvm_loops, llvm_programs, llvm_tables
"""Modules that write the text."""
LOOPS: Mapping[str, tuple[Callable[[Plan, int], str], Mapping[str, int]]] = {
    "follow": (llvm_follow.follow, {"follow": 5, "run": 2}),
    "fan": (llvm_fan.fan, {"fan": 10}),
    "parts": (llvm_loops.parts, {"parts": 10}),
}
"""Loop -> what writes it, and how many arguments its functions take."""


class LlvmCode:
    """A plan compiled for this processor. Raises ImportError where llvmlite is missing."""

    def __init__(self, plan: Plan) -> None:
        self.width, self.plan = compiled.vector_width(), plan
        signatures = {f"run_{name}": 2 for name in plan.single}
        for loop in plan.loops:
            signatures |= LOOPS[loop][1]
        if plan.after:
            signatures["attempt"] = 2
        # what determines the text; writing that takes longer than loading the code it means
        content = [plan, self.width, *(inspect.getsource(each) for each in SOURCES)]
        self._owner, self.functions = compiled.load(repr(content), self._text, signatures)

    def _text(self) -> str:
        plan, width, slots = self.plan, self.width, len(self.plan.slots)
        text = [llvm_programs.function(program, width) for program in plan.programs.values()]
        text += [llvm_loops.over_groups(f"run_{name}", [name], slots, width) for name in plan.single]
        if plan.after:  # a plan that is only run makes no attempt
            text.append(llvm_loops.settle(plan, width))
            text.append(llvm_loops.over_groups("attempt", ["predict", "settle", *plan.alone], slots, width))
        text += [LOOPS[loop][0](plan, width) for loop in plan.loops]
        return "\n".join([*text, llvm_code.declarations(width)])


class LlvmExecutor:
    """Compiled code bound to lanes: groups of a vector's width W, memory of shape (groups, slots, W).

    The last group is filled up with copies of the last lane.
    """

    def __init__(self, code: LlvmCode, lanes: int) -> None:
        self.lanes, self.group, self.margin, self._code = lanes, code.width, code.width, code
        self._groups = self.groups(lanes)
        slots = len(code.plan.slots)
        self._memory = _aligned(self._groups * slots * code.width).reshape(self._groups, slots, code.width)
        self.clear()
        self._address = _address(self._memory)

    def clear(self) -> None:
        """See `Executor`."""
        self._memory[:] = 0.0

    def put(self, slots: Sequence[int], values: Array) -> None:
        """See `Executor`."""
        # the same in all lanes needs no arranging
        self._memory[:, _places(slots)] = values if values.shape[1] == 1 else self.arranged(values)

    def get(self, slots: Sequence[int]) -> Array:
        """See `Executor`."""
        found = np.empty((len(slots), self._groups, self.margin))
        found[:] = self._memory[:, _places(slots)].transpose(1, 0, 2)
        return found.reshape(len(slots), -1)[:, : self.lanes]

    def window(self, slots: range) -> Array:
        """See `Executor`."""
        return self._memory[:, _places(slots)]

    def arranged(self, table: Table) -> Table:
        """See `Executor`."""
        padded = np.empty((len(table), self.room), table.dtype)
        padded[:, : self.lanes] = table
        padded[:, self.lanes :] = padded[:, self.lanes - 1 : self.lanes]
        found: Any = padded.reshape(len(table), self._groups, self.margin).transpose(1, 0, 2)
        return found

    def run(self, name: str) -> None:
        """See `Executor`."""
        self._code.functions[f"run_{name}"](self._address, self._groups)

    def attempt(self) -> None:
        """See `Executor`."""
        self._code.functions["attempt"](self._address, self._groups)

    def track(self, sides: Sequence[Side], start: Array, n: int) -> LlvmTrack:
        """See `Executor`."""
        return LlvmTrack(self._code, self._memory, sides, start, n)

    @property
    def room(self) -> int:
        """See `Executor`."""
        return self._groups * self.margin

    def table(self, columns: int) -> Array:
        """See `Executor`."""
        shape = len(self._code.plan.kept), columns, self.room
        return _aligned(math.prod(shape)).reshape(shape)

    def fan(self, samples: Array, out: Array, first: int, step: int) -> None:
        """See `Executor`."""
        stride, wanted = samples.strides[0] // samples.itemsize, samples.shape[1]
        given = self._address, self._groups, samples.ctypes.data, stride, wanted
        self._code.functions["fan"](*given, out.ctypes.data, *out.shape[1:], first, step)

    def groups(self, lanes: int) -> int:
        """See `Executor`."""
        return -(-lanes // self._code.width)

    def parts(self, parts: Parts) -> Callable[[int], object]:
        """See `Executor`."""
        samples, addresses = parts.samples, [each.ctypes.data for each in (parts.taken, parts.world)]
        tables = parts.members.ctypes.data, parts.fixed.ctypes.data, samples.ctypes.data, samples.shape[1], *addresses
        return partial(self._code.functions["parts"], self._address, len(parts.members), *tables, parts.base)


class LlvmTrack:
    """See `Track`. Its tables are such that both ways from the start the vectors of samples are cache lines."""

    def __init__(self, code: LlvmCode, memory: Array, sides: Sequence[Side], start: Array, n: int) -> None:
        plan, width = code.plan, code.width
        self._start, self.anchors = start.copy(), np.tile(start, (len(sides), 1))
        self.worst = np.zeros(len(plan.largest) + len(plan.smallest))
        below = min((side.first for side in sides if side.step > 0), default=n)
        margin = width + -below % width  # a vector may be written beyond either end
        row = margin + n + width
        row += -row % LINE
        self._shape, self._strides, self._margin = (len(plan.kept), n), (row * BYTES, BYTES), margin * BYTES
        self._room = len(plan.kept) * row + LINE
        start_at, anchors = _address(self._start), [_address(anchor) for anchor in self.anchors]
        # in the order of llvm_follow.MOTION and SIDE
        self._motion = np.array([_address(memory), start_at, _address(self.worst), 0, row, 1, len(sides)], np.int64)
        told = [
            (_address(side.samples), side.samples.shape[1], margin + side.first, side.step, side.count, anchor, 0)
            for side, anchor in zip(sides, anchors, strict=True)
        ]
        self._sides = np.array([*told, (0,) * len(llvm_follow.SIDE)], np.int64)  # never empty: that has no address
        self._counts, motion = [side.count for side in sides], _address(self._motion)
        self._run = partial(code.functions["run"], motion, _address(self._sides))
        follow = partial(code.functions["follow"], motion)
        places = [(_address(each), anchor) for each, anchor in zip(self._sides, anchors, strict=False)]
        self._follow = [{True: partial(follow, at, start_at), False: partial(follow, at, anchor)} for at, anchor in places]
        self._alive = code, memory, sides  # their addresses are held

    def begin(self) -> Array:
        """See `Track`."""
        room = np.empty(self._room)
        address = _address(room)
        skip = -address % (LINE * BYTES)
        self._motion[OUT] = address + skip
        self._motion[FORGET] = 1
        return np.ndarray(self._shape, np.float64, room, skip + self._margin, self._strides)

    def run(self) -> Sequence[int]:
        """See `Track`."""
        return self._sides[: len(self._counts), REACHED].tolist() if self._run() else self._counts

    def follow(self, side: int, at: int, stop: int, *, anew: bool) -> int:
        """See `Track`."""
        return self._follow[side][anew](at, stop)


def _places(slots: Sequence[int]) -> Sequence[int] | slice:
    """Slots as an index; numpy would make an array of a range each time."""
    return slice(slots.start, slots.stop) if isinstance(slots, range) and slots.step == 1 else slots


def _aligned(count: int) -> Array:
    """Room for numbers that begins with a cache line, so that no vector is in two of them."""
    room = np.empty(count + LINE)
    start = -(_address(room) // BYTES) % LINE
    return room[start : start + count]


def _address(array: NDArray[Any]) -> int:
    """Of a contiguous array; four times as quick as its own `ctypes`."""
    return ctypes.addressof(ctypes.c_char.from_buffer(array.data))
