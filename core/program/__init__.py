"""Programs: equations traced to lists of operations, and what runs them."""

from .elimination import Elimination
from .executor import DONE, ITERATIONS, MARGIN, Executor, Parts, Plan, Side, Track
from .llvm.executor import LlvmExecutor
from .llvm.machine_code import LlvmCode, make_loops_ready
from .numpy_executor import NumpyExecutor
from .straight_line import Prepared, Program, program
from .trace import (
    NODES,
    Tape,
    Traced,
    absolute,
    before,
    cos,
    groups_behind,
    maximum,
    minimum,
    place_of,
    sin,
    where_larger,
)

__all__ = [
    "DONE",
    "ITERATIONS",
    "MARGIN",
    "NODES",
    "Elimination",
    "Executor",
    "LlvmCode",
    "LlvmExecutor",
    "NumpyExecutor",
    "Parts",
    "Plan",
    "Prepared",
    "Program",
    "Side",
    "Tape",
    "Traced",
    "Track",
    "absolute",
    "before",
    "cos",
    "groups_behind",
    "make_loops_ready",
    "maximum",
    "minimum",
    "place_of",
    "program",
    "sin",
    "where_larger",
]
