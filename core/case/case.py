"""A case: a mechanism, a sweep of one driver, the outputs to compare, and their reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..caches import cache_last
from ..errors import CaseError, unknown
from ..kinematics import places
from ..mechanism.mechanism import Mechanism, Point, extent
from ..mechanism.motions import Absolute, Motion, Path, Ramp, Slowed
from ..trajectory import Array
from .quantity import MARKER as MARKER
from .quantity import ORDERS as ORDERS
from .quantity import Output as Output
from .quantity import Quantity


@dataclass(frozen=True, eq=False)
class Hardpoint:
    """A row of a table of hardpoints. Joints, axes and points follow it, on both sides of an axle.

    Attributes:
        name: as in the table.
        roles: names in the template of the suspension.
        position: x forward, y left and z up of the left wheel's point, or of the mirror image of a
            right one's [m].
        axes: axis among these, and its sign, along each of x, y and z of the table.
        moves: derivatives of the numbers of each following place, see `kinematics.places`, by x, y
            and z of the table [m/m], shape (numbers, 3). They are constant.
        shim: derivatives of toe, camber and, with a steering axis of two points, caster at design
            by x, y and z of the table [rad/m], shape (2 or 3, 3), if the joint is moved and the
            links keep their lengths; None for no such joint.
        no_bump_steer: how far the row moves along x, y or z of the table alone to leave no bump
            steer at design [m], shape (3,), infinite where that has no effect; None for rows that
            are not an end of a tie rod.
    """

    name: str
    roles: tuple[str, ...]
    position: tuple[float, float, float]
    axes: Sequence[tuple[int, float]]
    moves: Mapping[str, Array]
    shim: Array | None = None
    no_bump_steer: Array | None = None


SLOW = 2.0**60
"""Seconds of a path at rest for each second of its motions."""

TIME = "time"
"""Name of the driver in a sweep of time."""

PER_TRAVEL = ".per_travel"
"""Suffix of derivatives by wheel travel, which the case reader adds to the outputs."""


HELD_BUT = "held_but"
"""Fact of an output that is differentiated by some drivers while others are held: their names."""

NO_SIZE = 1e-3
"""Size of a mechanism whose points all coincide within rounding [m]."""
_COINCIDE = 1e-12


class Truth(StrEnum):
    """Kind of the reference of a case. Only the first two count as validation."""

    CLOSED_FORM = "closed_form"
    THIRD_PARTY_DATA = "third_party_data"
    IN_HOUSE_ORACLE = "in_house_oracle"
    CONSENSUS_ONLY = "consensus_only"

    @property
    def validates(self) -> bool:
        """Whether agreement with the reference counts as validation."""
        return self in (Truth.CLOSED_FORM, Truth.THIRD_PARTY_DATA)


@dataclass(frozen=True, eq=False)
class Sweep:
    """One driver moved over a grid of values at a constant rate, or time. Other drivers follow
    their own motions or hold.

    Attributes:
        driver: name of the swept driver, or "time" if drivers only follow their motions.
        values: driver values in the order start..stop [m or rad], or times [s], shape (n,).
        rate: driver units per second, constant; velocities and accelerations are per second at it.
            Zero is rest at every sample: forces are static, and times are those of rate one.
        design: driver value at the design position [m or rad]; zero unless its values are absolute.
        motions: motions of the other drivers, from their design values. Time is zero at the design
            value of the swept driver, which moves at the rate.
    """

    driver: str
    values: Array
    rate: float = 1.0
    design: float = 0.0
    motions: Mapping[str, Motion] = field(default_factory=dict[str, Motion])

    @property
    def change(self) -> Array:
        """Driver values relative to the design position, shape (n,), as engines set them."""
        return self.values - self.design

    @property
    def static(self) -> bool:
        """Whether the mechanism is at rest at every sample."""
        return self.rate == 0.0

    @property
    def pace(self) -> float:
        """Rate of the path: so slow for rest, that no inertia and no damper shows in a double."""
        return self.rate or 1.0 / SLOW

    @cached_property
    def path(self) -> Path:
        """Motions of all moving drivers over time, and the times of the samples."""
        motions: Mapping[str, Motion] = self.motions
        if self.static:
            motions = {name: Slowed(motion, SLOW) for name, motion in motions.items()}
        design = {
            name: motion.design
            for name, motion in self.motions.items()
            if isinstance(motion, Absolute)
        }
        if self.driver == TIME:
            return Path(motions, self.values * (SLOW if self.static else 1.0), design)
        moved = {self.driver: Ramp(self.pace), **motions}
        return Path(moved, self.change / self.pace, {self.driver: self.design, **design})

    @property
    def moved(self) -> dict[str, Array]:
        """Swept values [m, rad or s], then values of each further moving driver [m or rad], at the
        samples, shape (n,) each.
        """
        path = self.path
        further = {
            name: path.design.get(name, 0.0) + path.motions[name].at(path.times)[0]
            for name in self.motions
        }
        return {self.driver: self.values, **further}


@dataclass(frozen=True, eq=False)
class Series:
    """One output over the samples: value [unit], and time derivatives if known, each of shape (n,).

    Attributes:
        reason: why solved samples have no value; empty if they have, or for another reason.
        uncertainty: of a reference: half-width of the interval around each value, by quantity
            [unit, unit/s, unit/s^2], of shape (n,); none for exact ones.
        possible: whether the engine returns the inputs of the value; an output that is a derivative
            needs velocities.
    """

    position: Array
    velocity: Array | None = None
    acceleration: Array | None = None
    uncertainty: Mapping[str, Array] = field(default_factory=dict[str, Array], kw_only=True)
    possible: bool = field(default=True, kw_only=True)
    reason: str = field(default="", kw_only=True)


@dataclass(frozen=True)
class Origin:
    """Source of the reference of a case.

    Attributes:
        citation: author, title, page or address; empty if unknown.
        file: name of the file of the reference; empty without a file.
        sha256: digest of that file.
        own: whether kincheck computed the reference.
        by_option: whether --reference gave it, and not [reference] of a case file.
        units: units of its columns, by name: the driver, then outputs.
        signs: sign convention of its outputs; empty if only the case's own axes apply.
        grid: places of its values, if not the samples of the sweep.
        limits: by output, the known error of its values, and its cause; none for exact ones.
    """

    citation: str
    file: str = ""
    sha256: str = ""
    own: bool = False
    by_option: bool = False
    units: Mapping[str, str] = field(default_factory=dict[str, str])
    signs: str = ""
    grid: str = ""
    limits: Mapping[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True)
class Closure:
    """The tolerance within which redundant rows of a case are left out; its mechanism has them.

    Attributes:
        tolerance: of closure [m].
        carrying: joints that were to keep all their rows.
        note: on the joints, and on the residual that they keep; one of `assembly`.
    """

    tolerance: float
    carrying: tuple[str, ...]
    note: str


@dataclass(frozen=True, eq=False)
class Balance:
    """Samples that are equilibria: the drivers of the case hold, all other motions are free.

    Attributes:
        places: points of further loads.
        loads: force and torque at each place by its name [N, N m], shape (n, 6).
    """

    places: tuple[Point, ...] = ()
    loads: Mapping[str, Array] = field(default_factory=dict[str, Array])


@dataclass(frozen=True, eq=False)
class Case:
    """The input of engines, and of the harness that judges their results, in SI units.

    Attributes:
        truth: kind of the reference; consensus_only without one.
        reference: true values by output name, on the grid of the sweep.
        origin: source of the reference; None for the source of the case itself.
        length_unit, angle_unit: units of the file of the case, by their names in `units`.
        assembly: notes on how the start was closed, and on rows left out.
        closure: of rows left out; None if all rows hold.
        hardpoints: rows of the table of hardpoints that the case is of; empty for another file.
        wheels: each `Vehicle` of [suspension], whether outputs read it or not.
        unforced: drivers without a force, which only follow a recording.
        tables: what tables of extensions say beyond that, by key; see `io.sections`.
        balance: None unless its samples are equilibria.
        ranges: of joints of a model with a lower and an upper limit, by joint and freedom, from
            the model's zero [m or rad].
        formerly: earlier names, whose history the case goes on with.
    """

    name: str
    source: str
    truth: Truth
    mechanism: Mechanism
    sweep: Sweep
    outputs: tuple[Quantity, ...]
    reference: Mapping[str, Series] = field(default_factory=dict[str, Series])
    origin: Origin | None = None
    length_unit: str = "m"
    angle_unit: str = "rad"
    assembly: tuple[str, ...] = ()
    closure: Closure | None = None
    hardpoints: tuple[Hardpoint, ...] = ()
    wheels: tuple[Any, ...] = ()
    unforced: tuple[str, ...] = ()
    tables: Mapping[str, Any] = field(default_factory=dict[str, Any])
    balance: Balance | None = None
    ranges: Mapping[tuple[str, str], tuple[float, float]] = field(
        default_factory=dict[tuple[str, str], tuple[float, float]]
    )
    formerly: tuple[str, ...] = ()

    def __repr__(self) -> str:
        """Return name, truth, sweep and outputs in one line."""
        values = self.sweep.values
        return (
            f"<Case: {self.name} ({self.truth.replace('_', ' ')}); {len(values)} samples of"
            f" {self.sweep.driver}, {values[0]:g} to {values[-1]:g}; outputs:"
            f" {', '.join(output.name for output in self.outputs) or 'none'}>"
        )

    def _repr_html_(self) -> str:
        """Return the case and its design position for a notebook."""
        return self.mechanism.to_html(repr(self))

    def geometry(self, offsets: Mapping[str, ArrayLike]) -> dict[str, Array]:
        """Return the places of the geometry in designs with moved hardpoints, for `solve_designs`.

        Args:
            offsets: by row of the table of hardpoints, along its axes [m], shape (designs, 3).

        Raises:
            CaseError: there is no such row.
        """
        rows = {each.name: each for each in self.hardpoints}
        found = dict[str, Array]()
        values = places(self.mechanism)
        for name, given in offsets.items():
            if name not in rows:
                raise CaseError(unknown("row of a table of hardpoints", name, rows))
            moved = np.asarray(given, dtype=np.float64)
            for place, slopes in rows[name].moves.items():
                found[place] = found.get(place, np.array(values[place])) + moved @ slopes.T
        return found

    @cached_property
    def points(self) -> tuple[str, ...]:
        """Names of the points that outputs read; no other motion is needed."""
        return tuple(dict.fromkeys(point for output in self.outputs for point in output.points))

    @cached_property
    def forces(self) -> tuple[str, ...]:
        """Names of the joints, drivers and force elements whose forces outputs read."""
        return tuple(dict.fromkeys(name for output in self.outputs for name in output.forces))

    @property
    def signs(self) -> str:
        """Sign conventions of the outputs in words, for the head of each table, or empty."""
        return "; ".join(dict.fromkeys(output.signs for output in self.outputs if output.signs))


@cache_last(8)
def size(case: Case) -> float:
    """Return the largest extent along a global axis of joints and compared points at design, or the
    largest displacement of a driver [m].

    All points count if nothing is compared yet.
    """
    path = case.sweep.path
    values, _, _ = path.drive(list(path.motions), path.times)
    named = [p.name for p in case.mechanism.points if not p.name.startswith(MARKER)]
    compared = [name for name in case.points if not name.startswith(MARKER)] or named
    points = [case.mechanism.point(name).position for name in compared]
    points += [position for joint in case.mechanism.joints for position in joint.points_on()]
    shifts = values[~turning_drivers(case)]
    shift = float((shifts.max(axis=1) - shifts.min(axis=1)).max(initial=0.0))
    largest = max(extent(points), shift)
    return largest if largest > _COINCIDE * float(np.abs(points).max()) else NO_SIZE


def turning_drivers(case: Case) -> NDArray[np.bool_]:
    """Return whether each moving driver turns, shape (drivers,)."""
    return np.array(
        [case.mechanism.driver(name).turns for name in case.sweep.path.motions], dtype=np.bool_
    )


@cache_last(8)
def pace(case: Case) -> float:
    """Return the pace of the mechanism [1/s]: the largest rate of a driver over a radian,
    or over the mechanism's size; see `harness.compare`."""
    path, turns = case.sweep.path, turning_drivers(case)
    _, rates, seconds = path.drive(list(path.motions), path.times)
    extent = np.where(turns, 1.0, size(case))
    rate, second = (np.abs(each).max(axis=1) for each in (rates, seconds))
    return float(np.maximum(rate / extent, np.sqrt(second / extent)).max(initial=0.0))


def without_forces(case: Case) -> Case:
    """Return the case with its outputs of motion only."""
    return replace(case, outputs=tuple(output for output in case.outputs if not output.forces))
