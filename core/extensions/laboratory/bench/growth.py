"""Growth of the native engine's cost with the size of a mechanism: chains of loops, and rings."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from time import process_time
from typing import Any

from ....errors import SolveError
from ....kinematics import NativeSolver
from ....program.executor import compiled_at_once
from .rounds import Work, take_turns
from .size import CHAIN, RING, SAMPLES, chain, circle

LOOPS = (1, 2, 5, 10, 19, 20, 40, 80, 200)
CRANKS = (4, 7, 10, 12, 14, 20, 21, 30, 49, 99, 199)
"""Sizes; the neighbours are those at which another method takes over."""

SCHEMA = "kincheck-bench-size/1"


def measure(
    loops: Sequence[int], cranks: Sequence[int], rounds: int, tol: float = 1e-12
) -> dict[str, Any]:
    """Return the processor time per sample of chains and rings [us], in turns.

    A step is the growth from one size to the next as a multiple of the growth of the size.

    Raises:
        SolveError: not all samples of a sweep were reached.
    """
    cases = {(CHAIN, n): chain(n) for n in loops} | {(RING, n): circle(n) for n in cranks}
    work: dict[tuple[str, int], Work] = {}
    for key, case in cases.items():
        with compiled_at_once():
            solve = NativeSolver().prepare(case.mechanism, case.sweep.path, case.outputs[0].points)
            if not (found := solve(tol)).solved.all():
                raise SolveError(f"bench size: {case.name}: {found.message}")
        work[key] = lambda solve=solve: solve(tol)
    times = take_turns(work, rounds, clock=process_time)
    return {
        "schema": SCHEMA,
        "samples": SAMPLES,
        "mechanisms": {
            name: _curve(
                {n: times[kind, n].least * 1e6 / SAMPLES for kind, n in work if kind == name}
            )
            for name in (CHAIN, RING)
        },
    }


def _curve(us: dict[int, float]) -> list[dict[str, float | None]]:
    of_one = {n: time / n for n, time in us.items()}
    steps = {n: of_one[n] / of_one[m] for m, n in pairwise(us)}
    return [{"size": n, "us_per_sample": us[n], "step": steps.get(n)} for n in us]


def lines(found: dict[str, Any]) -> list[str]:
    """Return the results in words."""
    said: list[str] = []
    for name, curve in found["mechanisms"].items():
        for each in curve:
            step = "" if each["step"] is None else f", step {each['step']:.2f}"
            said.append(f"{name}, {each['size']}: {each['us_per_sample']:.3g} us a sample{step}")
    return said
