"""Requests of a sweep, the names of the slots of its lanes, and the rows of the table of solved
samples: the motions asked for, then the tests of the solution.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

from ...algebra import Scalar, Vec3
from ...jet import Jet
from ...program import ITERATIONS, MARGIN, Program, Tape, program
from ...trajectory import QUANTITIES
from ..forces.wanted import WantedForces
from ..formulation.styles import NATIVE

# Newton is quadratic: an iteration that starts from a residual below this ends at round-off (1e-16
# times the condition), where sigma is at least `FIRM`; where it is less, from a residual below as
# many times less.
LAST_ITERATION, FIRM = 1e-9, 1.0 / 16.0
MAX_ITERATIONS = 12


class Equation(Protocol):
    """An output as an equation over the motion of points; see `Quantity` of cases. Equal ones have
    equal equations.
    """

    @property
    def name(self) -> str: ...
    @property
    def points(self) -> tuple[str, ...]: ...

    def terms(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Sequence[Jet]:
        """Return what the output follows from, over scalars of any kind."""
        ...

    def resting(self, at: Mapping[str, Vec3]) -> tuple[Scalar, Scalar] | None:
        """Return squares of two speeds; None for an output without a speed."""
        ...


@dataclass(frozen=True)
class WantedOutput:
    """An output that is part of the programs.

    Attributes:
        derivative: highest wanted time derivative.
        alone: drivers that alone move for it at each sample, at a rate of one; none of them for the
            rates of the motion itself.
        slopes: how many of value, rate and second rate have their slopes by the varied geometry
            wanted.
    """

    equation: Equation
    derivative: int = 0
    alone: tuple[str, ...] = ()
    slopes: int = 0


@dataclass(frozen=True)
class Request:
    """The wanted results of a sweep, and the form of its programs.

    Attributes:
        drivers: names of the moving drivers; the others hold their design value, and cost nothing.
        points, bodies: names of the points and bodies whose motion is wanted.
        order: 0 positions, 1 and velocities, 2 and accelerations.
        style: row style.
        compiled: run by machine code if llvmlite is installed, else by numpy; the results are the
            same to round-off.
        state: keep the whole state of every sample, and its rates.
        varied: varied places of the geometry (see `places`), inputs of the programs; all others are
            constants in them.
        last_iteration: a sample's iteration from a residual below this is its last [units of the
            mechanism's size]; a sparse system iterates as long as it gains by it.
        rows: solved rows of the formulation; by default those independent at the design position.
        forces: wanted forces; they take order 2.
        outputs: wanted outputs; the order is the one that they take.
    """

    drivers: tuple[str, ...]
    points: tuple[str, ...]
    bodies: tuple[str, ...] = ()
    order: int = 2
    style: str = NATIVE
    compiled: bool = True
    state: bool = False
    varied: tuple[str, ...] = ()
    last_iteration: float = LAST_ITERATION
    rows: tuple[int, ...] = ()
    forces: WantedForces | None = None
    outputs: tuple[WantedOutput, ...] = ()

    @property
    def slopes(self) -> bool:
        """Whether slopes of any output are wanted."""
        of_forces = self.forces is not None and self.forces.slopes
        return of_forces or any(each.slopes for each in self.outputs)


RATE, RATE_T, CARRIED = "rate", "rate_t", "carried"
"""The vectors that hold the rates and accelerations of the unknowns, and the multipliers of the
rows.
"""
TIME = "time"
PRESCRIBED = {"u": 3, "q": 4, "v": 3, "w": 3, "v_t": 3, "w_t": 3}
"""The vectors that tell how a prescribed body moves, and how many numbers each has [units and
seconds].
"""
FROM = "from "
"""Before the names of what a lane is predicted from."""
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


def remembered_tests(blocks: int) -> Sequence[str]:
    """Return the slots of tests to remember of the start of a prediction, for this number of blocks
    of the rows.
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
    """Return the numbers of `ACCEPT`: largest residual of solved and of redundant rows, and whether
    to cross singular poses.

    The last one exceeds every possible shortfall of the tests of sigma and of orientation.
    """
    return dict(
        zip(ACCEPT, (tol, max(CONSISTENT, tol), CROSSING if crossing else 0.0), strict=True)
    )


def slots_of(vectors: Mapping[str, Sequence[int]], names: Iterable[str]) -> list[int]:
    """Return the slots of the named vectors, one after the other."""
    return [slot for name in names for slot in vectors[name]]


