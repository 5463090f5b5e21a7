"""Solve a mechanism over a sweep: from the description to the motion of points and bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..driving import Driving
from ..errors import SolveError
from ..input_checks import finite, names_of, no_such, real, require_kind
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Motion, Path, Ramp, as_changes
from ..trajectory import Array, Trajectory
from .compiled.request import Request
from .formulation.constraints import Style
from .solver_selection import prepare
from .structure.driver_count import require_driven


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
    forces: bool | Sequence[str] = False,
) -> Trajectory:
    """Sweep one driver over values.

    The last few mechanisms stay ready in the process: the next call for one of them costs a
    fraction.

    Args:
        mechanism: the mechanism to solve.
        driver: name of the moving driver; the others hold their design value.
        values: driver values [m or rad], in any order: measured from the design position, or the
            coordinate itself if the driver is not relative. They are solved from the design
            position outwards.
        rate: driver units per second; velocities and accelerations are per second at this constant
            rate.
        points: points whose motion is wanted; all of them by default.
        bodies: bodies whose motion is wanted, in the paper's variables.
        order: 0 for positions, 1 for velocities too, 2 for accelerations too. Nothing else is
            computed.
        tol: largest accepted constraint residual, relative to the mechanism's size; positive and
            finite.
        style: form of the rows: "native" (global axes), "paper" (Tables 1-2, body axes),
            "conventional" (full products), "mixed" (joint coordinates as further unknowns) or
            "relative" (joint coordinates of a tree as the only ones); the solutions are the same.
        motions: of further drivers, with values measured likewise, over the time in which the swept
            one goes from its design value at the rate; the others hold. They are evaluated at the
            samples, and between them in divided steps: a motion there and back between two samples
            is not noticed.
        forces: joints, drivers and force elements whose forces are wanted; True for all of them.
            They need masses, and take the motion of all bodies with accelerations in any case.

    Returns:
        The motion; NaN at samples out of reach, with the reason in its message.

    Raises:
        SolveError: drivers and degrees of freedom do not match, the mechanism does not close at the
            design position, or an argument makes no sense.
    """
    path, request = asked(
        "solve",
        mechanism,
        driver,
        values,
        motions or {},
        rate=rate,
        points=points,
        bodies=bodies,
        order=order,
        tol=tol,
        style=style,
    )
    moved = partial(driving, mechanism, path, driver, np.array(values, dtype=float))
    if forces is not False:
        from .forces.wanted import wanted_forces  # most motions are without forces

        names = None if forces is True else forces
        request = replace(request, forces=wanted_forces(mechanism, names))
    return prepare(mechanism, request, path)(tol).along(moved)


def driving(mechanism: Mechanism, path: Path, driver: str, values: Array) -> Driving:
    """Return the driver values of a path; those of the swept driver are given."""
    moved = path.drive([*path.motions], path.times)[0]
    found = {
        name: path.design.get(name, 0.0) + value
        for name, value in zip(path.motions, moved, strict=True)
    }
    found = {driver: values} | {name: each for name, each in found.items() if name != driver}
    units = {name: "rad" if mechanism.driver(name).turns else "m" for name in found}
    return Driving(path.times, found, units)


def asked(
    who: str,
    mechanism: Mechanism,
    driver: str,
    values: Sequence[float] | Array,
    motions: Mapping[str, Motion],
    *,
    rate: float,
    points: Sequence[str] | None,
    order: int,
    tol: float,
    bodies: Sequence[str] = (),
    style: str = "native",
) -> tuple[Path, Request]:
    """Return the path and the request for the arguments of `solve`.

    Raises:
        SolveError: an argument makes no sense; the message begins with the caller's name.
    """
    require_kind(who, "mechanism", mechanism, Mechanism)
    wanted = (
        tuple(point.name for point in mechanism.points)
        if points is None
        else names_of(who, "points", points)
    )
    bodies = names_of(who, "bodies", bodies)
    values = real(who, "values", values, "one driver value for each sample")
    problem = _problem(driver, values, motions, rate, order, tol)
    if problem:
        raise SolveError(f"{who}: {problem}")
    for what, names, known in (
        ("driver", (driver, *motions), mechanism.drivers),
        ("point", wanted, mechanism.points),
        ("body", bodies, mechanism.bodies),
    ):
        there = [each.name for each in known]
        for name in names:
            if name not in there:
                # a mechanism that nothing drives is the better explanation
                require_driven(mechanism)
                raise no_such(who, what, name, there)
    design = {name: value for name in (driver, *motions) if (value := mechanism.design_value(name))}
    with np.errstate(over="ignore"):
        times = (values - design.get(driver, 0.0)) / rate
    if not np.isfinite(times).all():
        raise SolveError(
            f"{who}: rate is {rate}: no number is the time of the values then; give a larger one"
        )
    path = Path({**as_changes(motions, design), driver: Ramp(float(rate))}, times, design)
    return path, Request(tuple(path.motions), wanted, bodies, int(order), Style(style))


def _problem(
    driver: str, values: Array, motions: Mapping[str, Motion], rate: float, order: int, tol: float
) -> str:
    """Return the problem with the arguments, or an empty text; composed only if there is one,
    because that takes time.
    """
    if not finite(order) or order not in (0, 1, 2):
        return f"order is {order!r}, expected 0, 1 or 2"
    if not (finite(rate) and rate != 0.0):
        return f"rate is {rate!r}, expected driver units per second other than 0; 1 serves"
    if not (finite(tol) and tol > 0.0):
        return f"tol is {tol!r}, expected a positive number; 1e-12 serves"
    if values.ndim != 1:
        return f"values have shape {values.shape}, expected (n,): one driver value for each sample"
    if not np.isfinite(values).all():
        return "values are not all finite; give finite driver values"
    if driver in motions:
        return f"motions has {driver!r}, which is swept; leave it out, or sweep another driver"
    for name, motion in motions.items():
        if not isinstance(motion, Motion):  # pyright: ignore[reportUnnecessaryIsInstance]
            return f"motions[{name!r}] is {motion!r}, expected a motion such as Sine or Table"
    return ""
