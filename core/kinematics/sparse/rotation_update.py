"""Turn many bodies at once, at several poses: lanes are bodies."""

from __future__ import annotations

import numpy as np

from ...algebra import quat, turned_by, vec
from ...program import Executor, NumpyExecutor, Plan, Program, Tape, program
from ...program.llvm.compiler import available
from ...program.llvm.executor import LlvmExecutor
from ...program.llvm.jit import LlvmCode
from ...trajectory import Array

BY, TO = range(7), range(7, 11)
"""Slots of Euler parameters and a vector, and of what they are turned to."""


def turned() -> Program:
    """Euler parameters after a small global rotation, of length one."""
    tape = Tape()
    q, rotation = quat([tape.input(k) for k in BY[:4]]), vec([tape.input(k) for k in BY[4:]])
    return program("turned", tape, dict(zip(TO, turned_by(q, 0.5 * rotation), strict=True)))


class Turn:
    """Rotate Euler parameters by small global rotations; by single array operations this took an
    eighth of a sparse sweep.
    """

    def __init__(self, bodies: int, *, compiled: bool) -> None:
        plan = Plan({"turned": turned()}, {str(k): k for k in range(TO.stop)})
        compiled = compiled and available()
        self._executor: Executor = (
            LlvmExecutor(LlvmCode(plan), bodies) if compiled else NumpyExecutor(plan, bodies)
        )

    def __call__(self, q: Array, rotation: Array) -> Array:
        """Euler parameters after rotations [rad], of length one; shapes (4 * bodies, poses) and (3
        * bodies, poses), component by component.
        """
        self._executor.put(BY, np.concatenate([q, rotation]).reshape(len(BY), -1))
        self._executor.run("turned")
        return self._executor.get(TO).reshape(q.shape)
