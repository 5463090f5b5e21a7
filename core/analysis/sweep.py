"""Run a compiled model along a path: the march, a closer look at what is doubtful, and the motions of points and bodies."""

from __future__ import annotations

import math

import numpy as np

from ..motions import Path
from ..trajectory import BodyMotion, PointMotion, Trajectory
from .continuity import doubtful
from .march import March, Route, march
from .model import Model


def sweep(model: Model, path: Path, tol: float) -> Trajectory:
    """Run a compiled model over the samples of a path; see `solve`."""
    return follow(Route(model, path), tol)


def follow(route: Route, tol: float) -> Trajectory:
    """Run a compiled model along a route; see `solve`."""
    model, found = route.model, march(route, tol)
    closure, leftover, pivot = _tests(route, found, whole=not found.ends)
    details, message = model.details | {"redundant_residual": leftover * model.frame.unit, "smallest_pivot": pivot}, ""
    if not math.isfinite(tol):  # nothing is asked of the samples
        message = "; ".join(found.messages)
    elif found.ends or doubtful(np.array(pivot), np.array(closure), tol):
        from .scrutiny import scrutinise  # rarely needed

        findings = scrutinise(route, found, tol)
        closure, leftover, pivot = _tests(route, found, whole=False)
        details |= {"redundant_residual": leftover * model.frame.unit, "smallest_pivot": pivot} | findings.details
        message = "; ".join(findings.messages)
    iterations = found.kept[model.rows["iterations"].start]
    return Trajectory(
        points={name: _point(model, found, name) for name in model.request.points},
        solved=found.solved,
        iterations=np.where(found.solved, iterations, 0.0).astype(np.int64),
        residual=closure * model.frame.unit,
        message=message,
        details=details,
        bodies={name: _body(model, found, name) for name in model.request.bodies},
    )


def _tests(route: Route, found: March, *, whole: bool) -> tuple[float, float, float]:
    """Of all solved samples: the largest residuals of kept and redundant rows, and the smallest pivot."""
    rows = route.model.rows
    tests = found.kept[rows["closure"].start : rows["pivot"].stop]
    solved = tests if whole else tests[:, found.solved]
    closure, leftover = solved[:2].max(axis=1, initial=0.0).tolist()
    return closure, leftover, float(np.abs(solved[3]).min(initial=1.0))


def _point(model: Model, found: March, name: str) -> PointMotion:
    motions = [found.kept[model.rows[f"{label} {name}"]].T for label in ("position", "velocity", "acceleration")[: model.orders]]
    return PointMotion(*motions, *[None] * (3 - len(motions)))


def _body(model: Model, found: March, name: str) -> BodyMotion:
    """Rates of place and of rotation stand side by side, so that both are one view."""
    rows = model.rows
    motions = [found.kept[rows[f"{label} {name}"]].T for label in ("r", "p")]
    for first, last in (("rdot", "omega"), ("rddot", "omega_t"))[: model.orders - 1]:
        motions.append(found.kept[rows[f"{first} {name}"].start : rows[f"{last} {name}"].stop].T)
    return BodyMotion(*motions, *[None] * (4 - len(motions)))
