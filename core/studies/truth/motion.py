"""The reference motion of a case: its points at every reachable sample, with round-off bounds.

An error up to 1e-14 of size times condition is round-off. This is 90 half units in the last place:
a row is a sum of up to forty products of rotated vectors, each with one or two roundings.

    position        1e-14 (K_x L + |x|)       K_x: move of the point per unit error of each row
    velocity        1e-14 K_x (1 + K) V L     V: the fastest unknown
    acceleration    1e-14 K_x (1 + K)^2 A L   A: the largest second rate, or V^2

L is the mechanism's size, K the condition of all unknowns. In J v = c_t, J has the error of the
pose (one K); J a = ... also has the error of v. |x| is the rounding far from the origin. Where two
solutions meet, errors are roots of the rows' errors: no position error may exceed sqrt(1e-14) L.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ...case.case import Case
from ...errors import KincheckError
from ...mechanism.motions import outwards
from ...trajectory import Array
from .path import LANES, POLISHED, Solved, System, condition, inverted
from .rows import Indices, Poses, Real, Rows, cross, extended

ROUND_OFF = 1e-14
AT_A_FOLD = ROUND_OFF**0.5
# Above this condition, a residual of 1e-12 (tolerance of a run), times the condition squared,
# exceeds 1e-9 of the rates (default tolerance of outputs): an engine may refuse, with the reason.
SINGULAR = (1e-9 / 1e-12) ** 0.5
# Above this condition a closed form is better than Newton's method, limited by rounding (1e-16).
UNPOLISHED = 1e6


class Reach(IntEnum):
    """Whether a solution that continues the design is known (REACHED), does not exist (BEYOND), or
    may exist (UNKNOWN).
    """

    REACHED = 0
    BEYOND = 1
    UNKNOWN = 2


@dataclass(frozen=True, eq=False)
class Truth:
    """The motion of the case's points.

    Attributes:
        system: the equations.
        reach: knowledge of each sample, shape (n,); see `Reach`.
        singular: whether an engine may refuse the sample because of a pose before it, shape (n,).
        condition: condition of all unknowns, shape (n,).
        points: position [m], velocity and acceleration by point, shape (3, n, 3); NaN if not
            reached.
        bounds: largest errors due to round-off, by point, shape (3, n).
        parts: the solved samples by their numbers in the sweep.
        violated: unavoidable residual of contradictory geometry by sample [m]; None if not checked.
    """

    system: System
    reach: NDArray[np.int_]
    singular: NDArray[np.bool_]
    condition: Array
    points: Mapping[str, Real]
    bounds: Mapping[str, Array]
    parts: list[tuple[Indices, Solved]] = field(default_factory=list[tuple[Indices, Solved]])
    violated: Array | None = None

    @staticmethod
    def unknown(case: Case, reach: Reach) -> Truth:
        """Return a truth without any sample."""
        system, n = System(case), len(case.sweep.values)
        return Truth(
            system,
            np.full(n, reach),
            np.zeros(n, dtype=np.bool_),
            np.full(n, np.inf),
            {name: np.full((3, n, 3), np.nan, dtype=np.longdouble) for name in case.points},
            {name: np.full((3, n), np.inf) for name in case.points},
        )

    def add(self, samples: Indices, found: Solved) -> None:
        """Fill in solved samples."""
        self.condition[samples] = found.condition
        for name, whole in self.points.items():
            motion, bounds = _motion(self.system, found, name)
            whole[:, samples] = np.moveaxis(motion, 1, 2)
            self.bounds[name][:, samples] = bounds

    def finished(self) -> Truth:
        """Return the truth without the points of unreached samples."""
        for whole in self.points.values():
            whole[:, self.reach != Reach.REACHED] = np.nan
        return self


Motion = Callable[[Real], Mapping[str, tuple[Real, Real, Real]]]
"""A closed form: drivers' values (drivers, n) to three values by moving body: its turn since
design, a unit quaternion (4, n); a point of it at design [m], (3,); the point's displacement [m],
(3, n), which has more digits than a position far from the origin. NaN: no solution.
"""


class DefectError(KincheckError):
    """Defect of the stress run: a closed form does not satisfy the equations."""


def chunks(samples: Indices) -> Iterator[Indices]:
    """Yield samples in parts that are solved at once."""
    for first in range(0, len(samples), LANES):
        yield samples[first : first + LANES]


def followed(case: Case) -> Truth:
    """Return the reference followed from the design in both directions."""
    found = Truth.unknown(case, Reach.UNKNOWN)
    system, times = found.system, found.system.path.times
    for side in outwards(times, 0.0):
        away = np.abs(times[side])
        knots, fold = system.knots(times[side][away.argmax()]) if len(side) else (None, None)
        if knots is None:
            continue
        at, worst = np.abs(knots.times), np.maximum.accumulate(knots.condition)
        for chunk in chunks(side[away <= at[-1]]):
            # if nothing moves, only the design is known, and all samples are there
            solved = system.between(knots, chunk) if len(at) > 1 else knots.at(0 * chunk)
            found.reach[chunk] = np.where(solved.step <= POLISHED, Reach.REACHED, Reach.UNKNOWN)
            passed = worst[np.searchsorted(at, np.abs(times[chunk]))]
            found.singular[chunk] = np.maximum(passed, solved.condition) >= SINGULAR
            found.add(chunk, solved)
            found.parts.append((chunk, solved))
        past = side[away > at[-1]]
        found.singular[past] = True
        if fold is not None:
            # samples too near to the fold stay unknown, since their side is uncertain
            beyond = np.abs(times[past]) > abs(fold) + abs(abs(fold) - at[-1])
            found.reach[past[beyond]] = Reach.BEYOND
    return found.finished()


def closed(case: Case, motion: Motion, nearest: Sequence[float] = ()) -> Truth:
    """Return the reference of a closed form, polished to the last digit of the described mechanism.

    Args:
        nearest: swept values, from the design, at poses nearest to singular. An engine may refuse
            samples behind such a pose if doubles cannot distinguish it from singular.

    Raises:
        DefectError: the closed form is not a solution of the case.
    """
    found = Truth.unknown(case, Reach.BEYOND)
    system, times = found.system, found.system.path.times
    for chunk in chunks(np.arange(len(times))):
        poses = closed_poses(system.rows, motion, system.sampled(chunk)[0])
        known = np.flatnonzero(np.isfinite(poses.u[:, 0] + poses.q[:, 0]).all(axis=0))
        if not len(known):
            continue
        chunk, poses = chunk[known], poses.at(known)
        angles = system.rows.angles(poses)
        solved = system.solved(poses, system.sampled(chunk), times[chunk], angles)
        moved = np.abs(solved.poses.u - poses.u).max(axis=(0, 1)).astype(np.float64)
        size = solved.condition
        # the closed form does not include the rounding of the mechanism, 1e-16 of the rows
        bad = (moved > ROUND_OFF * size) & (size < UNPOLISHED)
        if bad.any():
            k = int(np.flatnonzero(bad)[0])
            raise DefectError(
                f"{case.name}: the closed form is {moved[k]:.2g} of the mechanism's size off at"
                f" {case.sweep.driver} = {case.sweep.values[chunk[k]]!r}, condition"
                f" {size[k]:.2g}. Correct the family."
            )
        found.reach[chunk] = Reach.REACHED
        found.singular[chunk] = size >= SINGULAR
        # Newton's iteration cannot polish a singular pose
        given, new, kept = poses, solved.poses, size >= UNPOLISHED
        poses = Poses(np.where(kept, given.u, new.u), np.where(kept, given.q, new.q))
        found.add(chunk, replace(solved, poses=poses))
    found.singular[:] |= bool(system.design().condition[0] >= SINGULAR)
    for time in np.divide(nearest, case.sweep.rate):
        poses = closed_poses(system.rows, motion, system.drives(np.array([time]))[0])
        if not condition(inverted(system.rows.jacobian(poses)))[0] < UNPOLISHED:
            found.singular[:] |= times * time > time * time
    for side in outwards(times, 0.0):
        # beyond a gap a formula may have values, but no motion leads there
        gone = np.logical_or.accumulate(found.reach[side] == Reach.BEYOND)
        found.reach[side] = np.where(gone, Reach.BEYOND, found.reach[side])
        found.singular[side] = np.logical_or.accumulate(found.singular[side] | gone)
    return found.finished()


def closed_poses(rows: Rows, motion: Motion, values: Real) -> Poses:
    """Return poses of the bodies about their centres, from a closed form at values of the
    drivers.
    """
    moved = motion(values)
    found = Poses.design(len(rows.bodies), values.shape[-1])
    for k, name in enumerate(rows.bodies, 1):
        found.q[k] = moved[name][0]
    for k, name in enumerate(rows.bodies, 1):
        _, point, shift = moved[name]
        found.u[k] = shift / rows.unit - found.swing(k, rows.arm(k, point))
    return found


def carried(rows: Rows, found: Solved, body: int, position: Sequence[float]) -> tuple[Real, Real]:
    """Return the arm of a body's point, (3, n), and its displacement, velocity and acceleration,
    (3, 3, n) [SI].

    Args:
        position: of the point, global at design [m].
    """
    arm = rows.arm(body, position)
    swing = found.poses.swing(body, arm)
    turned = arm[:, None] + swing
    (v, w), (v_t, w_t) = ((each[body, :3], each[body, 3:]) for each in (found.v, found.a))
    around = cross(w, turned)
    moved = found.poses.u[body] + swing, v + around, v_t + cross(w_t, turned) + cross(w, around)
    return rows.unit * turned, rows.unit * np.stack(moved)


def _motion(system: System, found: Solved, name: str) -> tuple[Real, Array]:
    """Return position, velocity and acceleration of a point, (3, 3, n) [SI], and their round-off
    bounds by the formulas of the module, (3, n).
    """
    rows, point = system.rows, system.mechanism.point(name)
    body, size = rows.index(point.body), rows.unit
    arm, motion = carried(rows, found, body, point.position)
    motion[0] += extended(point.position)[:, None]
    x = np.abs(motion[0]).max(axis=0).astype(np.float64)
    if not body:
        return motion, ROUND_OFF * np.stack([x, 0.0 * x, 0.0 * x])
    first = 6 * (body - 1)
    shift, turn = (found.inverse[:, first + k : first + k + 3] for k in (0, 3))
    moved = shift + cross(turn, (arm / size).T[..., None].astype(np.float64))
    at_point, factor = np.abs(moved).sum(axis=2).max(axis=1), 1.0 + found.condition
    fastest, second = (np.abs(x).max(axis=(0, 1)).astype(np.float64) for x in (found.v, found.a))
    return motion, ROUND_OFF * np.stack(
        [
            np.minimum(at_point, AT_A_FOLD / ROUND_OFF) * size + x,
            at_point * factor * fastest * size,
            at_point * factor**2 * np.maximum(second, fastest**2) * size,
        ]
    )