class Layout:
    """Slots of a lane, numbered in the order of their first request."""

    def __init__(self) -> None:
        self.slots: dict[str, int] = {}
        self.vectors: dict[str, list[int]] = {}

    def scalar(self, name: str) -> int:
        """The slot of a scalar."""
        return self.slots.setdefault(name, len(self.slots))

    def vector(self, name: str, count: int = 3) -> list[int]:
        """The slots of a vector's components."""
        return self.vectors.setdefault(name, [self.scalar(f"{name}.{k}") for k in range(count)])

    def program(self, name: str, tape: Tape, vectors: Mapping[str, Sequence[Scalar]]) -> Program:
        """Return a program of vectors by name."""
        slots = [k for vector, each in vectors.items() for k in self.vector(vector, len(each))]
        values = [x for each in vectors.values() for x in each]
        return program(name, tape, dict(zip(slots, values, strict=True)))


TESTS = ("closure", "leftover", "branch", SIGMA, ORIENTATION, LARGEST_SIGMA, ITERATIONS, MARGIN)
"""Scalars kept of every sample, after the motions."""
TESTS_OF_VARIANTS = ("closure", SIGMA, ITERATIONS)
"""Tests kept of variants: few, because variants are many."""
LARGEST, SMALLEST = ("closure", "leftover"), (SIGMA,)
"""Tests whose worst value over all samples is computed."""
LARGEST_OF_PARTS, SMALLEST_OF_PARTS = (*LARGEST, ITERATIONS), (*SMALLEST, MARGIN)
"""Tests whose worst value over all parts of a sample is computed."""

EFFORT, ELEMENT, REACTION = "effort ", "element ", "reaction "
"""Before the names of vectors of forces: of a driver; of a force element; of a joint, its force and
moment, and again in each undetermined direction.
"""
POWER = "power"
"""The vector of the sum of the powers and the largest of them."""
FORCE_SIGMA = "force sigma"
"""The vector of the estimate of the smallest singular value of the rows that forces are solved by,
where the motion is solved by others.
"""


OUTPUT, RESTING = "output ", "resting "
"""Before the names of vectors of outputs: their terms, by quantity; and two speeds of those that
have no value at rest.
"""
SLOPE_OF, TOWARDS = "slope of ", "towards "
"""Before the names of vectors of slopes: of a vector of an output or of a force; and the motion of
a place.
"""


def kept_outputs(vectors: Iterable[str]) -> list[str]:
    """Return the names of the vectors of outputs, of all vectors."""
    return [name for name in vectors if name.startswith((OUTPUT, RESTING))]


def kept_forces(vectors: Iterable[str]) -> list[str]:
    """Return the names of the vectors of forces, of all vectors."""
    prefixes, whole = (EFFORT, ELEMENT, REACTION), (POWER, FORCE_SIGMA)
    return [name for name in vectors if name.startswith(prefixes) or name in whole]


def kept_motions(request: Request, state: Iterable[str]) -> list[str]:
    """Return the names of the vectors asked for, those of one motion side by side.

    Args:
        state: names of the vectors of the state.
    """
    order, names = request.order + 1, [*state]
    found = [*names, RATE, RATE_T] if request.state else []
    found += names if request.slopes else []  # slopes begin at the solved poses
    found += [f"{label} {name}" for name in request.points for label in QUANTITIES[:order]]
    labels = (("r",), ("p",), ("rdot", "omega"), ("rddot", "omega_t"))[: order + 1]
    return found + [
        f"{label} {name}" for name in request.bodies for group in labels for label in group
    ]


def kept_tests(request: Request, blocks: int) -> Sequence[str]:
    """Return the names of the tests kept of a sample, for this number of blocks of the rows."""
    # a part of a large mechanism: the cause of a failure, and the criteria of the next sample
    if request.state:
        return ("closure", *remembered_tests(blocks))
    return TESTS_OF_VARIANTS if request.varied else TESTS


def row_ranges(motions: Mapping[str, int], tests: Sequence[str]) -> dict[str, slice]:
    """Return the rows of every motion, given by its number of components, and of every test."""
    rows: dict[str, slice] = {}
    row = 0
    for name, count in motions.items():
        rows[name] = slice(row, row := row + count)
    for name in tests:
        rows[name] = slice(row, row := row + 1)
    return rows


def rows_of_motions(
    request: Request, rows: Mapping[str, slice]
) -> tuple[dict[str, list[slice | None]], ...]:
    """Return by point the rows of position, velocity and acceleration, and by body those of r, p, v
    and a; None for an absent one.

    Rates of translation and of rotation stand side by side.
    """
    pairs = (("r", "r"), ("p", "p"), ("rdot", "omega"), ("rddot", "omega_t"))

    def rows_between(first: str, last: str) -> slice | None:
        return slice(rows[first].start, rows[last].stop) if first in rows else None

    points = {
        name: [rows.get(f"{label} {name}") for label in QUANTITIES] for name in request.points
    }
    return points, {
        name: [rows_between(f"{first} {name}", f"{last} {name}") for first, last in pairs]
        for name in request.bodies
    }
