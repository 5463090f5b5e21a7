"""Programs: equations traced to lists of operations, and what runs them."""

from .elimination import Elimination
from .numpy_executor import NumpyExecutor
from .trace import Program, Tape, Traced, absolute, cos, maximum, minimum, program, sin, sqrt, where_larger

__all__ = [
    "Elimination",
    "NumpyExecutor",
    "Program",
    "Tape",
    "Traced",
    "absolute",
    "cos",
    "maximum",
    "minimum",
    "program",
    "sin",
    "sqrt",
    "where_larger",
]
