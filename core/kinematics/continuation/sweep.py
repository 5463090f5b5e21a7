"""Run a compiled model along a path: the march, a closer look at doubtful samples, and the motions
of points and bodies.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...failures import FailureKind
from ...mechanism.motions import Path
from ...program import ITERATIONS
from ...trajectory import Array, Trajectory
from ..compiled.compiled_model import Model
from ..compiled.request import SIGMA
from ..compiled.routes import Route, solve_from_start
from ..compiled.solution import solution
from ..formulation.acceptance_criteria import LOW, needs_check
from .walk import follow_samples


def sweep(model: Model, path: Path, tol: float) -> Trajectory:
    """Run a compiled model over the samples of a path; see `solve`."""
    return follow(Route(model, path), tol)


def follow(route: Route, tol: float) -> Trajectory:
    """Run a compiled model along a route; see `solve`."""
    if route.single:
        return _follow(route, tol)
    compare = math.isfinite(tol)  # else nothing is asked of the samples
    return solve_from_start(
        route.begin,
        route.model.mechanism,
        route.path,
        lambda start: _follow(route.by(start), tol),
        compare=compare,
    )


def _follow(route: Route, tol: float) -> Trajectory:
    model, rows, found, message = (
        route.model,
        route.model.rows,
        follow_samples(route, tol, low=LOW),
        "",
    )
    failures: Sequence[FailureKind] = found.failures if found.ends else ()
    closure, leftover, sigma = found.worst
    largest = math.inf if model.selection.dropped else None
    findings: Mapping[str, Any] = {}
    if not math.isfinite(tol):  # nothing is asked of the samples
        message = "; ".join(found.messages)
    elif found.ends or needs_check(sigma, closure, tol, largest):
        from .singular_samples import scrutinise  # rarely needed

        scrutiny = scrutinise(route, found, tol)
        closure, leftover, sigma = _worst(
            found.kept[rows["closure"].start : rows[SIGMA].stop, found.solved]
        )
        message, findings = "; ".join(scrutiny.messages), scrutiny.details
        failures = scrutiny.failures
    if not (found.solved.any() if message else found.solved.size):
        closure = leftover = sigma = math.nan
    table = found.kept.T
    # at a singular pose rigid bodies determine no finite force: samples there are interpolated, or
    # not reached, which leaves notes or messages
    finite = not message and "notes" not in findings
    forces = model.forces.read(table, sigma) if finite and model.forces else None
    return solution(
        table,
        *model.motions,
        unit=model.frame.unit,
        solved=found.solved,
        iterations=found.kept[rows[ITERATIONS].start],
        closure=closure,
        leftover=leftover,
        message=message,
        failures=failures,
        account=route.details,
        findings={"smallest_singular_value": min(sigma, 1.0), **findings},
        forces=forces,
    )


def _worst(tests: Array) -> tuple[float, float, float]:
    """The largest residuals of kept and redundant rows, and the smallest estimate of sigma; rows
    from "closure" to `SIGMA`.
    """
    closure, leftover = np.maximum.reduce(tests[:2], axis=1, initial=0.0).tolist()
    return closure, leftover, float(np.minimum.reduce(tests[-1], initial=1.0))
