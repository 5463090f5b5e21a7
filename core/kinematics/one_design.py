"""Solve a mechanism over a sweep: from the description to the motion of points and bodies.

Forces come from the program of the mechanism, or from the motion of all its bodies.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..driving import Driving
from ..errors import SolveError
from ..input_checks import finite, names_of, real, require_kind, require_known
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Motion, Path, Ramp, as_changes
from ..trajectory import Array, Trajectory
from .compiled.request import Request
from .compiled.routes import Route, recent_route
from .continuation.sweep import follow
from .forces.wanted import wanted_forces
from .formulation.styles import NATIVE, require_style
from .motion_solver import Solver, in_blocks, prepare_motion
from .structure.degrees_of_freedom import require_driven


def motion_only(mechanism: Mechanism, request: Request) -> Request:
    """Return the request for the motion behind the forces: all bodies, with accelerations."""
    if request.forces is None:
        return request
    moving = tuple(body.name for body in mechanism.moving)
    return replace(request, bodies=moving, order=2, forces=None)


def by_motion(mechanism: Mechanism, request: Request, path: Path, motion: Solver) -> Solver:
    """Return a solver for forces from the motion of all bodies, if any are wanted."""
    wanted = request.forces
    if wanted is None:
        return motion
    # most motions are asked for without forces: they need not wait for the import
    from .followed import follower
    from .forces.reactions import with_forces

    names = {*wanted.joints, *wanted.drivers, *wanted.elements}

    def solve(tol: float) -> Trajectory:
        found = motion(tol)
        turns = follower(mechanism, path, found.solved)
        return with_forces(mechanism, path, found, names, request.bodies, turns)

    return solve


def by_program(
    mechanism: Mechanism, request: Request, path: Path, route: Callable[[Request], Route]
) -> Solver:
    """Return a solver by a program of the whole mechanism, with the forces wanted.

    Singular values decide on forces near singular poses: sweeps with such samples are solved again
    by `by_motion`, as are mechanisms whose forces cannot be traced.

    Args:
        route: makes a request ready for the path.
    """
    if request.forces is None:
        return partial(follow, route(request))

    def again(tol: float) -> Trajectory:
        motion = partial(follow, route(motion_only(mechanism, request)))
        return by_motion(mechanism, request, path, motion)(tol)

    from .compiled.traced_forces import can_trace  # most motions are without forces

    if not can_trace(mechanism):
        return again
    ready = route(replace(request, order=2))

    def solve(tol: float) -> Trajectory:
        found = follow(ready, tol)
        return again(tol) if found.forces is None else found

    return solve


def prepare(mechanism: Mechanism, request: Request, path: Path) -> Solver:
    """Make a mechanism ready to be solved along a path.

    Forces are computed by the program of the whole mechanism if there is one, else from the motion
    of all bodies.

    Raises:
        SolveError: drivers and degrees of freedom do not match, or the mechanism does not close at
            the design position.
    """
    if request.forces is None or in_blocks(mechanism, request):
        motion = prepare_motion(mechanism, motion_only(mechanism, request), path)
        return by_motion(mechanism, request, path, motion)
    return by_program(mechanism, request, path, lambda each: recent_route(mechanism, each, path))


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
    style: str = NATIVE,
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
        style: form of the rows: "native" (global axes) or "mixed" (joint coordinates as further
            unknowns); of the extension laboratory "paper" (Tables 1-2, body axes), "conventional"
            (full products) or "relative" (joint coordinates of a tree as the only unknowns). The
            solutions are the same.
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
    path, request = parse_solve_arguments(
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
    moved = partial(driving_of, mechanism, path, driver, np.array(values, dtype=float))
    if forces is not False:
        names = None if forces is True else forces
        request = replace(request, forces=wanted_forces(mechanism, names))
    return prepare(mechanism, request, path)(tol).along(moved)


def driving_of(mechanism: Mechanism, path: Path, driver: str, values: Array) -> Driving:
    """Return the driver values of a path; those of the swept driver are given."""
    moved = path.drive([*path.motions], path.times)[0]
    found = {
        name: path.design.get(name, 0.0) + value
        for name, value in zip(path.motions, moved, strict=True)
    }
    found = {driver: values} | {name: each for name, each in found.items() if name != driver}
    units = {name: "rad" if mechanism.driver(name).turns else "m" for name in found}
    return Driving(path.times, found, units)


def parse_solve_arguments(
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
    style: str = NATIVE,
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
    # a mechanism that nothing drives is the better explanation
    driven = partial(require_driven, mechanism)
    require_known(who, "driver", (driver, *motions), mechanism.drivers, driven)
    require_known(who, "point", wanted, mechanism.points, driven)
    require_known(who, "body", bodies, mechanism.bodies, driven)
    design = {name: value for name in (driver, *motions) if (value := mechanism.design_value(name))}
    with np.errstate(over="ignore"):
        times = (values - design.get(driver, 0.0)) / rate
    if not np.isfinite(times).all():
        raise SolveError(
            f"{who}: rate is {rate}: no number is the time of the values then; give a larger one"
        )
    path = Path({**as_changes(motions, design), driver: Ramp(float(rate))}, times, design)
    return path, Request(tuple(path.motions), wanted, bodies, int(order), require_style(style))


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
