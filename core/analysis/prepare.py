"""How a mechanism is solved is chosen by its size: as one program, component by component, or as one sparse system.

The answers are the same to round-off. One program costs least for each sample, and much to make: its text grows faster than what it
ties together. Components share programs, so that a chain of thousands is made ready in seconds; what is irreducible and too large
for one program is a sparse system. Measured on chains of four-bars, one program against components: 3 bodies 0.7 and 8 us a sample,
made ready in 0.2 and 0.3 s; 17 bodies 2.7 and 25 us, 2.2 and 0.3 s; 33 bodies 2.5 and 14 us, 5.9 and 0.3 s.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from ..mechanism import Mechanism
from ..motions import Path
from ..trajectory import Trajectory
from .equations import Style, frames
from .model import recent_model
from .request import Request
from .route import Route
from .sweep import follow

# Up to as many bodies one program is made in about a second.
ONE_PROGRAM = 13
# An irreducible mechanism is worth up to some seconds: as one program it is then ten times faster than as a sparse system.
IRREDUCIBLE = 25

Solver = Callable[[float], Trajectory]
"""Solves what it was made for, to a tolerance."""


def prepare(mechanism: Mechanism, request: Request, path: Path) -> Solver:
    """Make a mechanism ready to be solved along a path.

    Raises:
        SolveError: drivers and degrees of freedom do not match, or the mechanism does not close at the design position.
    """
    count = len(mechanism.moving)
    if count > ONE_PROGRAM and request.style is Style.NATIVE and not mechanism.couplers:
        # few mechanisms are so large: the others need not wait for the import
        from .cascade import Cascade
        from .cascade_sweep import CascadeSweep
        from .components import components

        parts = components(mechanism, frames(mechanism))
        if max(len(part.bodies) for part in parts) <= ONE_PROGRAM:
            return CascadeSweep(Cascade(mechanism, request, parts), path).solve
        if count > IRREDUCIBLE:
            from .sparse import SparseModel
            from .sparse_sweep import solve_sparse

            model = SparseModel(mechanism, compiled=request.compiled)
            return partial(solve_sparse, model, path, request.points, request.bodies, request.order)
    return partial(follow, Route(recent_model(mechanism, request), path))
