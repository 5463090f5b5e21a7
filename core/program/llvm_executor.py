"""Run programs as machine code over vectors of lanes: one call for a whole attempt, without Python's lock."""

from __future__ import annotations

import numpy as np

from ..trajectory import Array
from . import compiled, llvm_code
from .executor import Plan

STRIDE = 296
"""Numbers between two slots of a lane: room for the lanes of a march, and an odd number of cache lines, so that the slots of a lane
do not compete for the same places in the cache."""


class LlvmCode:
    """A plan compiled for this processor. Raises ImportError where llvmlite is missing."""

    def __init__(self, plan: Plan) -> None:
        self.width = compiled.vector_width()
        functions = [llvm_code.function(program, self.width, STRIDE) for program in plan.programs.values()]
        entries = [llvm_code.entry(name, self.width) for name in plan.programs]
        attempt = llvm_code.attempt(plan.slots, plan.after, self.width, STRIDE, plan.tolerance, plan.most)
        text = "\n".join([*functions, *entries, attempt, llvm_code.declarations(self.width)])
        names = [*(f"run_{name}" for name in plan.programs), "attempt"]
        self._owner, self.functions = compiled.load(text, names)
        self.slots = len(plan.slots)


class LlvmExecutor:
    """Compiled code bound to a block of lanes.

    Args:
        code: of the plan; shared by all blocks.
        lanes: at most STRIDE.
    """

    def __init__(self, code: LlvmCode, lanes: int) -> None:
        if lanes > STRIDE:
            raise ValueError(f"{lanes} lanes do not fit into a block of {STRIDE}")
        self._code, self._lanes = code, lanes
        self._memory: Array = np.zeros((code.slots, STRIDE))
        self.block = self._memory[:, :lanes]

    def run(self, name: str) -> None:
        """See `Executor`."""
        self._call(f"run_{name}", self._lanes)

    def attempt(self, lanes: int) -> None:
        """See `Executor`."""
        self._call("attempt", lanes)

    def _call(self, name: str, lanes: int) -> None:
        self._code.functions[name](self._memory.ctypes.data, -(-lanes // self._code.width))
