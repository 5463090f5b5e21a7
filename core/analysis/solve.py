"""Solve a mechanism over a sweep: from the description to the motion of points and bodies."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..errors import SolveError
from ..mechanism import Mechanism
from ..motions import Motion, Path, Ramp
from ..trajectory import Array, BodyMotion, PointMotion, Trajectory
from .equations import Style
from .freedom import require_driven
from .march import March, march
from .model import Model, compile_model
from .programs import Request


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
    model = compile_model(mechanism, Request(tuple(path.motions), wanted, tuple(bodies), order, Style(style)))
    return sweep(model, path, tol)


def _require(holds: bool, otherwise: str) -> None:
    if not holds:
        raise SolveError(f"solve: {otherwise}")


def sweep(model: Model, path: Path, tol: float) -> Trajectory:
    """Run a compiled model over the samples of a path; see `solve`."""
    found = march(model, path, tol)
    worst = {
        "closure": _row(model, found, "closure").max(initial=0.0),
        "redundant_residual": _row(model, found, "leftover").max(initial=0.0) * model.frame.unit,
        "smallest_pivot": _row(model, found, "pivot").min(initial=1.0),
    }
    return Trajectory(
        points={name: _point(model, found, name) for name in model.request.points},
        solved=found.solved,
        iterations=found.iterations,
        residual=float(worst.pop("closure")) * model.frame.unit,
        message="; ".join(found.messages),
        details=_details(model) | {name: float(value) for name, value in worst.items()},
        bodies={name: _body(model, found, name) for name in model.request.bodies},
    )


def _row(model: Model, found: March, name: str) -> Array:
    """One slot over the samples that were reached."""
    return found.lanes[model.place[model.slots[name]], found.solved]


def _details(model: Model) -> dict[str, Any]:
    account = model.selection.account
    return {
        "rank": account.rank,
        "dof": account.dof,
        "dof_account": {
            "bodies": account.bodies,
            "coordinates": account.coordinates,
            "equations": account.equations,
            "paper": account.counted,
            "moving_coordinates": account.moving_coordinates,
            "rows": account.rows,
            "rank": account.rank,
            "dof": account.dof,
            "redundant_rows": list(account.redundant_rows),
        },
        "program": model.sizes,
    }


def _slots(model: Model, found: March, *names: str) -> Array:
    """Vectors of the samples by slot name, side by side, shape (n, ...)."""
    return found.lanes[[model.place[slot] for name in names for slot in model.vectors[name]]].T.copy()


def _point(model: Model, found: March, name: str) -> PointMotion:
    order = model.request.order
    return PointMotion(
        position=_slots(model, found, f"position {name}"),
        velocity=_slots(model, found, f"velocity {name}") if order >= 1 else None,
        acceleration=_slots(model, found, f"acceleration {name}") if order == 2 else None,
    )


def _body(model: Model, found: March, name: str) -> BodyMotion:
    order = model.request.order
    return BodyMotion(
        r=_slots(model, found, f"r {name}"),
        p=_slots(model, found, f"p {name}"),
        v=_slots(model, found, f"rdot {name}", f"omega {name}") if order >= 1 else None,
        a=_slots(model, found, f"rddot {name}", f"omega_t {name}") if order == 2 else None,
    )
