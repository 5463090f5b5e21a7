"""What a sweep is asked for, and how the slots of its lanes are named."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from ..forces.wanted import WantedForces
from ..formulation.constraints import Style

# Newton is quadratic: an iteration that starts from a residual below this ends at round-off (1e-16
# times the condition), where sigma is at least `FIRM`; where it is less, from a residual below as
# many times less.
LAST_ITERATION, FIRM = 1e-9, 1.0 / 16.0
MAX_ITERATIONS = 12


@dataclass(frozen=True)
class Request:
    """What a sweep is to give.

    Attributes:
        drivers: names of the drivers that move; the others hold their design value, and cost
            nothing.
        points, bodies: names whose motion is wanted.
        order: 0 positions, 1 and velocities, 2 and accelerations.
        style: how the rows are written.
        compiled: run by machine code where llvmlite is installed, else by numpy; the same results
            to round-off.
        state: keep the whole state of every sample, and its rates.
        varied: places of the geometry (see `places`) that are inputs of the programs; all others
            are constants in them.
        last_iteration: of a sample, the one that starts from a residual below this [units of the
            mechanism's size]; a sparse system iterates as long as it gains by it.
        rows: of the formulation, which are solved; those that are independent at the design
            position unless given.
        forces: what forces are wanted; they take order 2.
    """

    drivers: tuple[str, ...]
    points: tuple[str, ...]
    bodies: tuple[str, ...] = ()
    order: int = 2
    style: Style = Style.NATIVE
    compiled: bool = True
    state: bool = False
    varied: tuple[str, ...] = ()
    last_iteration: float = LAST_ITERATION
    rows: tuple[int, ...] = ()
    forces: WantedForces | None = None


RATE, RATE_T = "rate", "rate_t"
"""The vectors that hold the rates and accelerations of the unknowns."""
TIME = "time"
PRESCRIBED = {"u": 3, "q": 4, "v": 3, "w": 3, "v_t": 3, "w_t": 3}
"""The vectors that tell how a prescribed body moves, and how many numbers each has [units and
seconds].
"""
FROM, EARLIER = "from ", "earlier "
"""Before the names of what a lane is predicted from, and of what that was predicted from."""
PREDICTED = "predicted "
"""Before the names of the state that a lane was predicted to have."""
BLOCKS = "", PREDICTED, FROM
"""The states whose vectors stand one after the other in a lane, each in a block of its own: they
are compared slot by slot.
"""

SIGMA, ORIENTATION = "sigma", "orientation"
"""The slots of an estimate of the smallest singular value of the rows, and of the signs of their
determinants (`Elimination`).
"""
LARGEST_SIGMA = "largest sigma"
"""The slot of the largest that estimate has been so far: the scale on which it is small."""
SLOPE = "slope"
"""The slot of how steeply that estimate changes, by what the pose does; zero where nothing is known
of that.
"""


def by_block(label: str, blocks: int) -> Sequence[str]:
    """The slots of the estimate, or of its slope, of each block of the rows
    (`Elimination.sigmas`).
    """
    return [label] if blocks == 1 else [f"{label} {k}" for k in range(blocks)]


def remembered(blocks: int) -> Sequence[str]:
    """The slots that tests know of what a lane is predicted from, where the rows fall into so many
    blocks.
    """
    return [
        *dict.fromkeys(
            (SIGMA, ORIENTATION, LARGEST_SIGMA, *by_block(SIGMA, blocks), *by_block(SLOPE, blocks))
        )
    ]


ACCEPT = ("tolerance", "consistent", "crossing")
"""The slots that a lane is accepted by."""
# Redundant rows may be violated by this much [units of the mechanism's size]: hardpoint tables
# carry at most about nine digits.
CONSISTENT = 1e-9
# More than any difference of orientations, which have `elimination.DIGITS` binary digits.
CROSSING = 1e18


@lru_cache
def accept_by(tol: float, *, crossing: bool = False) -> Mapping[str, float]:
    """The numbers of `ACCEPT`: the largest residual of rows, that of redundant rows, and whether a
    singular pose may be crossed.

    The last is more than all that the tests of sigma and of orientation can lack to be accepted.
    """
    return dict(
        zip(ACCEPT, (tol, max(CONSISTENT, tol), CROSSING if crossing else 0.0), strict=True)
    )


def slots_of(vectors: Mapping[str, Sequence[int]], names: Iterable[str]) -> list[int]:
    """Return the slots of the named vectors, one after the other."""
    return [slot for name in names for slot in vectors[name]]


class Layout:
    """Where everything stands in a lane: slots are numbered as they are first asked for."""

    def __init__(self) -> None:
        self.slots: dict[str, int] = {}
        self.vectors: dict[str, list[int]] = {}

    def scalar(self, name: str) -> int:
        """The slot of a scalar."""
        return self.slots.setdefault(name, len(self.slots))

    def vector(self, name: str, count: int = 3) -> list[int]:
        """The slots of a vector's components."""
        return self.vectors.setdefault(name, [self.scalar(f"{name}.{k}") for k in range(count)])
