"""Redundant rows, contradictions and free motions at the design, by name, and joints that
over-constrain; motions in words: how each body moves at given rates of the unknowns, as a turn
about an axis, a screw or a shift.

The rows are those of the native formulation, joints first, then drivers. Lengths are in mechanism
sizes, so that rows of lengths and of angles compare. Contradictions are found by exact rows:
with a residual, simplified rows have another fixed point (formulation section 3).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import repeat

import numpy as np

from ...algebra import Vec3, cross, triple
from ...errors import shortened
from ...kinematics.compiled.request import CONSISTENT
from ...kinematics.formulation.cartesian import Cartesian
from ...kinematics.formulation.constraints import Constraint, Frames, constraints_left_out, frames
from ...kinematics.formulation.formulation import Configuration, State
from ...kinematics.formulation.state_vectors import jacobian
from ...kinematics.structure.degrees_of_freedom import FreedomAccount, account
from ...kinematics.structure.redundancy import (
    DIGITS,
    RANK_TOLERANCE,
    independent_joint_rows,
    independent_rows,
)
from ...mechanism.mechanism import Mechanism, Vector
from ...primitives.base import Twist
from ...trajectory import Array
from ..closing.reduction import parts_of_columns

# Parts of a motion below this share of its largest are left out: round-off of a null vector is far
# below, what moves is above.
STILL = 1e-6
# Components below this [- or m] are printed as zero: they are round-off, of which a reader would
# see a direction askew.
ROUND_OFF = 1e-9


@dataclass(frozen=True)
class Screw:
    """The motion of a body, relative to the fastest body.

    Attributes:
        turn: about the axis [rad], 0 for a pure shift.
        axis: unit vector, global, of the turn, or of the shift without a turn.
        through: a point of the axis, global [m].
        shift: along the axis [m].
    """

    body: str
    turn: float
    axis: Vector
    through: Vector
    shift: float

    def __str__(self) -> str:
        along = _numbers(self.axis)
        if not self.turn:
            return f"{self.body!r} shifts along {along}"
        how = "screws" if self.shift else "turns"
        lead = f", {self.shift / self.turn:.3g} m per rad" if self.shift else ""
        return f"{self.body!r} {how} about {along} through {_numbers(self.through)}{lead}"


def screws(formulation: Cartesian, at: Configuration, frame: Frames, rates: Array) -> list[Screw]:
    """Return the motion of each moving body at the rates of the unknowns, shape (unknowns,), the
    fastest first.

    Rates have either sign: the fastest body's axis points along x, y or z rather than against it.
    """
    twists = formulation.twists(at, rates.tolist())
    speeds = {name: max(_size(twist.v), _size(twist.w)) for name, twist in twists.items()}
    fastest = max(speeds.values(), default=0.0)
    moving = sorted(
        (name for name, speed in speeds.items() if speed > STILL * fastest),
        key=lambda name: -speeds[name],
    )
    if moving:
        first = twists[moving[0]]
        leading = max([*(first.w if _size(first.w) > STILL * fastest else first.v)], key=abs)
        fastest = math.copysign(fastest, leading)
    return [_screw(name, twists[name], at, frame, fastest) for name in moving]


def free_motions(matrix: Array) -> Array:
    """Return a basis of the null space of a matrix, shape (motions, columns), with the fewest
    bodies in each motion.

    The orthonormal basis mixes independent motions; reduced to echelon form, each has a column of
    its own, and a spinning rod spins alone.
    """
    values, basis = np.linalg.svd(matrix, full_matrices=True)[1:]
    rank = int((values > RANK_TOLERANCE * max(1.0, values.max(initial=0.0))).sum())
    left = basis[rank:].copy()
    for k in range(len(left)):
        column = int(np.abs(left[k:]).max(axis=0).argmax())
        row = k + int(np.abs(left[k:, column]).argmax())
        left[[k, row]] = left[[row, k]]
        left[k] /= left[k, column]
        others = np.arange(len(left)) != k
        left[others] -= np.outer(left[others, column], left[k])
    return left


def describe_screws(found: Sequence[Screw], most: int = 4) -> str:
    """The motions of the fastest bodies, in words."""
    return shortened([*map(str, found)], most)


def _screw(name: str, twist: Twist, at: Configuration, frame: Frames, fastest: float) -> Screw:
    v, w = (1.0 / fastest) * twist.v, (1.0 / fastest) * twist.w
    origin = frame.origins[name] + at.poses[name].u
    turn = _size(w)
    if turn <= STILL:
        size = _size(v)
        return Screw(
            name, 0.0, triple((1.0 / size) * v), triple(frame.unit * origin), frame.unit * size
        )
    axis = (1.0 / turn) * w
    foot = origin + (1.0 / (turn * turn)) * cross(w, v)
    along = axis @ v
    return Screw(
        name,
        turn,
        triple(axis),
        triple(frame.unit * foot),
        frame.unit * along if abs(along) > STILL else 0.0,
    )


def _size(a: Vec3) -> float:
    return float(np.linalg.norm([*a]))


def _numbers(a: Sequence[float]) -> str:
    return "(" + ", ".join(f"{x if abs(x) > ROUND_OFF else 0.0:.4g}" for x in a) + ")"


# What a row owes to another below this is round-off of an orthogonalisation.
OWED = 1e-9
# Singular values of sound linkages are above this; below, geometry is nearly redundant, and often
# meant to be so.
NEARLY = 1e-3
# Rows with less than this part of the largest share of a contradiction are not its cause.
SHARE = 0.1
# The way to the pose nearest to an assembly: no step is longer than this [units of the mechanism's
# size, rad], within which rows are near to linear, and there are enough to go around the mechanism
# several times.
STEP, STEPS = 0.1, 200
COMPLEX_STEP = 1e-30
"""Imaginary step for derivatives: its square vanishes beside every number."""


@dataclass(frozen=True)
class NamedRow:
    """A row by name.

    Attributes:
        owner: joint or driver.
        primitive: the condition of the row.
        holds: the prevented motion at the design, on the owner's second body: a shift along, or a
            turn about, a direction.
    """

    owner: str
    primitive: str
    holds: str

    def __str__(self) -> str:
        return f"{self.owner}: {self.primitive} ({self.holds})"


@dataclass(frozen=True)
class Dependency:
    """A redundant row: the sum of the others times their weights.

    Attributes:
        off: of a row left out within digits, the largest difference of an entry from that sum.
    """

    row: NamedRow
    repeats: tuple[tuple[float, NamedRow], ...]
    off: float = 0.0


@dataclass(frozen=True)
class ComponentCount:
    """Connected bodies with their share of the count; drivers are not among the rows."""

    bodies: tuple[str, ...]
    unknowns: int
    rows: int
    rank: int
    drivers: tuple[str, ...]

    @property
    def dof(self) -> int:
        """Degrees of freedom."""
        return self.unknowns - self.rank


@dataclass(frozen=True)
class Violation:
    """A violated row: residual [m or rad], or its rate by the driver's."""

    row: NamedRow
    amount: float


