"""Solve a mechanism over a sweep: from the description to the motion of points and bodies."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import SolveError
from ..mechanism import Mechanism
from ..motions import Motion, Path, Ramp, as_changes
from ..trajectory import Array, Trajectory
from .equations.constraints import Style
from .prepare import prepare
from .request import Request
from .structure.driven import require_driven


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
    """Sweep one driver over values.

    What was made ready for the last few mechanisms is kept in the process: the next call for one of them costs a fraction.

    Args:
        mechanism: what to solve.
        driver: name of the driver that moves; the others hold their design value.
        values: driver values [m or rad], in any order: measured from the design position, or the coordinate itself where the
            driver is not relative. They are solved from the design position outwards.
        rate: driver units per second; velocities and accelerations are per second at this constant rate.
        points: points whose motion is wanted; all of them unless given.
        bodies: bodies whose motion is wanted, in the paper's variables.
        order: 0 for positions, 1 for velocities too, 2 for accelerations too. What is not asked for is not computed.
        tol: largest accepted constraint residual, relative to the mechanism's size; positive and finite.
        style: how the rows are written: "native" (global axes), "paper" (Tables 1-2, body axes), "conventional" (full
            products), "mixed" (joint coordinates as further unknowns) or "relative" (joint coordinates of a tree as the only
            ones); the solutions are the same.
        motions: of further drivers, their values measured likewise, over the time in which the swept one goes from its design
            value at the rate; the others hold.

    Returns:
        The motion; NaN where a sample cannot be reached, and the reason in its message.

    Raises:
        SolveError: drivers and degrees of freedom do not match, the mechanism does not close at the design position, or an
            argument makes no sense.
    """
    path, request = asked(mechanism, driver, values, rate, points, bodies, order, tol, style, motions)
    return prepare(mechanism, request, path)(tol)


def asked(
    mechanism: Mechanism,
    driver: str,
    values: Sequence[float] | Array,
    rate: float,
    points: Sequence[str] | None,
    bodies: Sequence[str],
    order: int,
    tol: float,
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
    _require(math.isfinite(tol) and tol > 0.0, f"tol is {tol}, expected a positive number; 1e-12 serves")
    values = _numbers(values)
    _require(np.ndim(values) == 1, f"values have shape {np.shape(values)}, expected (n,): one driver value for each sample")
    _require(bool(np.isfinite(values).all()), "values are not all finite; give finite driver values")
    _require(driver not in (motions or {}), f"motions has {driver!r}, which is swept; leave it out, or sweep another driver")
    for name, motion in (motions or {}).items():
        right = isinstance(motion, Motion)  # pyright: ignore[reportUnnecessaryIsInstance]
        _require(right, f"motions[{name!r}] is {motion!r}, expected a motion such as Sine or Table")
    for what, names, known in (
        ("driver", [driver, *(motions or {})], mechanism.drivers),
        ("point", wanted, mechanism.points),
        ("body", bodies, mechanism.bodies),
    ):
        there = [each.name for each in known]
        for name in names:
            if name not in there:
                require_driven(mechanism)  # a mechanism that nothing drives is the better explanation
                raise SolveError(f"solve: there is no {what} {name!r}; known: {', '.join(there) or 'none'}")
    design = {name: value for name in (driver, *(motions or {})) if (value := mechanism.design_value(name))}
    with np.errstate(over="ignore"):
        times = (values - design.get(driver, 0.0)) / rate
    _require(bool(np.isfinite(times).all()), f"rate is {rate}: no number is the time of the values then; give a larger one")
    path = Path({**as_changes(motions or {}, design), driver: Ramp(rate)}, times, design)
    return path, Request(tuple(path.motions), wanted, tuple(bodies), order, Style(style))


def _numbers(values: Sequence[float] | Array) -> Array:
    try:
        return np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise SolveError(f"solve: values are {values!r}, expected numbers: one driver value for each sample") from None


def _require(holds: bool, otherwise: str) -> None:
    if not holds:
        raise SolveError(f"solve: {otherwise}")
