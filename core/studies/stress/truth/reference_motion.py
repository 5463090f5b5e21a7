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

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ....case.case import Case
from ....errors import KincheckError
from ....mechanism.motions import outwards
from ....trajectory import Array
from .evaluation import Poses, cross
from .long_double import Real, extended
from .newton_kantorovich import LANES, System
from .solutions import POLISHED, Solved, condition, inverted

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
        reach: knowledge of each sample, shape (n,); see `Reach`.
        singular: whether an engine may refuse the sample because of a pose before it, shape (n,).
        points: position [m], velocity and acceleration by point, each (n, 3); NaN if not reached.
        bounds: largest errors due to round-off, by point, shape (3, n).
        condition: condition of all unknowns, shape (n,).
        how: source of the motion.
        system, parts: the equations, and the solved samples by their numbers in the sweep.
        violated: unavoidable residual of contradictory geometry by sample [m]; zero if not checked.
    """

    reach: NDArray[np.int_]
    singular: NDArray[np.bool_]
    points: Mapping[str, tuple[Real, Real, Real]]
    bounds: Mapping[str, Array]
    condition: Array
    how: str
    system: System
    parts: Sequence[tuple[NDArray[np.intp], Solved]]
    violated: Array | None = None


Motion = Callable[[Real], Mapping[str, tuple[Real, Real, Real]]]
"""A closed form: drivers' values (drivers, n) to three values by moving body: its turn since
design, a unit quaternion (4, n); a point of it at design [m], (3,); the point's displacement [m],
(3, n), which has more digits than a position far from the origin. NaN: no solution.
"""


class DefectError(KincheckError):
    """Defect of the stress run: a closed form does not satisfy the equations."""


def followed(case: Case) -> Truth:
    """Return the reference followed from the design in both directions."""
    system = System(case)
    found, times = _Gathered(system, Reach.UNKNOWN), system.path.times
    for side in outwards(times, 0.0):
        if len(side):
            _follow(system, found, side)
    return found.truth("followed in extended precision")


def _follow(system: System, found: _Gathered, side: NDArray[np.intp]) -> None:
    """Solve the samples on one side of the design."""
    away = np.abs(system.path.times[side])
    stop = float(system.path.times[side][away.argmax()])
    knots, fold = system.knots(stop)
    if not knots:
        return
    at = np.array([abs(knot.times[0]) for knot in knots])
    worst = np.maximum.accumulate([knot.condition[0] for knot in knots])
    there = side[away <= at[-1]]
    for chunk in np.split(there, range(LANES, len(there), LANES)):
        if not len(chunk):
            continue
        # if nothing moves, only the design is known, and all samples are there
        solved = system.between(knots, chunk) if len(knots) > 1 else knots[0].repeated(len(chunk))
        found.reach[chunk] = np.where(solved.step <= POLISHED, Reach.REACHED, Reach.UNKNOWN)
        passed = worst[np.searchsorted(at, np.abs(system.path.times[chunk]))]
        found.singular[chunk] = np.maximum(passed, solved.condition) >= SINGULAR
        found.add(chunk, solved, keep=True)
    past = side[away > at[-1]]
    found.singular[past] = True
    if fold is not None:
        # samples too near to the fold stay unknown, since their side is uncertain
        found.reach[past[np.abs(system.path.times[past]) > abs(fold) + abs(abs(fold) - at[-1])]] = (
            Reach.BEYOND
        )


def closed(case: Case, motion: Motion, nearest: Sequence[float] = ()) -> Truth:
    """Return the reference of a closed form, polished to the last digit of the described mechanism.

    Args:
        nearest: swept values, from the design, at poses nearest to singular. An engine may refuse
            samples behind such a pose if doubles cannot distinguish it from singular.

    Raises:
        DefectError: the closed form is not a solution of the case.
    """
    system = System(case)
    found, n = _Gathered(system, Reach.BEYOND), len(case.sweep.values)
    for chunk in np.split(np.arange(n), range(LANES, n, LANES)):
        poses = closed_poses(system, motion, system.sampled(chunk)[0])
        known = np.isfinite(poses.u).all(axis=(0, 1)) & np.isfinite(poses.q).all(axis=(0, 1))
        if not known.any():
            continue
        chunk, poses = chunk[known], poses.at(np.flatnonzero(known))
        solved = system.solved(
            poses, system.sampled(chunk), system.path.times[chunk], system.rows.angles(poses)
        )
        moved = np.abs(solved.poses.u - poses.u).max(axis=(0, 1)).astype(np.float64)
        # the closed form does not include the rounding of the mechanism, 1e-16 of the rows
        bad = (moved > ROUND_OFF * solved.condition) & (solved.condition < UNPOLISHED)
        if bad.any():
            k = int(np.flatnonzero(bad)[0])
            raise DefectError(
                f"{case.name}: the closed form is {moved[k]:.2g} of the mechanism's size off at"
                f" {case.sweep.driver} = {case.sweep.values[chunk[k]]!r}, condition"
                f" {solved.condition[k]:.2g}; correct the family"
            )
        found.reach[chunk] = Reach.REACHED
        found.singular[chunk] = solved.condition >= SINGULAR
        # Newton's iteration cannot polish a singular pose
        found.add(chunk, _replaced(solved, poses, solved.condition >= UNPOLISHED), keep=False)
    found.singular |= bool(system.design().condition[0] >= SINGULAR)
    for time in np.divide(nearest, case.sweep.rate):
        poses = closed_poses(system, motion, system.drives(np.array([time]))[0])
        if not condition(inverted(system.rows.jacobian(poses)))[0] < UNPOLISHED:
            found.singular |= system.path.times * time > time * time
    for side in outwards(system.path.times, 0.0):
        # beyond a gap a formula may have values, but no motion leads there
        gone = np.logical_or.accumulate(found.reach[side] == Reach.BEYOND)
        found.reach[side] = np.where(gone, Reach.BEYOND, found.reach[side])
        found.singular[side] = np.logical_or.accumulate(found.singular[side] | gone)
    return found.truth("closed form")


def _replaced(found: Solved, poses: Poses, where: NDArray[np.bool_]) -> Solved:
    u, q = (
        np.where(where, old, new)
        for old, new in ((poses.u, found.poses.u), (poses.q, found.poses.q))
    )
    return replace(found, poses=Poses(u, q))


def closed_poses(system: System, motion: Motion, values: Real) -> Poses:
    """Return poses of the bodies about their centres, from a closed form at
    values of the drivers.
    """
    stated, moved = system.rows.stated, motion(values)
    n = next(iter(moved.values()))[0].shape[-1]
    found = Poses.design(len(stated.bodies), n)
    for k, name in enumerate(stated.bodies, 1):
        found.q[k], _, shift = moved[name]
        found.u[k] = shift / extended(stated.unit)
    levers = [
        stated.centres[k] - (moved[name][1] - stated.origin) / stated.unit
        for k, name in enumerate(stated.bodies)
    ]
    for k, lever in enumerate(levers, 1):
        found.u[k] += np.einsum("abn,b->an", found.turned[k], lever)
    return found


class _Gathered:
    def __init__(self, system: System, unknown: Reach) -> None:
        self.system, n = system, len(system.path.times)
        self.reach, self.singular = np.full(n, unknown), np.zeros(n, dtype=np.bool_)
        self.condition = np.full(n, np.inf)
        self.parts: list[tuple[NDArray[np.intp], Solved]] = []
        names = system.case.points
        self.points = {
            name: tuple(np.full((n, 3), np.nan, dtype=np.longdouble) for _ in range(3))
            for name in names
        }
        self.bounds = {name: np.full((3, n), np.inf) for name in names}

    def add(self, samples: NDArray[np.intp], found: Solved, *, keep: bool) -> None:
        """Add solved samples; keep the solutions for proofs, except in very large runs."""
        self.condition[samples] = found.condition
        for name, moved in self.points.items():
            for whole, part in zip(moved, _motion(self.system, found, name), strict=True):
                whole[samples] = part.T
            self.bounds[name][:, samples] = _bounds(self.system, found, name)
        if keep:
            self.parts.append((samples, found))

    def truth(self, how: str) -> Truth:
        """Return the reference; points of unreached samples are NaN."""
        unreached = self.reach != Reach.REACHED
        for moved in self.points.values():
            for whole in moved:
                whole[unreached] = np.nan
        points = {name: (x, v, a) for name, (x, v, a) in self.points.items()}
        return Truth(
            self.reach,
            self.singular,
            points,
            self.bounds,
            self.condition,
            how,
            self.system,
            self.parts,
        )


def _motion(system: System, found: Solved, name: str) -> tuple[Real, Real, Real]:
    """Return position, velocity and acceleration of a point, each of shape (3, n) [SI]."""
    position, body, arm = _place(system, name)
    unit, zero = system.rows.stated.unit, np.zeros((3, found.poses.samples), dtype=np.longdouble)
    if body == 0:
        return zero + position[:, None], zero, zero
    swing = np.einsum("abn,b->an", found.poses.turned[body], arm)
    turned = (arm[:, None] + swing)[None]
    v, w, v_t, w_t = (
        x[body - 1 : body, part] for x in (found.v, found.a) for part in (slice(0, 3), slice(3, 6))
    )
    around = cross(w, turned)
    x = position[:, None] + unit * (found.poses.u[body] + swing)
    return x, unit * (v + around)[0], unit * (v_t + cross(w_t, turned) + cross(w, around))[0]


def _bounds(system: System, found: Solved, name: str) -> Array:
    """Return the round-off bounds of a point by the formulas of the module, shape (3, n)."""
    _, body, arm = _place(system, name)
    size = system.rows.stated.unit
    x = np.abs(_motion(system, found, name)[0]).max(axis=0).astype(np.float64)
    if body == 0:
        return ROUND_OFF * np.stack([x, 0.0 * x, 0.0 * x])
    turned = (arm[:, None] + np.einsum("abn,b->an", found.poses.turned[body], arm)).astype(
        np.float64
    )
    shift, turn = (found.inverse[:, 6 * (body - 1) + k : 6 * (body - 1) + k + 3] for k in (0, 3))
    moved = shift + np.stack([np.cross(turn[k].T, turned[:, k]).T for k in range(len(turn))])
    at_point, condition = np.abs(moved).sum(axis=2).max(axis=1), found.condition
    fastest = np.abs(found.v).max(axis=(0, 1)).astype(np.float64)
    second = np.maximum(np.abs(found.a).max(axis=(0, 1)).astype(np.float64), fastest**2)
    return np.stack(
        [
            np.minimum(ROUND_OFF * at_point, AT_A_FOLD) * size + ROUND_OFF * x,
            ROUND_OFF * at_point * (1.0 + condition) * fastest * size,
            ROUND_OFF * at_point * (1.0 + condition) ** 2 * second * size,
        ]
    )


def _place(system: System, name: str) -> tuple[Real, int, Real]:
    """Return a point at design [m], its body and its arm there [units]."""
    stated, point = system.rows.stated, system.mechanism.point(name)
    position = extended(point.position)
    if system.mechanism.is_fixed(point.body):
        return position, 0, position
    body = stated.bodies.index(point.body) + 1
    return position, body, (position - stated.origin) / stated.unit - stated.centres[body - 1]
