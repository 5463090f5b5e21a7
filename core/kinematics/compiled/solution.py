"""Solutions: the table of solved samples as a trajectory, for every way of solving."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...failures import FailureKind
from ...forces import Forces
from ...trajectory import Array, BodyMotion, Motions, PointMotion, Trajectory
from .request import Request
from .sample_rows import kept_motions, row_ranges, rows_of_bodies, rows_of_points

_Columns = Mapping[str, Sequence[slice | None]]


@dataclass(frozen=True, eq=False)
class Columns:
    """Columns of the table of samples.

    Attributes:
        count: number of the columns that hold motions.
        by_vector: columns of each vector.
        points: by point, columns of position, velocity and acceleration; None for an absent one.
        bodies: by body, columns of r, p, v and a; None for an absent one.
    """

    count: int
    by_vector: Mapping[str, slice]
    points: _Columns
    bodies: _Columns

    @staticmethod
    def of(request: Request) -> Columns:
        """Return the columns of the motions of a request, side by side."""
        names = kept_motions(request, ())
        sizes = {name: 4 if name.startswith("p ") else 3 for name in names}
        found = row_ranges(sizes, ())
        points, bodies = rows_of_points(request, found), rows_of_bodies(request, found)
        return Columns(sum(sizes.values()), found, points, bodies)


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