@dataclass(frozen=True)
class Blocked:
    """A blocked driver, and the least violation of other rows per unit of the driver."""

    driver: str
    rows: tuple[Violation, ...]


class Ranks:
    """The rows of a mechanism at the design position, and their rank."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.frame = mechanism, frames(mechanism)
        self.formulation = Cartesian.of(mechanism, self.frame)
        self.at = self.formulation.configuration(self.formulation.design)
        self.matrix = jacobian(self.formulation, self.at)
        self.joint_rows = len(self.matrix) - len(mechanism.drivers)

    @cached_property
    def account(self) -> FreedomAccount:
        """The count; drivers are no part of it."""
        return account(self.mechanism, self.frame)

    @cached_property
    def rows(self) -> list[NamedRow]:
        """All rows by name."""
        return self._named(self.formulation, self.matrix)

    def _named(self, formulation: Cartesian, matrix: Array) -> list[NamedRow]:
        """Return rows by name, and by the motion that their entries prevent."""
        found: list[NamedRow] = []
        for c in formulation.constraints:
            body, count, kind = "", 1, "Relation"
            if isinstance(c, Constraint):
                body, count, kind = c.j, c.primitive.n, type(c.primitive).__name__
            for row in matrix[len(found) : len(found) + count]:
                found.append(NamedRow(c.owner, kind, self._holds(row, body)))
        return found

    def _holds(self, row: Array, body: str) -> str:
        """Return the motion prevented by a row, from its entries on a moving body."""
        names = (
            [body, *self.formulation.bodies]
            if body in self.formulation.columns
            else [*self.formulation.bodies]
        )
        for name in names:
            first = self.formulation.columns[name]
            for what, block in (
                ("along", row[first : first + 3]),
                ("about", row[first + 3 : first + 6]),
            ):
                size = float(np.linalg.norm(block))
                if size > OWED:
                    return f"{what} {_direction(block / size)}"
        return "coordinates"

    @cached_property
    def dependencies(self) -> list[Dependency]:
        """Return the redundant joint rows, and then those left out within digits, each in terms of
        kept rows.
        """
        joints = self.matrix[: self.joint_rows]
        kept = independent_joint_rows(self.formulation, joints)
        inverse = np.linalg.pinv(joints[kept])

        def dependency(named: NamedRow, row: Array, least: float) -> Dependency:
            weights: Array = row @ inverse
            terms = [
                (float(weights[at]), self.rows[kept[at]])
                for at in _largest_first(weights)
                if abs(weights[at]) > least
            ]
            off = float(np.abs(row - weights @ joints[kept]).max()) if least > OWED else 0.0
            return Dependency(named, tuple(terms), off)

        redundant = sorted({*range(self.joint_rows)} - {*kept})
        found = [dependency(self.rows[k], joints[k], OWED) for k in redundant]
        left_out = Cartesian(
            constraints_left_out(self.mechanism, self.frame),
            self.formulation.bodies,
            [*self.formulation.coordinates],
        )
        rows = jacobian(left_out, self.at)
        return [*found, *map(dependency, self._named(left_out, rows), rows, repeat(NEARLY))]

    @cached_property
    def nearly(self) -> list[tuple[float, list[NamedRow]]]:
        """Nearly redundant combinations of joint rows: singular value, and the rows in them."""
        u, values = np.linalg.svd(self.matrix[: self.joint_rows], full_matrices=False)[:2]
        scale = values.max(initial=0.0)
        found: list[tuple[float, list[NamedRow]]] = []
        for k in np.flatnonzero((values > RANK_TOLERANCE * scale) & (values < NEARLY * scale)):
            share = np.abs(u[:, k])
            found.append(
                (
                    float(values[k]),
                    [
                        self.rows[row]
                        for row in _largest_first(share)
                        if share[row] > SHARE * share.max()
                    ],
                )
            )
        return found

    @cached_property
    def components(self) -> list[ComponentCount]:
        """Return the unconnected parts of the mechanism."""
        groups: dict[int, list[int]] = {}
        for column, part in enumerate(parts_of_columns(self.formulation, self.matrix)):
            groups.setdefault(part, []).append(column)
        return [*map(self._component, groups.values())]

    def _component(self, columns: Sequence[int]) -> ComponentCount:
        own = np.flatnonzero(np.abs(self.matrix[:, columns]).max(axis=1) > 0.0)
        joints, drivers = own[own < self.joint_rows], own[own >= self.joint_rows]
        bodies = tuple(name for name, first in self.formulation.columns.items() if first in columns)
        names = tuple(self.rows[int(k)].owner for k in drivers)
        rank = len(independent_rows(self.matrix[joints][:, columns], 0))
        return ComponentCount(bodies, len(columns), len(joints), rank, names)

    @cached_property
    def free(self) -> list[list[Screw]]:
        """Return the motions left with all drivers held, each by its bodies."""
        return [
            screws(self.formulation, self.at, self.frame, rates)
            for rates in free_motions(self.matrix)
        ]

    @cached_property
    def blocked(self) -> list[Blocked]:
        """Return the drivers without a rate of their own."""
        joints, drives = self.matrix[: self.joint_rows], self.matrix[self.joint_rows :]
        found: list[Blocked] = []
        for k, driver in enumerate(self.mechanism.drivers):
            rate = np.zeros(len(drives))
            rate[k] = 1.0
            start, _, rank, _ = np.linalg.lstsq(drives, rate)
            against = float(np.abs(drives @ start - rate).max())
            hold = np.linalg.svd(drives, full_matrices=True)[2][int(rank) :].T
            least = (
                start
                + hold @ np.linalg.lstsq(joints @ hold, -joints @ start, rcond=RANK_TOLERANCE)[0]
            )
            given = joints @ least
            if np.abs(given).max(initial=0.0) > OWED or against > OWED:
                # by a radian of the driver, or by a metre
                units = (self.frame.unit, 1.0) if driver.turns else (1.0, 1.0 / self.frame.unit)
                found.append(Blocked(driver.name, tuple(self._violations(given, *units))))
        return found

    def _violations(self, amounts: Array, length: float, angle: float = 1.0) -> list[Violation]:
        """The rows with the largest amounts; those of lengths and of angles are in these units."""
        largest = np.abs(amounts).max(initial=0.0)
        order = [
            k
            for k in _largest_first(amounts)
            if abs(amounts[k]) > max(SHARE * largest, OWED * OWED)
        ]
        units = [length if "along" in self.rows[k].holds else angle for k in order]
        return [
            Violation(self.rows[k], float(amounts[k]) * unit)
            for k, unit in zip(order, units, strict=True)
        ]

    @cached_property
    def contradictions(self) -> list[Violation]:
        """Return the rows violated in the pose nearest to an assembly, drivers at design; empty if
        it closes.
        """
        equations = self.formulation

        def residuals(state: State) -> Array:
            phi = equations.phi(equations.configuration(state))
            return np.array(np.broadcast_arrays(*phi))

        state = equations.design
        for _ in range(STEPS):
            at, phi = equations.configuration(state), residuals(state)
            if np.abs(phi).max(initial=0.0) <= CONSISTENT:
                break
            # exact rows: simplified ones lead astray where phi = 0 is out of reach
            # in lanes: functions of single numbers are real
            steps = 1j * COMPLEX_STEP * np.eye(equations.unknowns)
            slopes = residuals(equations.retract(at, [*steps])).imag / COMPLEX_STEP
            step = np.linalg.lstsq(slopes, -phi, rcond=RANK_TOLERANCE)[0]
            size = float(np.abs(step).max())
            state = equations.retract(at, (step * min(1.0, STEP / size) if size else step).tolist())
            if size < CONSISTENT:
                break
        phi = residuals(state)
        return (
            self._violations(phi, self.frame.unit)
            if np.abs(phi).max(initial=0.0) > CONSISTENT
            else []
        )


def _largest_first(amounts: Array) -> list[int]:
    """Return indices by size; equals (to round-off) keep their order on every processor."""
    sizes = np.abs(amounts)
    scale = float(sizes.max(initial=0.0)) or 1.0
    return np.argsort(-np.round(sizes / scale, DIGITS), kind="stable").tolist()


def _direction(a: Array) -> str:
    k = int(np.abs(a).argmax())
    if abs(a[k]) > 1.0 - OWED:
        return "xyz"[k]
    return "(" + ", ".join(f"{x if abs(x) > OWED else 0.0:.3g}" for x in a * np.sign(a[k])) + ")"


def joints_that_free(ranks: Ranks) -> tuple[list[str], int]:
    """Return the joints and couplers of which any one, taken out alone, frees all blocked drivers,
    and the number of motions that are free then with the drivers held.

    Of all that free the drivers, those that leave the fewest motions free; none if none frees them.
    """
    joints, drives = ranks.matrix[: ranks.joint_rows], ranks.matrix[ranks.joint_rows :]
    owners = [row.owner for row in ranks.rows[: ranks.joint_rows]]
    left: dict[str, int] = {}
    for name in dict.fromkeys(owners):
        others = joints[[owner != name for owner in owners]]
        rank = len(independent_rows(np.vstack((others, drives)), 0))
        if rank == len(independent_rows(others, 0)) + len(drives):
            left[name] = ranks.matrix.shape[1] - rank
    least = min(left.values(), default=0)
    return [name for name, count in left.items() if count == least], least
