"""Run a compiled model along a path: the march, a closer look at what is doubtful, and the motions of points and bodies."""

from __future__ import annotations

import math

import numpy as np

from ..motions import Path
from ..program import ITERATIONS
from ..trajectory import Array, BodyMotion, Motions, PointMotion, Trajectory
from .continuity import doubtful
from .march import Route, march
from .model import Model
from .request import SIGMA


def sweep(model: Model, path: Path, tol: float) -> Trajectory:
    """Run a compiled model over the samples of a path; see `solve`."""
    return follow(Route(model, path), tol)


def follow(route: Route, tol: float) -> Trajectory:
    """Run a compiled model along a route; see `solve`."""
    model, rows, found = route.model, route.model.rows, march(route, tol)
    tests, message = slice(rows["closure"].start, rows[SIGMA].stop), ""
    closure, leftover, sigma = _worst(found.kept[tests] if not found.ends else found.kept[tests, found.solved])
    details = model.details | {"redundant_residual": leftover * model.frame.unit, "smallest_singular_value": sigma}
    if not math.isfinite(tol):  # nothing is asked of the samples
        message = "; ".join(found.messages)
    elif found.ends or doubtful(sigma, closure, tol):
        from .scrutiny import scrutinise  # rarely needed

        findings = scrutinise(route, found, tol)
        closure, leftover, sigma = _worst(found.kept[tests, found.solved])
        details |= {"redundant_residual": leftover * model.frame.unit, "smallest_singular_value": sigma} | findings.details
        message = "; ".join(findings.messages)
    iterations = found.kept[rows[ITERATIONS].start]
    return Trajectory(
        points=Motions(PointMotion, found.kept.T, model.of_points),
        solved=found.solved,
        iterations=(np.where(found.solved, iterations, 0.0) if message else iterations).astype(np.int64),
        residual=closure * model.frame.unit,
        message=message,
        details=details,
        bodies=Motions(BodyMotion, found.kept.T, model.of_bodies),
    )


def _worst(tests: Array) -> tuple[float, float, float]:
    """The largest residuals of kept and redundant rows, and the smallest estimate of sigma; rows from "closure" to `SIGMA`."""
    closure, leftover = np.maximum.reduce(tests[:2], axis=1, initial=0.0).tolist()
    return closure, leftover, float(np.minimum.reduce(tests[-1], initial=1.0))
