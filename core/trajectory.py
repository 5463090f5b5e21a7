"""Result of a case from any engine: the motion of points over the samples of a sweep."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from .dataset import AXIS, Dataset, Variable
from .driving import Driving, in_words
from .errors import MARKER as MARKER
from .errors import UnknownNameError, number_of
from .failures import FailureKind
from .forces import Forces
from .tabular import Tabular

Array: TypeAlias = NDArray[np.float64]

QUANTITIES = ("position", "velocity", "acceleration")
"""Quantities of a motion: each is the rate of the one before."""
PER_TIME = ("", "/s", "/s^2")
"""Suffixes of their units."""


@dataclass(frozen=True, eq=False)
class PointMotion:
    """Motion of one point over n samples, global axes.

    Attributes:
        position: [m], shape (n, 3); NaN at unreached samples.
        velocity: [m/s], shape (n, 3), or None if the engine has none.
        acceleration: [m/s^2], shape (n, 3), or None if the engine has none.
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
        if name not in self._columns:
            raise UnknownNameError("motion", name, self._columns)
        table = self._table
        return self._kind(
            *(None if each is None else table[:, each] for each in self._columns[name])
        )

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Trajectory(Tabular):
    """The motion of all wanted points over the samples of a sweep, in the order of the sweep.

    Attributes:
        points: motion by point name.
        solved: whether each sample was reached, shape (n,).
        iterations: Newton iterations of each sample, shape (n,).
        residual: the engine's own largest constraint residual over the solved samples [m or -]; NaN
            if there are none.
        message: empty, or why samples are missing: the finding, the place and the remedy.
        details: further facts worth a place in the record (rank, rows, degrees of freedom, ...).
        bodies: motion by body name, of all moving bodies or of none; it must keep the constraints.
        forces: reactions and efforts, if requested and given by the engine.
        driven_by: gives `drive`; None if the engine does not tell it.
        failures: kinds of the failures in the message, each once.
    """

    points: Mapping[str, PointMotion]
    solved: NDArray[np.bool_]
    iterations: NDArray[np.int64]
    residual: float
    message: str
    details: Mapping[str, Any]
    bodies: Mapping[str, BodyMotion]
    forces: Forces | None
    driven_by: Callable[[], Driving] | None
    failures: Sequence[FailureKind]

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
        driven_by: Callable[[], Driving] | None = None,
        failures: Sequence[FailureKind] = (),
    ) -> None:
        known = self.__dict__
        known["points"], known["solved"], known["iterations"] = points, solved, iterations
        known["residual"], known["message"] = residual, message
        known["details"] = {} if details is None else details
        known["bodies"] = {} if bodies is None else bodies
        known["forces"] = forces
        known["driven_by"] = driven_by
        known["failures"] = tuple(dict.fromkeys(failures)) if failures else ()

    def along(self, driven_by: Callable[[], Driving]) -> Trajectory:
        """Return the trajectory with its drivers."""
        found = object.__new__(Trajectory)
        found.__dict__.update(self.__dict__, driven_by=driven_by)
        return found

    @cached_property
    def drive(self) -> Driving | None:
        """Driver values and times; computed on use, because a sweep takes microseconds."""
        return None if self.driven_by is None else self.driven_by()

    @property
    def facts(self) -> Mapping[str, Any]:
        """The details, and the facts of the forces if there are any."""
        return (
            self.details
            if self.forces is None
            else {"forces": self.forces.account(), **self.details}
        )

    def summary(self) -> str:
        """Return the driver's range, the samples and points, and why samples are missing."""
        count, reached = len(self.solved), int(self.solved.sum())
        samples = number_of(count, "sample")
        samples = samples if reached == count else f"{reached} of {samples}"
        points = f"points {', '.join(shown(self.points)) or 'none'}"
        found = [in_words(self.drive), samples, points, f"residual {self.residual:.1e}"]
        return ", ".join(filter(None, [*found, self.message]))

    def dataset(self) -> Dataset:
        """Return the motion of the points over drivers and time."""
        coords, variables, x = as_variables(self.points, ("sample",), self.drive)
        variables["solved"] = Variable("sample", self.solved)
        variables["iterations"] = Variable("sample", self.iterations)
        return Dataset(("sample",), coords, variables, x)


def largest_found(values: Array) -> float:
    """Return the largest value over solved samples, or NaN if there are none: zero would claim
    success.
    """
    return float(values.max()) if values.size else math.nan


def shown(points: Iterable[str]) -> list[str]:
    """Return the names of points without those that outputs add to a mechanism."""
    return [name for name in points if not name.startswith(MARKER)]


def as_variables(
    points: Mapping[str, PointMotion], dims: tuple[str, ...], drive: Driving | None
) -> tuple[dict[str, Variable], dict[str, Variable], str]:
    """Return coordinates and variables of the motion of points, and the coordinate of the axis of
    curves, by its name.

    Args:
        dims: of the samples, the last one "sample".
    """
    along = {} if drive is None else drive.coords()
    count = next((each.position.shape[-2] for each in points.values()), 0)
    points = {name: points[name] for name in shown(points)}
    axes = {"point": Variable("point", [*points]), "axis": AXIS}
    variables = dict[str, Variable]()
    for quantity, per_time in zip(QUANTITIES, PER_TIME, strict=True):
        series = [getattr(each, quantity) for each in points.values()]
        if series and all(each is not None for each in series):
            stacked = np.stack(series, axis=-2)
            variables[quantity] = Variable((*dims, "point", "axis"), stacked, f"m{per_time}")
    numbered = {} if along else {"sample": Variable("sample", np.arange(count))}
    return {**along, **numbered, **axes}, variables, next(iter(along), "sample")
