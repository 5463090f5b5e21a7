"""Run a compiled model along a path: the march, a closer look at what is doubtful, and the motions of points and bodies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..motions import Path
from ..trajectory import Array, BodyMotion, PointMotion, Trajectory
from .continuity import doubtful
from .march import March, Route, march
from .model import Model
from .request import SIGMA


def sweep(model: Model, path: Path, tol: float) -> Trajectory:
    """Run a compiled model over the samples of a path; see `solve`."""
    return follow(Route(model, path), tol)


def follow(route: Route, tol: float) -> Trajectory:
    """Run a compiled model along a route; see `solve`."""
    model, found = route.model, march(route, tol)
    closure, leftover, sigma = _tests(route, found, whole=not found.ends)
    details, message = model.details | _shown(model, leftover, sigma), ""
    if not math.isfinite(tol):  # nothing is asked of the samples
        message = "; ".join(found.messages)
    elif found.ends or doubtful(sigma, closure, tol):
        from .scrutiny import scrutinise  # rarely needed

        findings = scrutinise(route, found, tol)
        closure, leftover, sigma = _tests(route, found, whole=False)
        details |= _shown(model, leftover, sigma) | findings.details
        message = "; ".join(findings.messages)
    iterations, samples = found.kept[model.rows["iterations"].start], found.kept.T
    return Trajectory(
        points={name: PointMotion(*_motions(samples, rows, 3)) for name, rows in model.of_points.items()},
        solved=found.solved,
        iterations=(np.where(found.solved, iterations, 0.0) if message else iterations).astype(np.int64),
        residual=closure * model.frame.unit,
        message=message,
        details=details,
        bodies={name: BodyMotion(*_motions(samples, rows, 4)) for name, rows in model.of_bodies.items()},
    )


def _tests(route: Route, found: March, *, whole: bool) -> tuple[float, float, float]:
    """Of all solved samples: the largest residuals of kept and redundant rows, and the smallest estimate of sigma."""
    rows = route.model.rows
    tests = found.kept[rows["closure"].start : rows[SIGMA].stop]
    solved = tests if whole else tests[:, found.solved]
    closure, leftover = solved[:2].max(axis=1, initial=0.0).tolist()
    return closure, leftover, float(np.abs(solved[-1]).min(initial=1.0))


def _shown(model: Model, leftover: float, sigma: float) -> dict[str, float]:
    return {"redundant_residual": leftover * model.frame.unit, "smallest_singular_value": sigma}


def _motions(samples: Array, rows: Sequence[slice], count: int) -> list[Any]:
    """The motions that were asked for, and None for the others."""
    return [*(samples[:, each] for each in rows), *[None] * (count - len(rows))]
