"""Solution of specimens: by the native engine in this process, compiled and by numpy, and by
simulators in worker processes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...case.case import Case
from ...errors import KincheckError
from ...harness.compare import output_series
from ...harness.engine import Engine, may_run_here
from ...harness.execution import Answer, Failure, Pair, bounded, check, said
from ...harness.provenance import plain
from ...harness.record import Outcome
from ...harness.resource_limits import Limits
from ...harness.standard import STANDARD
from ...kinematics.compiled.compiled_model import compile_model
from ...kinematics.compiled.request import Request
from ...kinematics.compiled.samples import Route
from ...kinematics.continuation.sweep import follow
from ...trajectory import Trajectory

# A simulator hangs if a sweep of this size takes longer [s].
PATIENCE = 60.0
MEMORY = 4.0
# Up to this number of bodies numpy is not slower than compilation; the search around singular poses
# makes larger mechanisms slow.
LARGEST_INTERPRETED = 4
MOST_INTERPRETED = 2000
"""Largest number of samples solved without compilation."""


class Interpreted:
    """The native engine with its programs run by numpy: a mechanism that is solved once
    is not compiled.
    """

    name = STANDARD
    mode = "projection"
    loop = "python"
    in_process = True
    bounds_error = True
    settings: Mapping[str, Any] = {"executor": "numpy, one call an operation over all lanes"}

    def __init__(self, native: Engine) -> None:
        self._native = native

    def version(self) -> str | None:
        """Return the version of the native engine."""
        return self._native.version()

    def unsupported(self, case: Case) -> str | None:
        """Return the native engine's reason, which is always None."""
        return self._native.unsupported(case)

    def build(self, case: Case) -> Route:
        """Build the native engine's model without a compiler."""
        path = case.sweep.path
        return Route(
            compile_model(
                case.mechanism, Request(tuple(path.motions), case.points, compiled=False)
            ),
            path,
        )

    def solve(self, model: Route, case: Case, tol: float) -> Trajectory:
        """Solve all samples along the motion."""
        return follow(model, tol)


def suited(engine: Engine, case: Case, number: int) -> Engine:
    """Return the native engine, interpreted for every other small mechanism so that both executors
    are tested; return simulators unchanged.
    """
    small = (
        len(case.mechanism.moving) <= LARGEST_INTERPRETED
        and len(case.sweep.values) <= MOST_INTERPRETED
    )
    return Interpreted(engine) if engine.name == STANDARD and number % 2 and small else engine


def solve_all(pairs: Sequence[Pair]) -> list[Answer | Failure]:
    """Return the answers in order; any error becomes a failure."""
    found: dict[int, Answer | Failure] = {}
    away = [k for k, pair in enumerate(pairs) if not may_run_here(pair.engine)]
    for k, pair in enumerate(pairs):
        if may_run_here(pair.engine):
            found[k] = once(pair)
    if away:
        from ...harness.workers.pool import in_workers

        for k, attempt in in_workers(1, Limits(PATIENCE, MEMORY))([pairs[k] for k in away]):
            found[away[k]] = attempt.result
    return [found[k] for k in range(len(pairs))]


def once(pair: Pair) -> Answer | Failure:
    """Solve a pair in this process, once and without timing."""
    case, engine = pair.case, pair.engine
    try:
        reason = engine.unsupported(case)
        if reason is not None:
            return Failure(Outcome.UNSUPPORTED, reason)
        trajectory = engine.solve(engine.build(case), case, pair.tol)
        check(case, engine.name, trajectory)
    except KincheckError as error:
        return Failure(Outcome.ERROR, str(error))
    except Exception as error:  # a defect, judged by its text
        return Failure(Outcome.ERROR, said(error))
    return Answer(
        outputs={output.name: output_series(case, output, trajectory) for output in case.outputs},
        solved=int(trajectory.solved.sum()),
        iterations=int(trajectory.iterations.sum()),
        residual=float(trajectory.residual),
        message=bounded(trajectory.message),
        details=plain(trajectory.details),
    )
