"""The first use of the native engine in a new process, timed stage by stage."""

from __future__ import annotations

import json
import pickle
import sys
from collections.abc import Sequence
from itertools import pairwise
from time import perf_counter

from ...harness.native_engine import NativeEngine
from .native_breakdown import level

STAGES = (
    "import numpy",
    "import kincheck",
    "build",
    "first solve",
    "second solve",
    "ten more",
    "solve anew",
)
FIRST = STAGES[1:4]
"""The stages after the import of numpy, up to the first solution."""


def first_use(clock: Sequence[float]) -> None:
    """Build and solve the pickled case from standard input; print the seconds of all stages as a
    line of JSON.

    The last stage solves the same case again, as repeated calls of `solve` do.

    Args:
        clock: times of the start of the process, the import of numpy and the import of the solver.
    """
    case, tol = pickle.load(sys.stdin.buffer)
    begin = perf_counter()
    whole = level()
    model = whole.build(case)
    now = [begin, perf_counter()]
    for solves in (1, 1, 10):  # during ten more solves, programs are compiled
        for _ in range(solves):
            whole.solve(model, case, tol)
        now.append(perf_counter())
    anew, recent = 0.0, NativeEngine(every_body=True)
    for _ in range(2):  # so far nothing of this case is cached
        begin = perf_counter()
        recent.solve(recent.build(case), case, tol)
        anew = perf_counter() - begin
    stages = [*(b - a for each in (clock, now) for a, b in pairwise(each)), anew]
    print(json.dumps(dict(zip(STAGES, stages, strict=True))))
