"""Having specimens solved: the native engine here, by machine code and by numpy, simulators in
worker processes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...case.case import Case
from ...errors import KincheckError
from ...harness.compare import output_series
from ...harness.engine import Engine
from ...harness.execution import Answer, Failure, Pair, bounded, check, said
from ...harness.provenance import plain
from ...harness.record import Outcome
from ...harness.resource_limits import Limits
from ...harness.run import NATIVE
from ...kinematics.compiled.compiled_model import compile_model
from ...kinematics.compiled.request import Request
from ...kinematics.compiled.samples import Route
from ...kinematics.continuation.sweep import follow
from ...trajectory import Trajectory

# A simulator that takes longer for a sweep of this size hangs [s].
PATIENCE = 60.0
MEMORY = 4.0
# Up to so many bodies numpy costs no more than compiling; the search around singular poses makes
# larger ones slow.
LARGEST_INTERPRETED = 4
MOST_INTERPRETED = 2000
"""Samples for which it is not compiled."""


class Interpreted:
    """The native engine with its programs run by numpy: nothing is compiled for a mechanism that is
    met once.
    """

    name = NATIVE
    mode = "projection"
    loop = "python"
    settings: Mapping[str, Any] = {"executor": "numpy, one call an operation over all lanes"}

    def __init__(self, native: Engine) -> None:
        self._native = native

    def version(self) -> str | None:
        """Return the version of the native engine."""
        return self._native.version()

    def unsupported(self, case: Case) -> str | None:
        """Never."""
        return self._native.unsupported(case)

    def build(self, case: Case) -> Route:
        """Make the model that the native engine makes, without a compiler."""
        path = case.sweep.path
        return Route(
            compile_model(
                case.mechanism, Request(tuple(path.motions), case.points, compiled=False)
            ),
            path,
        )

    def solve(self, model: Route, case: Case, tol: float) -> Trajectory:
        """March all samples."""
        return follow(model, tol)


def suited(engine: Engine, case: Case, number: int) -> Engine:
    """The native engine, interpreted for every other small mechanism, so that both executors are
    met; simulators as they are.
    """
    small = (
        len(case.mechanism.moving) <= LARGEST_INTERPRETED
        and len(case.sweep.values) <= MOST_INTERPRETED
    )
    return Interpreted(engine) if engine.name == NATIVE and number % 2 and small else engine


def solve_all(pairs: Sequence[Pair]) -> list[Answer | Failure]:
    """The answers, in order; whatever is raised is a failure."""
    found: dict[int, Answer | Failure] = {}
    away = [k for k, pair in enumerate(pairs) if pair.engine.name != NATIVE]
    for k, pair in enumerate(pairs):
        if pair.engine.name == NATIVE:
            found[k] = once(pair)
    if away:
        from ...harness.workers.pool import in_workers

        for k, attempt in in_workers(1, Limits(PATIENCE, MEMORY))([pairs[k] for k in away]):
            found[away[k]] = attempt.result
    return [found[k] for k in range(len(pairs))]


def once(pair: Pair) -> Answer | Failure:
    """Solve a pair here, once: no time is taken."""
    case, engine = pair.case, pair.engine
    try:
        reason = engine.unsupported(case)
        if reason is not None:
            return Failure(Outcome.UNSUPPORTED, reason)
        trajectory = engine.solve(engine.build(case), case, pair.tol)
        check(case, engine.name, trajectory)
    except KincheckError as error:
        return Failure(Outcome.ERROR, str(error))
    except Exception as error:  # a defect: no refusal, and judged as what it is by its text
        return Failure(Outcome.ERROR, said(error))
    return Answer(
        outputs={output.name: output_series(case, output, trajectory) for output in case.outputs},
        solved=int(trajectory.solved.sum()),
        iterations=int(trajectory.iterations.sum()),
        residual=float(trajectory.residual),
        message=bounded(trajectory.message),
        details=plain(trajectory.details),
    )
