"""Make a mechanism ready for its motion along a path: its size decides on the blocks.

It is one program, components one after the other, or one sparse system.

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

from collections.abc import Callable, Sequence
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING

from ..caches import cache_last
from ..errors import SolveError
from ..failures import FailureKind
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from ..trajectory import Trajectory
from .compiled.compiled_model import is_known
from .compiled.request import Request
from .compiled.routes import recent_route
from .continuation.sweep import follow
from .formulation.constraints import Style, frames
from .structure.degrees_of_freedom import require_driven

if TYPE_CHECKING:
    from ..extensions.blocks.component_lanes import ComponentLanes
    from ..extensions.blocks.sparse_lanes import SparseLanes

Solver = Callable[[float], Trajectory]
"""Solves what it was made for, to a tolerance."""


# Moving bodies up to which one program is made ready in a second, and as fast as components before
# it is compiled. Larger rings are so near to singular that the estimate of sigma by one program
# leaves all their samples in doubt.
ONE_PROGRAM = 40
# Moving bodies of a component up to which it is made ready in a third of a second.
COMPONENT = 20


def in_blocks(mechanism: Mechanism, request: Request) -> bool:
    """Return whether a mechanism is too large for one program."""
    return len(mechanism.moving) > ONE_PROGRAM and request.style is Style.NATIVE


def prepare_motion(mechanism: Mechanism, request: Request, path: Path) -> Solver:
    """Make a mechanism ready for its motion along a path; the request wants no forces.

    Raises:
        SolveError: see `prepare`.
    """
    if not in_blocks(mechanism, request):
        return partial(follow, recent_route(mechanism, request, path))
    return _recent_blocks(mechanism, request)(path)


def by_blocks(
    mechanism: Mechanism, request: Request, *, by_components: bool | None = None
) -> Callable[[Path], Solver]:
    """Return a solver by components, or by a sparse system; the size of the components decides,
    unless it is given.
    """
    # few mechanisms are so large: the others need not wait for the import
    from ..extensions.blocks.sparse_lanes import SparseLanes
    from ..extensions.blocks.sweep import BlockSweep
    from .structure.components import components

    parts = None
    if by_components is None:
        try:
            # couplers tie components together
            parts = [] if mechanism.couplers else components(mechanism, frames(mechanism))
        except SolveError:
            require_driven(mechanism)  # which names what can still move
            raise
        by_components = 0 < max(map(len, parts), default=0) <= COMPONENT
    lanes = _lanes(mechanism, request, parts) if by_components else SparseLanes(mechanism, request)

    @cache_last(1, when=attrgetter("is_builtin"))
    def prepare(path: Path) -> Solver:
        return BlockSweep(lanes, path).solve

    return prepare


def _lanes(
    mechanism: Mechanism, request: Request, parts: Sequence[tuple[str, ...]] | None
) -> ComponentLanes | SparseLanes:
    """Return the lanes of the components, or of a sparse system if one of them lacks rows.

    Redundant rows may be matched with its unknowns, and the rows it needs with those of others.
    """
    from ..extensions.blocks.component_lanes import ComponentLanes
    from ..extensions.blocks.sparse_lanes import SparseLanes

    try:
        return ComponentLanes(mechanism, request, parts)
    except SolveError as error:
        if error.kind is not FailureKind.LOCKED or parts is None:
            raise
        try:
            return SparseLanes(mechanism, request)
        except SolveError:
            raise error from None


# One only, and of its paths the last: they fill much of the memory. A thread solves it in place.
_recent_blocks = cache_last(1, per_thread=True, when=is_known)(by_blocks)
