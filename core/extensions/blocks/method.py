"""Choice of the blocks of a mechanism too large for one program: its components one after the
other, or one sparse system.

Components share programs, so a chain of thousands is made ready in seconds. An indivisible
mechanism is a sparse system. Measured on chains of four-bars, one program (first interpreted, and
compiled if it runs often) against components: 21 bodies 2.3 (0.5) and 3.1 us a sample, made ready
in 0.1 and 0.3 s; 41 bodies 4.4 (0.9) and 3.8 us, in 0.3 and 0.3 s. On rings of loops, one program
against a sparse system: 27 bodies 14 and 19 us, 39 bodies 37 and 25 us; the sparse system is made
ready in 0.05 s, and one program compiled in 20 s.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from operator import attrgetter

from ...caches import cache_last
from ...errors import SolveError
from ...failures import FailureKind
from ...kinematics.compiled.compiled_model import is_known
from ...kinematics.compiled.request import Request
from ...kinematics.formulation.constraints import frames
from ...kinematics.motion_solver import Solver
from ...kinematics.structure.degrees_of_freedom import require_driven
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Path
from .component_lanes import ComponentLanes
from .components import components
from .sparse_lanes import SparseLanes
from .sweep import BlockSweep

# Moving bodies of a component up to which it is made ready in a third of a second.
COMPONENT = 20


def by_blocks(
    mechanism: Mechanism, request: Request, *, by_components: bool | None = None
) -> Callable[[Path], Solver]:
    """Return a solver by components, or by a sparse system; the size of the components decides,
    unless it is given.
    """
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
by_size = cache_last(1, per_thread=True, when=is_known)(by_blocks)
by_components = partial(by_blocks, by_components=True)
sparse = partial(by_blocks, by_components=False)
