"""Result of a case from any engine: the motion of points over the samples of a sweep."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]

QUANTITIES = ("position", "velocity", "acceleration")
"""Quantities of a motion: each is the rate of the one before."""
PER_TIME = ("", "/s", "/s^2")
"""Suffixes of their units."""
# The null space of redundant rows is orthonormal to round-off over the smallest singular value,
# which is above 1e-6 in sound linkages. A larger component is real.
DETERMINED = 1e-8


@dataclass(frozen=True, eq=False)
class PointMotion:
    """Motion of one point over n samples, global axes.

    Attributes:
        position: [m], shape (n, 3); NaN at samples that were not reached.
        velocity: [m/s], shape (n, 3), or None where the engine has none.
        acceleration: [m/s^2], shape (n, 3), or None where the engine has none.
    """

    position: Array
    velocity: Array | None
    acceleration: Array | None


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Motion of one body over n samples, in the paper's variables; NaN at samples not reached.

    Attributes:
        r: origin, global [m], shape (n, 3).
        p: Euler parameters e0..e3, body -> global [-], shape (n, 4).
        v: [rdot global [m/s], omega' body frame [rad/s]], shape (n, 6), or None if not requested.
        a: [rddot global [m/s^2], omega'dot body frame [rad/s^2]], shape (n, 6), or None if not
            requested.
    """

    r: Array
    p: Array
    v: Array | None
    a: Array | None


@dataclass(frozen=True, eq=False)
class Reaction:
    """The wrench of a joint over n samples: what its first body exerts on its second, global axes.

    Attributes:
        force: [N], shape (n, 3).
        moment: about the joint's point as carried by the second body [N m], shape (n, 3).
        free: directions of wrenches (force, then moment per unit of length) that redundant rows
            leave undetermined, shape (n, 6, redundant rows).
    """

    force: Array
    moment: Array
    free: Array

    def along(self, direction: Sequence[float] | Array, *, moment: bool = False) -> Array:
        """Return the component of force or moment along a unit direction, shape (n,).

        It is NaN at samples where redundant rows leave it undetermined.
        """
        part = slice(3, 6) if moment else slice(0, 3)
        d = np.asarray(direction, dtype=np.float64)
        loose = np.abs(np.einsum("i,nik->nk", d, self.free[:, part])).max(axis=1, initial=0.0)
        values: Array = (self.moment if moment else self.force) @ d
        return np.where(loose <= DETERMINED, values, np.nan)

    def determined(self) -> tuple[int, int, int]:
        """Return how many directions of force, of moment and of the wrench are determined.

        They are the fewest over the samples, of 3, 3 and 6.
        """
        parts = (slice(0, 3), slice(3, 6), slice(0, 6))
        known = self.free[np.isfinite(self.free).all(axis=(1, 2))]
        loose = [
            int(np.linalg.matrix_rank(known[:, part], tol=DETERMINED).max(initial=0))
            if known.size
            else 0
            for part in parts
        ]
        return 3 - loose[0], 3 - loose[1], 6 - loose[2]


@dataclass(frozen=True, eq=False)
class Forces:
    """Forces over n samples; NaN at samples that were not reached or have none.

    Attributes:
        joints: reaction by joint.
        drivers: effort by driver, [N] or, if it turns, [N m], shape (n,): effort times rate is the
            power that the driver puts in.
        elements: force by force element, shape (n,): tension of a spring-damper [N]; torque of a
            torsional one on the joint's second body [N m]; amount of a force [N] or torque [N m].
        power: of the drivers less the change of energy and the dissipation [W], shape (n,): zero
            but for round-off.
        largest_power: the largest of the powers that are summed [W], shape (n,).
        message: empty, or why forces are missing.
    """

    joints: Mapping[str, Reaction]
    drivers: Mapping[str, Array]
    elements: Mapping[str, Array]
    power: Array
    largest_power: Array
    message: str = ""


_Motion = TypeVar("_Motion", PointMotion, BodyMotion)


class Motions(Mapping[str, _Motion], Generic[_Motion]):
    """Motions by name, as views of one table, each created on access: a sweep pays only for those
    in use.

    Args:
        kind: makes a motion of its arrays.
        table: shape (n, columns).
        columns: by name, those of each array; None if there is none.
    """

    def __init__(
        self,
        kind: Callable[..., _Motion],
        table: Array,
        columns: Mapping[str, Sequence[slice | None]],
    ) -> None:
        self._kind, self._table, self._columns = kind, table, columns

    def __getitem__(self, name: str) -> _Motion:
        table = self._table
        return self._kind(
            *(None if each is None else table[:, each] for each in self._columns[name])
        )

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)


@dataclass(frozen=True, eq=False, init=False)
class Trajectory:
    """The motion of all wanted points over the samples of a sweep, in the order of the sweep.

    Attributes:
        points: motion by point name.
        solved: whether each sample was reached, shape (n,).
        iterations: Newton iterations of each sample, shape (n,).
        residual: the engine's own largest constraint residual over the solved samples [m or -]; NaN
            where there are none.
        message: empty, or why samples are missing: what was found, where, and what to do.
        details: further facts worth a place in the record (rank, rows, degrees of freedom, ...).
        bodies: motion by body name, for engines and requests that give it.
        forces: reactions and efforts, for engines and requests that give them.
    """

    points: Mapping[str, PointMotion]
    solved: NDArray[np.bool_]
    iterations: NDArray[np.int64]
    residual: float
    message: str
    details: Mapping[str, Any]
    bodies: Mapping[str, BodyMotion]
    forces: Forces | None

    def __init__(  # a frozen dataclass sets its fields by calls, which takes 3 us of a sweep's 25
        self,
        points: Mapping[str, PointMotion],
        solved: NDArray[np.bool_],
        iterations: NDArray[np.int64],
        residual: float,
        message: str = "",
        details: Mapping[str, Any] | None = None,
        bodies: Mapping[str, BodyMotion] | None = None,
        forces: Forces | None = None,
    ) -> None:
        known = self.__dict__
        known["points"], known["solved"], known["iterations"] = points, solved, iterations
        known["residual"], known["message"] = residual, message
        known["details"] = {} if details is None else details
        known["bodies"] = {} if bodies is None else bodies
        known["forces"] = forces


def largest_found(values: Array) -> float:
    """Return the largest value over solved samples, or NaN if there are none: zero would claim
    success.
    """
    return float(values.max()) if values.size else math.nan
