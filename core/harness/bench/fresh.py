"""What a process of its own does to time the first use of the native engine, stage by stage."""

from __future__ import annotations

import json
import pickle
import sys
from collections.abc import Sequence
from itertools import pairwise
from time import perf_counter

from .levels import Level

STAGES = ("import numpy", "import kincheck", "build", "first solve", "second solve")


def first_use(clock: Sequence[float]) -> None:
    """Build and solve the pickled case on standard input; print the seconds of all stages as a line of JSON.

    Args:
        clock: when the process began, had imported numpy and then what it takes to solve.
    """
    case, tol = pickle.load(sys.stdin.buffer)
    begin = perf_counter()
    level = Level()
    model = level.build(case)
    now = [begin, perf_counter()]
    for _ in range(2):
        level.solve(model, case, tol)
        now.append(perf_counter())
    stages = [b - a for each in (clock, now) for a, b in pairwise(each)]
    print(json.dumps(dict(zip(STAGES, stages, strict=True))))
