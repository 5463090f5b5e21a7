"""Replay: the native rows at poses, velocities and accelerations that something else computed, and
the forces that such a motion needs: reactions of joints, and forces without a bearer.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice, product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...errors import SolveError, UnknownNameError
from ...forces import Forces
from ...kinematics.forces.reactions import TURN, ForceRows, forces_of, with_rates
from ...kinematics.formulation.cartesian import Cartesian
from ...kinematics.formulation.constraints import Constraint, frames
from ...kinematics.formulation.formulation import Relation
from ...mechanism.mechanism import GROUND, Mechanism
from ...mechanism.motions import Path
from ...trajectory import QUANTITIES, Array, BodyMotion, Trajectory

WIDTHS = {"poses": 7, "velocities": 6, "accelerations": 6}
"""Numbers of a body, by argument of `residuals`."""
# Angles are this near to zero at one sample as at another: rounding must not decide [rad].
NEAR = 1e-3
SMALL = 1e-9
# A recording may begin after so many turns of so many coupled joints; so many samples tell.
MOST_TURNS, MOST_OPEN, SAMPLES = 20, 3, 25
# Lanes at once: some 10 kB each for twenty bodies.
MOST_LANES = 20_000
# Divides what is left where nothing is allowed: far below all rounding.
SMALLEST = 1e-100


@dataclass(frozen=True, eq=False)
class Worst:
    """The row and sample farthest out of what is allowed.

    Attributes:
        value, allowed: what is left, and what is allowed [m, m/s or m/s^2].
    """

    joint: str
    bodies: tuple[str, ...]
    sample: int
    value: float
    allowed: float


@dataclass(frozen=True, eq=False)
class Residuals:
    """What poses, velocities and accelerations leave of the native rows over n samples.

    Lengths are in metres; angles are times the mechanism's unit of length, near its size.

    Attributes:
        joints, bodies: joint (or coupler, or driver) and moving bodies of each row.
        position, velocity, acceleration: phi, J v - nu and J a - gamma, shape (n, rows); None
            without these rates.
        allowed: by quantity, what printed digits allow, shape (n, rows); empty without digits.
        not_judged: joints that need a body without poses, and the body.
        begun: whole turns at which coupled joints begin, by coordinate; see `count_turns`.
    """

    joints: Sequence[str]
    bodies: Sequence[tuple[str, ...]]
    position: Array
    velocity: Array | None
    acceleration: Array | None
    allowed: Mapping[str, Array]
    not_judged: Mapping[str, str]
    begun: Mapping[str, int]

    def worst(self, quantity: str, tolerance: float = 0.0) -> Worst | None:
        """Return the row and sample with the largest residual over what is allowed.

        None without rows or rates.

        Args:
            tolerance: allowed beside the digits [m, m/s or m/s^2].
        """
        left: Array | None = getattr(self, quantity)
        if left is None or not np.isfinite(left).any():
            return None
        allowed = tolerance + self.allowed.get(quantity, np.zeros(left.shape))
        ratio = np.abs(left) / np.maximum(allowed, SMALLEST)
        k, row = divmod(int(np.nanargmax(ratio)), left.shape[1])
        found = abs(float(left[k, row])), float(allowed[k, row])
        return Worst(self.joints[row], self.bodies[row], k, *found)


def residuals(
    mechanism: Mechanism,
    poses: Mapping[str, ArrayLike],
    velocities: Mapping[str, ArrayLike] | None = None,
    accelerations: Mapping[str, ArrayLike] | None = None,
    *,
    digits: Mapping[str, ArrayLike] | None = None,
) -> Residuals:
    """Return what poses from elsewhere leave of the native rows of joints and couplers.

    Drivers are not judged. A joint is judged if both its bodies have poses, or are fixed.

    Args:
        poses: by body, at n samples: origin, global [m], and Euler parameters e0..e3 of body ->
            global, shape (n, 7). NaN at samples without a pose.
        velocities: of the same bodies: velocity of the origin, global [m/s], and angular velocity
            in the body's axes [rad/s], shape (n, 6); as `BodyMotion.v`.
        accelerations: likewise, their rates [m/s^2, rad/s^2], shape (n, 6); as `BodyMotion.a`.
        digits: by body, how far each of these numbers may be off, such as half a unit of its last
            printed digit: shape (n, 7), or (n, 13) and (n, 19) with velocities and accelerations.

    Raises:
        SolveError: a shape is wrong, or there is no pose.
        UnknownNameError: there is no such body.
    """
    given = {"poses": poses, "velocities": velocities, "accelerations": accelerations}
    tables = {what: each for what, each in given.items() if each is not None}
    if accelerations is not None and velocities is None:
        raise SolveError("residuals: accelerations need velocities; give both")
    known = [body.name for body in mechanism.moving]
    motions: dict[str, BodyMotion] = {}
    moved: dict[str, list[BodyMotion]] = {}
    count = len(np.asarray(next(iter(poses.values()), ())))
    for name in poses:
        if name not in known:
            raise UnknownNameError("moving body", name, known)
        each = [_table(what, name, tables[what], (count, WIDTHS[what])) for what in tables]
        numbers = np.hstack(each)
        motions[name] = _motion(numbers)
        if digits and name in digits:
            half = _table("digits", name, digits, numbers.shape)
            moved[name] = [_motion(numbers + half * row) for row in np.eye(numbers.shape[1])]
    return replay_motions(mechanism, motions, moved)


def _table(what: str, name: str, given: Mapping[str, ArrayLike], shape: tuple[int, ...]) -> Array:
    found = np.asarray(given.get(name, ()), dtype=np.float64)
    if found.shape != shape:
        raise SolveError(
            f"residuals: {what} of body {name!r} have shape {found.shape}, expected {shape}: a row"
            " for each sample"
        )
    return found


def _motion(numbers: Array) -> BodyMotion:
    r, p, v, a = np.split(numbers, [3, 7, 13], axis=1)
    p = p / np.linalg.norm(p, axis=1)[:, None]
    return BodyMotion(r, p, v if v.size else None, a if a.size else None)


def replay_motions(
    mechanism: Mechanism,
    motions: Mapping[str, BodyMotion],
    moved: Mapping[str, Sequence[BodyMotion]] | None = None,
    angles: Mapping[str, Array] | None = None,
) -> Residuals:
    """Return what motions of bodies leave of the native rows; see `residuals`.

    Args:
        angles: from design of joints that are known with all turns, by coordinate [rad].
        motions: by body; rates are judged as far as all bodies have them.
        moved: by body, its motion after each recorded number is moved by half its last digit.

    Raises:
        SolveError: there is no motion.
    """
    if not motions:
        raise SolveError("residuals: there is no pose of a body; give those of some")
    part, not_judged = judged_part(mechanism, motions)
    orders, _ = with_rates(motions)
    rows = _Rows(part, orders, angles or {})
    with np.errstate(invalid="ignore"):
        left = rows.left(motions)
        limits = rows.changes(motions, left, moved) if moved else []
    position, *rates = left
    velocity, acceleration = (*rates, None, None)[:2]
    names = [mechanism.given_name(owner) for owner, _ in rows.formulation.owners]
    allowed: dict[str, Array] = dict(zip(QUANTITIES, limits, strict=False))
    found = position, velocity, acceleration
    return Residuals(names, rows.bodies, *found, allowed, not_judged, rows.whole)


def judged_part(mechanism: Mechanism, known: Iterable[str]) -> tuple[Mechanism, dict[str, str]]:
    """Return the mechanism of the known bodies, without drivers and loads, and the joints that need
    another body, with its name.
    """
    names = {*known, *(body.name for body in mechanism.bodies if body.fixed), GROUND}
    without = {
        each.name: next((body for body in each.bodies if body not in names), "")
        for each in mechanism.joints
    }
    without |= {
        each.name: next((without[name] for name in each.joints if without[name]), "")
        for each in mechanism.couplers
    }
    part = replace(
        mechanism,
        bodies=[each for each in mechanism.bodies if each.name in names],
        joints=[each for each in mechanism.joints if not without[each.name]],
        couplers=[each for each in mechanism.couplers if not without[each.name]],
        points=[each for each in mechanism.points if each.body in names],
        **dict.fromkeys(("drivers", "forces", "reduced"), ()),
    )
    return part, {mechanism.given_name(name): body for name, body in without.items() if body}


def count_turns(angle: Array) -> Array:
    """Return an angle known up to whole turns [rad], counted from sample to sample, from the first
    that is as near to zero as any; NaN where it is.
    """
    there = np.isfinite(angle)
    if not there.all():
        found = np.full(angle.shape, np.nan)
        found[there] = count_turns(angle[there])
        return found
    whole = np.unwrap(angle)
    off = np.abs(np.sin(0.5 * whole))
    first = np.flatnonzero(off <= off.min(initial=1.0) + NEAR)[:1]
    return whole - TURN * np.round(whole[first] / TURN)


def begun_turns(mechanism: Mechanism, motions: Mapping[str, BodyMotion]) -> dict[str, int]:
    """Return the whole turns at which coupled joints begin, by coordinate; see `count_turns`."""
    part, _ = judged_part(mechanism, motions)
    if not part.couplers:
        return {}
    rows = _Rows(part, 1, {})
    rows.left(motions)
    return rows.whole


class _Rows:
    """The native rows of a mechanism without drivers, and of their rates as far as wanted."""

    def __init__(self, mechanism: Mechanism, orders: int, angles: Mapping[str, Array]) -> None:
        self.mechanism, self.orders, self.angles = mechanism, orders, angles
        self.turns: dict[str, Array] = {}
        self.whole: dict[str, int] = {}
        self.formulation = Cartesian.of(mechanism, frames(mechanism))
        self.bodies = [*map(self._bodies, self.formulation.of_rows)]

    def _bodies(self, c: Constraint | Relation) -> tuple[str, ...]:
        """Return the moving bodies of a row."""
        pair = [c.i, c.j] if isinstance(c, Constraint) else []
        for name in () if isinstance(c, Constraint) else c.weights:
            pair += self.mechanism.joint(name.rpartition(".")[0]).bodies
        return tuple(dict.fromkeys(b for b in pair if b in self.formulation.columns))

    def left(self, motions: Mapping[str, BodyMotion]) -> list[Array]:
        """Return what motions leave of the rows, shape (n, rows) each [m, m/s, m/s^2]."""
        _, rated = with_rates(motions)
        count = len(next(iter(rated.values())).r)
        lines = _force_rows(self.mechanism, rated, np.zeros(count))
        formulation, unit = lines.formulation, lines.frame.unit
        at = formulation.configuration(self._with_turns({**lines.equations.at.state}))
        return [unit * each for each, _ in islice(lines.remainders(at), self.orders)]

    def _with_turns(self, state: dict[str, Any]) -> dict[str, Any]:
        """Return a state with all turns of coupled joints."""
        turning = [name for name in self.formulation.coordinates if "rotation" in name]
        if not self.turns:
            self.turns = {name: count_turns(state[f"x {name}"][0]) for name in turning}
            for name in self.turns.keys() & self.angles.keys():
                off = (self.angles[name] - self.turns[name]) / TURN
                if np.isfinite(off).any():
                    self._add(name, round(float(np.nanmedian(off))))
            slides = {name: state[f"x {name}"][0] for name in self.formulation.coordinates}
            for c in self.formulation.constraints:
                if isinstance(c, Relation):
                    self._begin_count(c, {**slides, **self.turns})
        for name in turning:
            (x,) = state[f"x {name}"]
            around = np.resize(self.turns[name], len(x))
            state[f"x {name}"] = (x - TURN * np.round((x - around) / TURN),)
        return state

    def _begin_count(self, relation: Relation, values: Mapping[str, Array]) -> None:
        """Begin to count at the fewest whole turns with which coupled joints fit: poses leave them
        open, and a recording may begin after several.
        """
        free = [name for name in relation.weights if name in self.turns.keys() - self.whole.keys()]
        at = np.column_stack([values[name] for name in relation.weights])
        at = at[np.isfinite(at).all(axis=1)]
        if not len(at) or len(free) > MOST_OPEN:
            return
        at = at[:: 1 + len(at) // SAMPLES]
        numbers = range(-MOST_TURNS, MOST_TURNS + 1)
        fewest: list[tuple[int, ...]] = sorted(
            product(numbers, repeat=len(free)), key=lambda each: sum(map(abs, each))
        )
        added = dict(zip(free, TURN * np.array(fewest).T[..., None], strict=True))
        x = [each + added.get(name, 0.0) for name, each in zip(relation.weights, at.T, strict=True)]
        left = np.median(np.abs(relation.value(x)), axis=-1)
        fits = np.flatnonzero(left <= 2.0 * left.min() + SMALL)
        begun = fewest[int(fits[0])] if left.min() < NEAR else (0,) * len(free)
        for name, number in zip(free, begun, strict=True):
            self._add(name, number)

    def _add(self, name: str, number: int) -> None:
        """Add the whole turns at which a joint begins."""
        self.whole[name] = number
        self.turns[name] = self.turns[name] + TURN * number

    def changes(
        self,
        motions: Mapping[str, BodyMotion],
        left: Sequence[Array],
        moved: Mapping[str, Sequence[BodyMotion]],
    ) -> list[Array]:
        """Return what moved numbers change in the rows, summed over the numbers."""
        found = [np.zeros_like(each) for each in left]
        at_once = max(1, MOST_LANES // len(left[0]))
        for group in self._independent_groups([name for name in moved if name in motions]):
            most = max(len(moved[name]) for name in group)
            for first in range(0, most, at_once):
                columns = range(first, min(first + at_once, most))
                lanes = {
                    name: _join_lanes(
                        [
                            moved[name][k] if name in group and k < len(moved[name]) else motion
                            for k in columns
                        ]
                    )
                    for name, motion in motions.items()
                }
                for total, x, y in zip(found, self.left(lanes), left, strict=True):
                    total += np.abs(x.reshape(len(columns), *y.shape) - y).sum(axis=0)
        return found

    def _independent_groups(self, names: Sequence[str]) -> list[list[str]]:
        """Return groups of bodies; two of a group share no row, and are moved together."""
        groups: list[list[str]] = []
        for name in names:
            beside = {other for row in self.bodies if name in row for other in row}
            group = next((each for each in groups if beside.isdisjoint(each)), None)
            if group is None:
                groups.append(group := [])
            group.append(name)
        return groups


def _force_rows(mechanism: Mechanism, motions: Mapping[str, BodyMotion], times: Array) -> ForceRows:
    return ForceRows(mechanism, Path({}, times), _trajectory(motions, len(times)))


def _trajectory(motions: Mapping[str, BodyMotion], n: int) -> Trajectory:
    solved, none = np.ones(n, dtype=np.bool_), np.zeros(n, dtype=np.int64)
    return Trajectory({}, solved, none, 0.0, bodies=motions)


def _join_lanes(motions: Sequence[BodyMotion]) -> BodyMotion:
    """Return the lanes of several motions, one after the other."""
    parts = [[getattr(each, key) for each in motions] for key in ("r", "p", "v", "a")]
    return BodyMotion(*(None if each[0] is None else np.concatenate(each) for each in parts))  # pyright: ignore[reportArgumentType]


# Of the largest singular value of the rows, what is none.
REDUNDANT = 1e-9


@dataclass(frozen=True, eq=False)
class Needed:
    """Forces for the masses and loads of a mechanism to move as given.

    Attributes:
        forces: reactions of joints and forces of elements; None without a joint.
        free: by body, force and torque without a joint or driver to carry it, torques over the
            mechanism's unit of length [N], shape (n, 6). Zero for a motion of these masses and
            loads, NaN for a spring without length.
        largest: largest force of the motion, to compare with [N].
    """

    forces: Forces | None
    free: Mapping[str, Array]
    largest: float


def needed_forces(mechanism: Mechanism, motions: Mapping[str, BodyMotion], times: Array) -> Needed:
    """Return the forces needed by a motion from elsewhere; drivers carry those along them.

    Args:
        motions: of all moving bodies, with accelerations.
        times: of the samples [s], shape (n,): torsion springs count their turns along them.

    Raises:
        SolveError: the motion lacks a body or its accelerations.
    """
    passive = replace(mechanism, drivers=())
    with np.errstate(divide="ignore", invalid="ignore"):  # a spring without a length, for once
        demand = _force_rows(passive, motions, times).demand
        lines = _force_rows(mechanism, motions, times)
    left, unit = np.array(demand), lines.frame.unit
    if lines.matrix.shape[1]:
        _, sizes, right = np.linalg.svd(lines.matrix, full_matrices=False)
        held = sizes > REDUNDANT * sizes[:, :1]
        along = np.where(held, np.einsum("nru,nu->nr", right, demand), 0.0)
        left = left - np.einsum("nru,nr->nu", right, along)
    columns = lines.formulation.columns
    free = {name: left[:, first : first + 6] / unit for name, first in columns.items()}
    bodies = demand[:, : 6 * len(columns)]
    known = np.abs(bodies)[np.isfinite(bodies)]
    largest = float(known.max(initial=0.0)) / unit
    motion = _trajectory(motions, len(times))
    forces = forces_of(passive, Path({}, times), motion) if passive.joints else None
    return Needed(forces, free, largest)
