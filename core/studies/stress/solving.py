"""Solution of specimens: by the native engine in this process, with machine code and with numpy,
and by simulators in worker processes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...case.case import Case
from ...errors import KincheckError
from ...harness.engine import Engine, may_run_here
from ...harness.execution import Answer, Failure, Pair, error_text
from ...harness.native_engine import NativeEngine
from ...harness.record import Outcome
from ...harness.resource_limits import Limits
from ...harness.trajectory_check import check

# Time limit of a sweep of this size [s]; a slower simulator counts as hanging.
PATIENCE = 60.0
MEMORY = 4.0
# Numpy solves one mechanism in four up to this number of bodies: around singular poses it takes up
# to ten times as long.
INTERPRETED, LARGEST_INTERPRETED = 4, 4
MOST_INTERPRETED = 2000
"""Largest number of samples solved without compilation."""


def suited(engine: Engine, case: Case, number: int) -> Engine:
    """Return the native engine, interpreted for some of the small mechanisms, which tests both
    executors. Return simulators unchanged.
    """
    small = (
        len(case.mechanism.moving) <= LARGEST_INTERPRETED
        and len(case.sweep.values) <= MOST_INTERPRETED
    )
    if isinstance(engine, NativeEngine) and number % INTERPRETED == INTERPRETED - 1 and small:
        return interpreted(engine)
    return engine


def interpreted(engine: NativeEngine) -> NativeEngine:
    """Return the native engine with numpy as executor: compilation does not pay for a single
    solution.
    """
    return replace(engine, solver=replace(engine.solver, compiled=False))


def solve_all(pairs: Sequence[Pair]) -> list[Answer | Failure]:
    """Return the answers in order; an error becomes a failure."""
    found = {k: once(pair) for k, pair in enumerate(pairs) if may_run_here(pair.engine)}
    if away := [k for k in range(len(pairs)) if k not in found]:
        from ...harness.workers.pool import in_workers

        untimed = [replace(pairs[k], timed=False) for k in away]
        for k, attempt in in_workers(1, Limits(PATIENCE, MEMORY))(untimed):
            found[away[k]] = attempt.result
    return [found[k] for k in range(len(pairs))]


def once(pair: Pair) -> Answer | Failure:
    """Solve a pair once in this process, without timing."""
    case, engine = pair.case, pair.engine
    try:
        reason = engine.unsupported(case)
        if reason is not None:
            return Failure(Outcome.UNSUPPORTED, reason)
        trajectory = engine.solve(engine.build(case), case, pair.tol)
        check(case, engine.name, trajectory)
    except KincheckError as error:
        return Failure(Outcome.ERROR, str(error), kind=error.kind)
    except Exception as error:  # a defect
        return Failure(Outcome.ERROR, error_text(error))
    return Answer.of(pair, trajectory)
