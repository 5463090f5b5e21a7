"""Rows of the table of solved samples: the motions asked for, then the tests of the solution."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ...program import ITERATIONS, MARGIN
from ...trajectory import QUANTITIES
from .request import (
    LARGEST_SIGMA,
    ORIENTATION,
    PREDICTED,
    RATE,
    RATE_T,
    SIGMA,
    Request,
    remembered,
)

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
moment. Those of drivers and joints repeat for each undetermined direction.
"""
POWER, REDUNDANT = "power", "redundant"
"""The vectors of the sum of the powers and the largest of them; and of the products of the
undetermined directions with the multipliers and, upper triangle by rows, with each other.
"""
FORCE_SIGMA = "force sigma"
"""The vector of the estimate of the smallest singular value of the rows that forces are solved by,
where the motion is solved by others.
"""


def kept_forces(vectors: Iterable[str]) -> list[str]:
    """Return the names of the vectors of forces, of all vectors."""
    prefixes, whole = (EFFORT, ELEMENT, REACTION), (POWER, REDUNDANT, FORCE_SIGMA)
    return [name for name in vectors if name.startswith(prefixes) or name in whole]


def kept_motions(request: Request, state: Iterable[str]) -> list[str]:
    """Return the names of the vectors asked for, those of one motion side by side.

    Args:
        state: names of the vectors of the state.
    """
    order, names = request.order + 1, [*state]
    found = [*names, *(PREDICTED + name for name in names), RATE, RATE_T] if request.state else []
    found += [f"{label} {name}" for name in request.points for label in QUANTITIES[:order]]
    labels = (("r",), ("p",), ("rdot", "omega"), ("rddot", "omega_t"))[: order + 1]
    return found + [
        f"{label} {name}" for name in request.bodies for group in labels for label in group
    ]


def kept_tests(request: Request, blocks: int) -> Sequence[str]:
    """Return the names of the tests kept of a sample, for this number of blocks of the rows."""
    # a part of a large mechanism: the cause of a failure, and the criteria of the next sample
    if request.state:
        return ("closure", *remembered(blocks))
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


def rows_of_points(request: Request, rows: Mapping[str, slice]) -> dict[str, list[slice | None]]:
    """Return by point the rows of position, velocity and acceleration; None for an absent one."""
    return {name: [rows.get(f"{label} {name}") for label in QUANTITIES] for name in request.points}


def rows_of_bodies(request: Request, rows: Mapping[str, slice]) -> dict[str, list[slice | None]]:
    """Return by body the rows of r, p, v and a; None for an absent one.

    Rates of translation and of rotation stand side by side.
    """
    pairs = (("r", "r"), ("p", "p"), ("rdot", "omega"), ("rddot", "omega_t"))

    def rows_between(first: str, last: str) -> slice | None:
        return slice(rows[first].start, rows[last].stop) if first in rows else None

    return {
        name: [rows_between(f"{first} {name}", f"{last} {name}") for first, last in pairs]
        for name in request.bodies
    }
