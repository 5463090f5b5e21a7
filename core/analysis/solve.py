"""Solve a mechanism over a sweep: from the description to the motion of points and bodies."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import SolveError
from ..mechanism import Mechanism
from ..motions import Motion, Path, Ramp
from ..trajectory import Array, BodyMotion, PointMotion, Trajectory
from .continuity import doubtful
from .equations import Style
from .freedom import require_driven
from .march import March, Route, march
from .model import Model, compile_model
from .request import Request


def solve(
    mechanism: Mechanism,
    driver: str,
    values: Sequence[float] | Array,
    *,
    rate: float = 1.0,
    points: Sequence[str] | None = None,
    bodies: Sequence[str] = (),
    order: int = 2,
    tol: float = 1e-12,
    style: str = "native",
    motions: Mapping[str, Motion] | None = None,
) -> Trajectory:
    """Sweep one driver over values, measured from the design position.

    Args:
        mechanism: what to solve.
        driver: name of the driver that moves; the others hold their design value.
        values: driver values [m or rad], in any order; solved from zero outwards.
        rate: driver units per second; velocities and accelerations are per second at this constant rate.
        points: points whose motion is wanted; all of them unless given.
        bodies: bodies whose motion is wanted, in the paper's variables.
        order: 0 for positions, 1 for velocities too, 2 for accelerations too. What is not asked for is not computed.
        tol: largest accepted constraint residual, relative to the mechanism's size.
        style: how the rows are written: "native" (global axes), "paper" (Tables 1-2, body axes), "conventional" (full
            products), "mixed" (joint coordinates as further unknowns) or "relative" (joint coordinates of a tree as the only
            ones); the solutions are the same.
        motions: of further drivers, over the time in which the swept one goes from zero at the rate; the others hold.

    Returns:
        The motion; NaN where a sample cannot be reached, and the reason in its message.

    Raises:
        SolveError: drivers and degrees of freedom do not match, the mechanism does not close at the design position, or an
            argument makes no sense.
    """
    path, request = asked(mechanism, driver, values, rate, points, bodies, order, style, motions)
    return sweep(compile_model(mechanism, request), path, tol)


def asked(
    mechanism: Mechanism,
    driver: str,
    values: Sequence[float] | Array,
    rate: float,
    points: Sequence[str] | None,
    bodies: Sequence[str],
    order: int,
    style: str,
    motions: Mapping[str, Motion] | None,
) -> tuple[Path, Request]:
    """The path and the request that the arguments of `solve` mean.

    Raises:
        SolveError: an argument makes no sense.
    """
    wanted = tuple(point.name for point in mechanism.points) if points is None else tuple(points)
    _require(order in (0, 1, 2), f"order is {order}, expected 0, 1 or 2")
    _require(math.isfinite(rate) and rate != 0.0, f"rate is {rate}, expected driver units per second other than 0; 1 serves")
    _require(bool(np.isfinite(values).all()), "values are not all finite; give finite driver values")
    for what, names, known in (
        ("driver", [driver, *(motions or {})], mechanism.drivers),
        ("point", wanted, mechanism.points),
        ("body", bodies, mechanism.bodies),
    ):
        for name in names:
            there = [each.name for each in known]
            if name not in there:
                require_driven(mechanism)  # a mechanism that nothing drives is the better explanation
            _require(name in there, f"there is no {what} {name!r}; known: {', '.join(there) or 'none'}")
    path = Path({**(motions or {}), driver: Ramp(rate)}, np.asarray(values, dtype=np.float64) / rate)
    return path, Request(tuple(path.motions), wanted, tuple(bodies), order, Style(style))


def _require(holds: bool, otherwise: str) -> None:
    if not holds:
        raise SolveError(f"solve: {otherwise}")


def sweep(model: Model, path: Path, tol: float) -> Trajectory:
    """Run a compiled model over the samples of a path; see `solve`."""
    return follow(Route(model, path), tol)


def follow(route: Route, tol: float) -> Trajectory:
    """Run a compiled model along a route; see `solve`."""
    model, found = route.model, march(route, tol)
    closure, leftover, pivot = _tests(route, found, whole=not found.ends)
    details, message = model.details | {"redundant_residual": leftover * model.frame.unit, "smallest_pivot": abs(pivot)}, ""
    if not math.isfinite(tol):  # nothing is asked of the samples
        message = "; ".join(found.messages)
    elif found.ends or doubtful(pivot, closure, tol):
        from .scrutiny import scrutinise  # rarely needed

        findings = scrutinise(route, found, tol)
        closure, leftover, pivot = _tests(route, found, whole=False)
        details |= {"redundant_residual": leftover * model.frame.unit, "smallest_pivot": abs(pivot)} | findings.details
        message = "; ".join(findings.messages)
    iterations = found.kept[model.rows["iterations"].start]
    return Trajectory(
        points={name: _point(model, found, name) for name in model.request.points},
        solved=found.solved,
        iterations=(np.where(found.solved, iterations, 0.0) if message else iterations).astype(np.int64),
        residual=closure * model.frame.unit,
        message=message,
        details=details,
        bodies={name: _body(model, found, name) for name in model.request.bodies},
    )


def _tests(route: Route, found: March, *, whole: bool) -> tuple[float, float, float]:
    """Of all solved samples: the largest residuals of kept and redundant rows, and the smallest pivot, negative where any is.

    A pivot is negative beyond a singular pose, where the determinant's sign is not that of the start.
    """
    rows = route.model.rows
    tests = found.kept[rows["closure"].start : rows["pivot"].stop]
    solved = tests if whole else tests[:, found.solved]
    closure, leftover = solved[:2].max(axis=1, initial=0.0).tolist()
    pivots = solved[3]
    return closure, leftover, float(pivots.min(initial=1.0) if route.ahead else -pivots.max(initial=-1.0))


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
