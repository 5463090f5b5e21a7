"""Solutions: the table of solved samples as a trajectory, for every way of solving, with its forces
as views, each computed when it is read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...failures import FailureKind
from ...forces import Forces, Reaction
from ...trajectory import Array, BodyMotion, Motions, PointMotion, Trajectory
from ..forces.wanted import WantedForces
from .request import (
    EFFORT,
    ELEMENT,
    FORCE_SIGMA,
    POWER,
    REACTION,
    Request,
    kept_motions,
    row_ranges,
    rows_of_motions,
)

_Columns = Mapping[str, Sequence[slice | None]]


class Columns:
    """Columns of the table of samples for the motions of a request, side by side.

    Attributes:
        count: number of the columns that hold motions.
        by_vector: columns of each vector.
        points: by point, columns of position, velocity and acceleration; None for an absent one.
        bodies: by body, columns of r, p, v and a; None for an absent one.
    """

    def __init__(self, request: Request) -> None:
        names = kept_motions(request, ())
        sizes = {name: 4 if name.startswith("p ") else 3 for name in names}
        self.count, self.by_vector = sum(sizes.values()), row_ranges(sizes, ())
        self.points, self.bodies = rows_of_motions(request, self.by_vector)


def solution(
    table: Array,
    points: _Columns,
    bodies: _Columns,
    *,
    unit: float,
    solved: NDArray[np.bool_],
    iterations: Array,
    closure: float,
    leftover: float,
    message: str,
    failures: Sequence[FailureKind],
    account: Mapping[str, Any],
    findings: Mapping[str, Any],
    forces: Forces | None = None,
) -> Trajectory:
    """Return the trajectory of a table of samples.

    Args:
        table: motions, shape (n, columns); NaN at samples that were not reached.
        points, bodies: see `Columns`.
        unit: length unit of the residuals [m].
        solved: whether each sample was reached, shape (n,).
        iterations: Newton iterations of each sample, shape (n,); any value where it was not
            reached.
        closure, leftover: largest residual of the solved and of the redundant rows [units]; NaN
            without solved samples.
        message, failures, forces: see `Trajectory`.
        account, findings: details of the model and of this solution.
    """
    return Trajectory(
        points=Motions(PointMotion, table, points),
        solved=solved,
        iterations=(np.where(solved, iterations, 0.0) if message else iterations).astype(np.int64),
        residual=closure * unit,
        message=message,
        details={**account, "redundant_residual": leftover * unit, **findings},
        bodies=Motions(BodyMotion, table, bodies),
        forces=forces,
        failures=failures,
    )


# Where the estimate of the smallest singular value is above this, the pose is far from singular in
# the sense of forces, which is a billionth of the largest singular value, and no digits are
# multiplied by `AMPLIFIED`: rows are of size one.
REGULAR = 1e-4
# Rows that are chosen of more may be nearly singular where all of them are not: those that are not
# lose no more than three digits.
WELL_CHOSEN = 1e-3

_Value = TypeVar("_Value")


class _Read(Mapping[str, _Value]):
    """Values by name, each computed on access: a sweep pays only for those in use."""

    def __init__(self, names: tuple[str, ...], read: Callable[[str], _Value]) -> None:
        self._names, self._read = names, read

    def __getitem__(self, name: str) -> _Value:
        if name not in self._names:
            raise KeyError(name)
        return self._read(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


class ForceTable:
    """The forces of a model in its table of solved samples.

    Args:
        rows: columns of the table by the name of a vector.
        redundant: number of redundant rows.

    Attributes:
        least: where the estimate of the smallest singular value is above it, the pose is far from
            singular.
    """

    def __init__(self, wanted: WantedForces, rows: Mapping[str, slice], redundant: int) -> None:
        self.wanted, self.rows, self.redundant = wanted, rows, redundant
        self._power = rows[POWER].start
        self.least = WELL_CHOSEN if redundant else REGULAR

    def read(self, table: Array, sigma: float) -> Forces | None:
        """Return the forces of a table, shape (n, columns), with its NaN; None near a singular
        pose, to be decided by singular values.

        Args:
            sigma: smallest estimate, over the sweep, of the smallest singular value of the solved
                rows.
        """
        if FORCE_SIGMA in self.rows:
            own = table[:, self.rows[FORCE_SIGMA]]
            sigma = min(sigma, float(np.fmin.reduce(own, axis=None, initial=np.inf)))
        if not sigma > self.least:
            return None
        return self.of(table)

    def of(self, table: Array) -> Forces:
        """Return the forces of samples that are all far from singular poses; see `read`."""
        samples, wanted = _Samples(self, table), self.wanted
        power, largest = table[:, self._power], table[:, self._power + 1]
        return Forces(
            _Read(wanted.joints, samples.reaction),
            _Read(wanted.drivers, samples.effort),
            _Read(wanted.elements, samples.element),
            power,
            largest,
        )


@dataclass(frozen=True, eq=False)
class _Samples:
    """The forces of the samples in one table."""

    of: ForceTable
    table: Array

    def element(self, name: str) -> Array:
        """Return the amount of a force element, shape (n,)."""
        return self._vector(ELEMENT, name)[:, 0]

    def reaction(self, name: str) -> Reaction:
        """Return the reaction of a joint."""
        values = self._vector(REACTION, name)
        free = values[:, 6:].reshape(len(values), self.of.redundant, 6).swapaxes(1, 2)
        return Reaction(values[:, :3], values[:, 3:6], free)

    def effort(self, name: str) -> Array:
        """Return the effort of a driver, shape (n,)."""
        return self._vector(EFFORT, name)[:, 0]

    def _vector(self, kind: str, name: str) -> Array:
        return self.table[:, self.of.rows[kind + name]]
