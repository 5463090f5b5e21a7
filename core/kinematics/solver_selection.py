"""Choice of the solver by the size of a mechanism: one program, component by component, or one
sparse system.

The solutions are the same to round-off. One program costs least for each sample, and most to trace:
its size grows faster than the mechanism. Components share programs, so a chain of thousands is made
ready in seconds. An indivisible mechanism too large for one program is a sparse system. Measured on
chains of four-bars, one program against components, both interpreted: 17 bodies 3 and 13 us a
sample; 33 bodies 7 and 23 us, made ready in 0.5 and 0.1 s; 65 bodies 15 and 57 us, 1.6 and 0.2 s.
Compiled, 33 bodies take 3 and 8 us, after 6 s and 0.1. On rings of loops, one program against a
sparse system: 31 bodies 21 and 180 us, made ready in 1.3 and 0.04 s; 39 bodies 42 and 275 us, 2.2
and 0.06 s. Near singular poses one program knows sigma; a sparse system knows only pivots, and
refuses more of the solvable samples.
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

# Up to as many bodies one program is made ready in a third of a second.
ONE_PROGRAM = 20
# An irreducible mechanism is worth two seconds, once: as one program it is six times as fast as a
# sparse system. Larger rings are so near to singular that the estimate of sigma leaves all their
# samples in doubt.
IRREDUCIBLE = 40


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
        if make:
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


def _large(mechanism: Mechanism, request: Request) -> Callable[[Path], Solver] | None:
    """Return a solver by components or by a sparse system; None if one program is better."""
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
    elif len(mechanism.moving) <= IRREDUCIBLE:
        return None
    else:
        from .blocks.sparse_lanes import SparseLanes
        from .sparse.sparse_equations import SparseEquations

        lanes = SparseLanes(SparseEquations(mechanism, compiled=request.compiled), request)

    def along(path: Path) -> Solver:
        return BlockSweep(lanes, path).solve

    again = keep_last(1)(along)
    return lambda path: (again if path.is_builtin else along)(path)


# One only, and of its paths the last: they fill much of the memory. A thread solves it in place.
_recent_large = keep_last(1, per_thread=True)(_large)
