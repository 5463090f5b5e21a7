"""Run bare programs on a block, as the executors run a model's."""

import numpy as np
from kincheck.core.program import NumpyExecutor, Plan


def numpy_executor(programs, block):
    """The programs bound to a copy of the block, shape (slots, lanes)."""
    slots = {str(k): k for k in range(len(block))}
    executor = NumpyExecutor(Plan({each.name: each for each in programs}, slots), block.shape[1])
    executor.put(range(len(block)), block)
    return executor


def run_on(programs, block, name="p"):
    """Run one of the programs on the block in place."""
    executor = numpy_executor(programs, np.asarray(block, dtype=float))
    executor.run(name)
    block[:] = executor.get(range(len(block)))
