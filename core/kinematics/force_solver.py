"""Motions with forces: by the program of the mechanism, or from the motion of all its bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from ..trajectory import Trajectory
from .compiled.request import Request
from .compiled.samples import Route
from .continuation.sweep import follow
from .followed_angles import follower
from .followed_way import Prepare

Solver = Callable[[float], Trajectory]
"""Solves what it was made for, to a tolerance."""


def motion_only(mechanism: Mechanism, request: Request) -> Request:
    """Return the request for the motion behind the forces: all bodies, with accelerations."""
    if request.forces is None:
        return request
    moving = tuple(body.name for body in mechanism.moving)
    return replace(request, bodies=moving, order=2, forces=None)


def by_motion(
    mechanism: Mechanism, request: Request, path: Path, motion: Solver, prepare: Prepare
) -> Solver:
    """Return a solver for forces from the motion of all bodies, if any are wanted.

    Args:
        prepare: makes the mechanism ready for further samples, to count turns of joints.
    """
    wanted = request.forces
    if wanted is None:
        return motion
    # most motions are asked for without forces: they need not wait for the import
    from .forces.reactions import with_forces

    names = {*wanted.joints, *wanted.drivers, *wanted.elements}

    def solve(tol: float) -> Trajectory:
        found = motion(tol)
        follow = follower(prepare, mechanism, path, found.solved)
        return with_forces(mechanism, path, found, names, request.bodies, follow)

    return solve


def by_program(
    mechanism: Mechanism,
    request: Request,
    path: Path,
    route: Callable[[Request], Route],
    prepare: Prepare,
) -> Solver:
    """Return a solver by a program of the whole mechanism, with the forces wanted.

    Singular values decide on forces near singular poses: sweeps with such samples are solved again
    by `by_motion`, as are mechanisms whose forces cannot be traced.

    Args:
        route: makes a request ready for the path.
        prepare: as for `by_motion`.
    """
    if request.forces is None:
        return partial(follow, route(request))

    def again(tol: float) -> Trajectory:
        motion = partial(follow, route(motion_only(mechanism, request)))
        return by_motion(mechanism, request, path, motion, prepare)(tol)

    from .compiled.traced_forces import can_trace  # most motions are without forces

    if not can_trace(mechanism):
        return again
    ready = route(replace(request, order=2))

    def solve(tol: float) -> Trajectory:
        found = follow(ready, tol)
        return again(tol) if found.forces is None else found

    return solve
