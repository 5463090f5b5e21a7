"""Programs: equations traced to lists of operations, and what runs them."""

from .elimination import Elimination
from .numpy_executor import NumpyExecutor
from .plan import DONE, ITERATIONS, MARGIN, Executor, Parts, Plan, Side, Track
from .straight_line import Prepared, Program, program
from .tape import (
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
