"""Make a mechanism ready for its motion along a path: as one program, or by the method of an
extension for large mechanisms.

The solutions and verdicts are the same to round-off. One program costs least for each sample, and
most to trace and compile: its size grows faster than the mechanism.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from functools import partial

from ..doors import offers
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from ..trajectory import Trajectory
from .compiled.request import Request
from .compiled.routes import recent_route
from .continuation.sweep import follow
from .formulation.styles import NATIVE

Solver = Callable[[float], Trajectory]
"""Solves what it was made for, to a tolerance."""


# Moving bodies up to which one program is made ready in a second, and as fast as components before
# it is compiled. Larger rings are so near to singular that the estimate of sigma by one program
# leaves all their samples in doubt.
ONE_PROGRAM = 40


class Method(StrEnum):
    """The system of equations solved at once; the solutions are the same to round-off."""

    BY_SIZE = "by size"
    ONE_PROGRAM = "one program"
    BY_COMPONENTS = "component by component"
    SPARSE = "one sparse system"


def by_method(method: str) -> Callable[[Mechanism, Request], Callable[[Path], Solver]] | None:
    """Return the preparation of large mechanisms for paths; None without its extension."""
    offer = offers("methods").get(method)
    return offer and offer.load()


def in_blocks(mechanism: Mechanism, request: Request) -> bool:
    """Return whether a mechanism is too large for one program, and there is another way."""
    large = len(mechanism.moving) > ONE_PROGRAM and request.style == NATIVE
    return large and by_method(Method.BY_SIZE) is not None


def prepare_motion(mechanism: Mechanism, request: Request, path: Path) -> Solver:
    """Make a mechanism ready for its motion along a path; the request wants no forces.

    Raises:
        SolveError: see `prepare`.
    """
    if in_blocks(mechanism, request) and (prepare := by_method(Method.BY_SIZE)):
        return prepare(mechanism, request)(path)
    return partial(follow, recent_route(mechanism, request, path))
