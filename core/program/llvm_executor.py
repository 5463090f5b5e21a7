"""Run programs as machine code over vectors of lanes: one call for a whole motion, without Python's lock."""

from __future__ import annotations

import ctypes
import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from ..trajectory import Array
from . import compiled, llvm_code, llvm_loops, llvm_tables
from .executor import Parts, Plan

LINE = 8
"""Numbers in a cache line."""
LOOPS: Mapping[str, tuple[Callable[[Plan, int], str], str]] = {
    "follow": (llvm_loops.follow, "pppiiipiii"),
    "fan": (llvm_loops.fan, "pipiipiiii"),
    "parts": (llvm_loops.parts, "pipppippii"),
}
"""Loop -> what writes it, and the kinds of its arguments (see `compiled.load`)."""


class LlvmCode:
    """A plan compiled for this processor. Raises ImportError where llvmlite is missing."""

    def __init__(self, plan: Plan) -> None:
        self.width, self.slots = compiled.vector_width(), len(plan.slots)
        signatures = {f"run_{name}": "pi" for name in plan.programs} | {loop: LOOPS[loop][1] for loop in plan.loops}
        if plan.after:
            signatures["attempt"] = "pi"
        # what determines the text; writing that takes longer than loading the code it means
        content = [plan, self.width, *(inspect.getsource(each) for each in (llvm_code, llvm_loops, llvm_tables))]
        self._owner, self.functions = compiled.load(repr(content), lambda: self._text(plan), signatures)

    def _text(self, plan: Plan) -> str:
        width = self.width
        text = [llvm_code.function(program, width) for program in plan.programs.values()]
        text += [llvm_loops.over_groups(f"run_{name}", [name], self.slots, width) for name in plan.programs]
        if plan.after:  # a plan that is only run makes no attempt
            text.append(llvm_loops.settle(plan, width))
            text.append(llvm_loops.over_groups("attempt", ["predict", "settle", "alone"], self.slots, width))
        text += [LOOPS[loop][0](plan, width) for loop in plan.loops]
        return "\n".join([*text, llvm_code.declarations(width)])


class LlvmExecutor:
    """Compiled code bound to lanes: groups of a vector's width W, memory of shape (groups, slots, W).

    The last group is filled up with copies of the last lane.
    """

    def __init__(self, code: LlvmCode, lanes: int) -> None:
        self.lanes, self.margin, self._code = lanes, code.width, code
        self._groups = self.groups(lanes)
        self._memory = _aligned(self._groups * code.slots, code.width).reshape(self._groups, code.slots, code.width)
        self.anchor: Array = np.zeros(code.slots)
        self.clear()
        self._address, self._place = _address(self._memory), _address(self.anchor)

    def clear(self) -> None:
        """See `Executor`."""
        self._memory[:] = 0.0

    def put(self, slots: Sequence[int], values: Array) -> None:
        """See `Executor`."""
        if values.shape[1] == 1:  # the same in all lanes
            self._memory[:, slots] = values
            return
        padded = np.empty((len(slots), self._groups * self.margin))
        padded[:, : self.lanes] = values
        padded[:, self.lanes :] = padded[:, self.lanes - 1 : self.lanes]
        self._memory[:, slots] = padded.reshape(len(slots), self._groups, self.margin).transpose(1, 0, 2)

    def get(self, slots: Sequence[int]) -> Array:
        """See `Executor`."""
        return self._memory[:, slots].transpose(1, 0, 2).reshape(len(slots), -1)[:, : self.lanes]

    def run(self, name: str) -> None:
        """See `Executor`."""
        self._code.functions[f"run_{name}"](self._address, self._groups)

    def attempt(self) -> None:
        """See `Executor`."""
        self._code.functions["attempt"](self._address, self._groups)

    def table(self, rows: int, n: int, at: int) -> tuple[Array, int]:
        """See `Executor`."""
        first = self.margin + -at % self.margin  # `follow` may write a vector beyond either end
        return _aligned(rows, first + n + self.margin), first

    def follow(self, samples: Array, at: int, stop: int, out: Array, first: int, step: int) -> int:
        """See `Executor`."""
        given = self._address, self._place, _address(samples), samples.shape[1], at, stop
        return self._code.functions["follow"](*given, _address(out), out.shape[1], first, step)

    @property
    def room(self) -> int:
        """See `Executor`."""
        return self._groups * self.margin

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


def _aligned(rows: int, columns: int) -> Array:
    """Room for numbers, at least as many columns: every row begins with a cache line, so that no vector is in two of them."""
    columns += -columns % LINE
    room = np.empty(rows * columns + LINE)
    start = -(_address(room) // room.itemsize) % LINE
    return room[start : start + rows * columns].reshape(rows, columns)


def _address(array: Array) -> int:
    """Of a contiguous array; four times as quick as its own `ctypes`."""
    return ctypes.addressof(ctypes.c_char.from_buffer(array.data))
