"""Programs: equations traced to lists of operations, and what runs them."""

from .elimination import Elimination
from .executor import DONE, ITERATIONS, MARGIN, Executor, Parts, Plan, Side, Track
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
    "maximum",
    "minimum",
    "place_of",
    "program",
    "sin",
    "where_larger",
]
