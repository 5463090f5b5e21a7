"""Run programs as machine code over vectors of lanes: one call for a whole motion, without Python's lock."""

from __future__ import annotations

import ctypes
import hashlib
import inspect
import math
import pickle
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from threading import Lock, Thread
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..trajectory import Array
from . import compiled, llvm_code, llvm_fan, llvm_follow, llvm_loops, llvm_plan, llvm_programs, llvm_walk, lowering, walk
from .executor import LINE, Parts, Plan, Side, Table

BYTES = 8
"""Of a number."""
OUT, FORGET = (llvm_follow.MOTION.index(each) for each in ("ptr out", "i64 forget"))
REACHED = llvm_follow.SIDE.index("i64 reached")
SOURCES = llvm_code, llvm_fan, llvm_follow, llvm_loops, llvm_plan, llvm_programs, llvm_walk, lowering, walk
"""Modules that write the text."""
_NEEDED = llvm_plan.rows, llvm_loops.settle
LOOPS: Mapping[str, tuple[Sequence[Callable[[int], str]], Mapping[str, int]]] = {
    "walk": ([llvm_walk.walker], {"walk": 2}),
    "follow": ([*_NEEDED, llvm_loops.run, llvm_follow.follow], {"run_program": 4, "attempt": 3, "follow": 6, "run": 3}),
    "fan": ([*_NEEDED, llvm_fan.fan], {"fan": 11}),
    "parts": ([*_NEEDED, llvm_loops.parts], {"parts": 11}),
}
"""What runs the programs of any plan: what writes it, and its functions with how many arguments they take."""
OFTEN, OPERATIONS = 150, 3000
"""Programs of so many operations are walked for so many groups of lanes; longer ones, which take longer to compile, for more.
Whoever comes back after that comes many times: a sweep of 161 samples is 21 groups, of which `kincheck run` makes six."""


class LlvmCode:
    """A plan that this processor can run: its programs are walked at first, and compiled where they are run often.

    Raises ImportError where llvmlite is missing.

    Attributes:
        stride: slots of a lane, with those after `Plan.slots` that programs keep their values in.
        walked: whether programs are not compiled yet.
    """

    def __init__(self, plan: Plan) -> None:
        self.width, self.plan = compiled.vector_width(), plan
        # what determines the code; writing its text takes longer than loading it
        self._lock = Lock()
        self._content = repr([plan.programs, self.width, _sources()])
        code = compiled.find(self._content)
        self.walked, tables = code is None, {} if code else self._tables()
        self.stride = len(plan.slots) + max((each.cells for each in tables.values()), default=0)
        self.memory = llvm_plan.PlanInMemory(plan, self.width, self.stride)
        if code:
            self._take(code)
        for name, table in tables.items():
            self.memory.entries[self.memory.calls[name]] = _loop("walk", self.width).address("walk"), _address(table.words)
        operations = sum(len(each.nodes) for each in plan.programs.values())
        self._alive, self._left = tables, OFTEN * max(OPERATIONS, operations) // OPERATIONS

    def call(self, loop: str, name: str) -> Callable[..., int]:
        """A function of a loop, for this plan."""
        return partial(_loop(loop, self.width).calls[name], self.memory.address)

    def count(self, groups: int) -> None:
        """Said by whoever has run programs for so many groups of lanes."""
        self._left -= groups
        if self._left <= 0:
            with self._lock:  # what one thread compiled is not taken away from others that run it
                if self.walked:
                    self._take(compiled.load(self._content, self._text))
                    self.walked = False

    def _take(self, code: compiled.Code) -> None:
        self._code = code
        for name, at in self.memory.calls.items():
            self.memory.entries[at, 0] = code.address(name)  # a function that is compiled needs no table

    def _tables(self) -> dict[str, walk.Walk]:
        slots = len(self.plan.slots)

        def made() -> bytes:
            return pickle.dumps({name: walk.walk(each, slots, self.width) for name, each in self.plan.programs.items()})

        return pickle.loads(compiled.kept(f"{slots} {self._content}".encode(), made))

    def _text(self) -> str:
        programs = (llvm_programs.function(program, self.width) for program in self.plan.programs.values())
        return "\n".join([*programs, llvm_code.declarations(self.width)])


@cache
def make_loops_ready() -> None:
    """Compile what is needed first, if it never was, while programs are traced: the compiler does not wait for Python's lock.

    To import and to read files does: in a thread, beside whatever else Python does, that would take three times as long.
    """
    width = compiled.vector_width()
    missing = [name for name in ("walk", "follow") if not compiled.known(_content(name, width))]
    if missing:
        Thread(target=lambda: [_loop(name, width) for name in missing]).start()


def _loop(name: str, width: int) -> compiled.Code:
    with _LOCK:
        return _made(name, width)


_LOCK = Lock()


@cache
def _made(name: str, width: int) -> compiled.Code:
    """Functions that run any plan."""
    writers, signatures = LOOPS[name]
    text = partial("\n".join, [*(write(width) for write in writers), llvm_code.declarations(width)])
    return compiled.load(_content(name, width), text, signatures)


def _content(name: str, width: int) -> str:
    return repr([name, width, _sources()])


@cache
def _sources() -> str:
    """A digest of all that writes text or tables."""
    return hashlib.sha256("".join(inspect.getsource(each) for each in SOURCES).encode()).hexdigest()


class LlvmExecutor:
    """Compiled code bound to lanes: groups of a vector's width W, memory of shape (groups, slots, W).

    The last group is filled up with copies of the last lane.
    """

    def __init__(self, code: LlvmCode, lanes: int) -> None:
        self.lanes, self.group, self.margin, self._code = lanes, code.width, code.width, code
        self._groups = self.groups(lanes)
        self._memory = _aligned(self._groups * code.stride * code.width).reshape(self._groups, code.stride, code.width)
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
        code = self._code
        code.call("follow", "run_program")(self._address, self._groups, code.memory.entry(name))
        self._count(self._groups)

    def attempt(self) -> None:
        """See `Executor`."""
        self._code.call("follow", "attempt")(self._address, self._groups)
        self._count(self._groups)

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
        self._code.call("fan", "fan")(*given, out.ctypes.data, *out.shape[1:], first, step)
        self._count(self._groups * wanted)

    def groups(self, lanes: int) -> int:
        """See `Executor`."""
        return -(-lanes // self._code.width)

    def parts(self, parts: Parts) -> Callable[[int], object]:
        """See `Executor`."""
        samples, addresses = parts.samples, [each.ctypes.data for each in (parts.taken, parts.world)]
        tables = parts.members.ctypes.data, parts.fixed.ctypes.data, samples.ctypes.data, samples.shape[1], *addresses
        call = partial(self._code.call("parts", "parts"), self._address, len(parts.members), *tables, parts.base)

        def count(groups: int) -> None:
            call(groups)
            self._count(groups * len(parts.members))

        return count

    def _count(self, groups: int) -> None:
        if self._code.walked:
            self._code.count(groups)


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
        self._run = partial(code.call("follow", "run"), motion, _address(self._sides))
        follow = partial(code.call("follow", "follow"), motion)
        places = [(_address(each), anchor) for each, anchor in zip(self._sides, anchors, strict=False)]
        self._follow = [{True: partial(follow, at, start_at), False: partial(follow, at, anchor)} for at, anchor in places]
        self._code, self._groups = code, sum(-(-side.count // width) for side in sides)
        self._alive = memory, sides  # their addresses are held

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
        early = self._run()
        if self._code.walked:
            self._code.count(self._groups)
        return self._sides[: len(self._counts), REACHED].tolist() if early else self._counts

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
