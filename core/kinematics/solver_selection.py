"""Choice of the blocks by the size of a mechanism: one program, components one after the other, or
one sparse system.

The solutions and verdicts are the same to round-off. One program costs least for each sample, and
most to trace and compile: its size grows faster than the mechanism. Components share programs, so a
chain of thousands is made ready in seconds. An indivisible mechanism too large for one program is a
sparse system. Measured on chains of four-bars, one program (first interpreted, and compiled if it
runs often) against components: 21 bodies 2.3 (0.5) and 3.1 us a sample, made ready in 0.1 and 0.3
s; 41 bodies 4.4 (0.9) and 3.8 us, in 0.3 and 0.3 s. On rings of loops, one program against a sparse
system: 31 bodies 21 and 70 us, made ready in 0.6 and 0.04 s; 39 bodies 42 and 85 us, in 0.8 and
0.06 s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from ..caches import keep_last
from ..errors import SolveError
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from . import followed_angles, followed_attitudes
from .compiled.motion_start import start_of
from .compiled.program_cache import is_builtin
from .compiled.request import Request
from .compiled.samples import recent_route
from .force_solver import Solver, by_motion, by_program, motion_only
from .formulation.constraints import Style, frames

# Moving bodies up to which one program is made ready in a second, and as fast as components before
# it is compiled. Larger rings are so near to singular that the estimate of sigma by one program
# leaves all their samples in doubt.
ONE_PROGRAM = 40


def prepare(mechanism: Mechanism, request: Request, path: Path) -> Solver:
    """Make a mechanism ready to be solved along a path.

    Forces are computed by the program of the whole mechanism if there is one, else from the motion
    of all bodies.

    Raises:
        SolveError: drivers and degrees of freedom do not match, or the mechanism does not close at
            the design position.
    """
    if len(mechanism.moving) > ONE_PROGRAM and request.style is Style.NATIVE:
        known = is_builtin(mechanism) and path.is_builtin
        make = (_recent_large if known else _large)(mechanism, motion_only(mechanism, request))
        return by_motion(mechanism, request, path, make(path), prepare)
    return by_program(
        mechanism, request, path, lambda each: recent_route(mechanism, each, path), prepare
    )


followed_angle = partial(followed_angles.followed_angle, prepare)
followed_attitude = partial(followed_attitudes.followed_attitude, prepare)
follower = partial(followed_angles.follower, prepare)


def start_notes(mechanism: Mechanism, request: Request, path: Path, tol: float) -> list[str]:
    """Return notes on the assumed start of many designs, by the nominal one; none if the design
    decides it.
    """
    start = start_of(mechanism, path)
    if start.stands and not start.ambiguous:
        return []
    return [*prepare(mechanism, replace(request, varied=()), path)(tol).details.get("notes", ())]


def _large(mechanism: Mechanism, request: Request) -> Callable[[Path], Solver]:
    """Return a solver by components or by a sparse system."""
    # few mechanisms are so large: the others need not wait for the import
    from .blocks.cascade import Cascade
    from .blocks.component_lanes import ComponentLanes
    from .blocks.lanes import Lanes
    from .blocks.sweep import BlockSweep
    from .structure.components import components
    from .structure.driver_count import require_driven

    try:
        # couplers tie components together
        parts = [] if mechanism.couplers else components(mechanism, frames(mechanism))
    except SolveError:
        require_driven(mechanism)  # which names what can still move
        raise
    if parts and max(len(part.bodies) for part in parts) <= ONE_PROGRAM:
        lanes: Lanes = ComponentLanes(Cascade(mechanism, request, parts))
    else:
        from .blocks.sparse_lanes import SparseLanes

        lanes = SparseLanes(mechanism, request)

    def along(path: Path) -> Solver:
        return BlockSweep(lanes, path).solve

    again = keep_last(1)(along)
    return lambda path: (again if path.is_builtin else along)(path)


# One only, and of its paths the last: they fill much of the memory. A thread solves it in place.
_recent_large = keep_last(1, per_thread=True)(_large)
