"""Time of whole sweeps without machine code, as an installation without extras solves them."""

from __future__ import annotations

from collections.abc import Mapping
from time import process_time
from typing import Any

from ....case.case import Case, without_forces
from ....errors import SolveError
from ....kinematics import NativeSolver
from .rounds import Work, take_turns

SCHEMA = "kincheck-bench-numpy/1"


def measure(cases: Mapping[str, Case], rounds: int, tol: float = 1e-12) -> dict[str, Any]:
    """Return the processor time per sample of the motion of each case [us], in turns.

    Raises:
        SolveError: not all samples of a case were reached.
    """
    work: dict[str, Work] = {}
    for name, case in cases.items():
        solver = NativeSolver(compiled=False)
        solve = solver.prepare(case.mechanism, case.sweep.path, without_forces(case).points)
        if not (found := solve(tol)).solved.all():
            raise SolveError(f"bench numpy: {name}: {found.message}")
        work[name] = lambda solve=solve: solve(tol)
    seconds = take_turns(work, rounds, clock=process_time)
    samples = {name: len(case.sweep.values) for name, case in cases.items()}
    times = {name: each.times(1e6 / samples[name]) for name, each in seconds.items()}
    return {"schema": SCHEMA, "samples": samples, "us_per_sample": times}


def lines(found: Mapping[str, Any]) -> list[str]:
    """Return the results in words."""
    return [
        f"{name}: {each.least:.3g} us a sample at least, median {each.median:.3g}"
        for name, each in found["us_per_sample"].items()
    ]
