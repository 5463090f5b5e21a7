"""The reference motion of a case: its equations in extended precision, the path from the design,
and its points at every reachable sample, with round-off bounds.

The path is followed independently of the engines' predictors. A step dx from one knot to the next
is accepted if the norm of row sums of J0^-1 J1 - I is less than a half. The simplified iteration
from the knot then contracts all along the step, so its solution continues the motion
(Newton-Kantorovich). Near a singular pose this would need steps as small as the smallest singular
value. A small step is therefore accepted under two weaker conditions. (J0^-1 J1 - I) dx must be
less than a half of dx, seen from both ends. And det(J0^-1 J1) must be positive: beyond a gap
between two solutions it is negative. Samples between two knots are interpolated, polished, and
tested under the same conditions from the nearer knot.

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
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....case.case import Case
from ....errors import KincheckError
from ....mechanism.motions import JointAngle, outwards
from ....trajectory import Array
from .rows import Indices, Poses, Real, Rows, cross, extended, nearest_turn, spun

# Singular values below this fraction of the largest belong to redundant rows, as in
# `redundancy.RANK_TOLERANCE`.
RANK = 1e-9
# Largest error of a polished sample, as a fraction of its condition: a hundredth of an engine's
# allowed error.
POLISHED = 1e-16
# Largest change of J between neighbours. At 1 the simplified iteration may fail; a half leaves an
# equal margin for the change of J in between.
LARGEST_CHANGE = 0.5
# Steps below this fraction of the path are tested only along their direction, not in all
# directions.
SMALL_PART = 2.0**-6
# Largest step, as a fraction of the path: a sweep of one or two turns has at least sixteen steps.
FIRST_PART = 1.0 / 16.0
# A refused step below this fraction of the path shows a singular pose, not a coarse step: near the
# pose, the solution changes as the root of the remaining time.
SMALLEST_PART = 2.0**-30
# Number of knots for the test of the root law. Near 30 random folds the law holds to 5 %; two
# bifurcations miss it by a factor of at least 46.
ROOT_KNOTS = 7
# Number of samples solved at once: the arrays of the largest mechanisms fit in the cache.
LANES = 256
MOST_STEPS = 8


@dataclass(frozen=True, eq=False)
class Solved:
    """Solved samples.

    Attributes:
        times: times of the samples [s], shape (n,).
        angles: angles of the turns, including full turns [rad], shape (turns, n).
        inverse: inverse or pseudo-inverse of the Jacobian, shape (n, unknowns, rows).
        jacobian: shape (n, rows, unknowns).
        v, a: rates and accelerations of all bodies, the ground's first, shape (bodies + 1, 6, n).
        step: Newton's last step over the condition; above `POLISHED` there is no solution.
    """

    times: Array
    poses: Poses
    angles: Real
    jacobian: Array
    inverse: Array
    v: Real
    a: Real
    step: Array

    @property
    def condition(self) -> Array:
        """Return the condition of the inverse, shape (n,)."""
        return condition(self.inverse)

    def at(self, lanes: Any) -> Solved:
        """Return some of the samples, as often as they are named."""
        parts = {
            name: np.take(getattr(self, name), lanes, axis) for name, axis in LANE_AXES.items()
        }
        return Solved(poses=self.poses.at(lanes), **parts)

    @staticmethod
    def join(parts: Sequence[Solved]) -> Solved:
        """Return the samples of all parts."""
        u, q = zip(*((part.poses.u, part.poses.q) for part in parts), strict=True)
        poses = Poses(np.concatenate(u, -1), np.concatenate(q, -1))
        arrays = {
            name: np.concatenate([getattr(part, name) for part in parts], axis)
            for name, axis in LANE_AXES.items()
        }
        return Solved(poses=poses, **arrays)


LANE_AXES = {"times": 0, "jacobian": 0, "inverse": 0, "step": 0, "angles": -1, "v": -1, "a": -1}
"""Axis of the samples in each array of `Solved`."""


def condition(inverse: Array) -> Array:
    """Return the largest displacement of any unknown [units, rad] per unit error of each row, shape
    (n,).
    """
    return np.maximum(1.0, np.abs(inverse).sum(axis=2).max(axis=1))


def inverses(jacobian: Array) -> Array:
    """Return the inverses, or the pseudo-inverses for redundant rows; NaN if there is none."""
    finite = np.isfinite(jacobian).all(axis=(1, 2), keepdims=True)
    sound = np.where(finite, jacobian, 0.0)
    try:
        if jacobian.shape[1] == jacobian.shape[2]:
            found = np.linalg.inv(sound)
        else:  # full column rank: five times faster than with singular values
            q, r = np.linalg.qr(sound)
            found = np.linalg.inv(r) @ np.moveaxis(q, 1, 2)
    except np.linalg.LinAlgError:  # some matrix is singular; the others have inverses
        found = np.linalg.pinv(sound, rcond=RANK)
    return np.where(finite, found, np.nan)


def changes(old: Solved, new: Solved) -> tuple[Array, Array]:
    """Return the change of J from samples to others, in all directions and along the step; infinite
    beyond a gap.
    """
    product = old.inverse @ new.jacobian
    turned = np.linalg.slogdet(product)[0] <= 0.0
    product -= np.eye(product.shape[1])
    whole = np.abs(product).sum(axis=2).max(axis=1)
    p, q = old.poses.q, new.poses.q
    # the vector part of q p*: half of a small turn from p to q
    half = p[:, :1] * q[:, 1:] - q[:, :1] * p[:, 1:] - cross(q[:, 1:], p[:, 1:])
    step = np.concatenate([new.poses.u - old.poses.u, 2.0 * half], axis=1)[1:]
    way = step.reshape(-1, len(product)).T[..., None].astype(np.float64)
    back = (new.inverse @ (old.jacobian - new.jacobian)) @ way
    longest, bent, behind = (np.abs(each).max(axis=(1, 2)) for each in (way, product @ way, back))
    along = np.divide(
        np.maximum(bent, behind), longest, out=np.zeros_like(bent), where=longest > 0.0
    )
    return np.where(turned, np.inf, whole), np.where(turned, np.inf, along)


class System:
    """The equations of a case and its driver inputs."""

    def __init__(self, case: Case) -> None:
        self.case, self.mechanism = case, case.mechanism
        self.rows, self.path = Rows(case.mechanism), case.sweep.path
        self.names = [driver.name for driver in self.mechanism.drivers]
        self.driving = {
            d.joint: k for k, d in enumerate(self.mechanism.drivers) if isinstance(d, JointAngle)
        }

    def drives(self, times: Array) -> Real:
        """Return value, velocity and acceleration of all drivers [SI], shape (3, drivers, n)."""
        return extended(self.path.drive(self.names, times))

    def sampled(self, samples: Indices) -> Real:
        """Return the drives at samples of the sweep, with the given swept values."""
        found, sweep = self.drives(self.path.times[samples]), self.case.sweep
        if sweep.driver in self.names:
            found[0, self.names.index(sweep.driver)] = extended(sweep.change[samples])
        return found

    def solved(self, poses: Poses, drives: Real, times: Array, near: Real) -> Solved:
        """Return solutions and their rates by Newton's iteration from nearby poses.

        Args:
            near: nearby angles of the turns [rad], shape (turns, n); driven angles replace them.
        """
        rows, near = self.rows, near.copy()
        for k, joint in enumerate(rows.turning):
            if joint in self.driving:
                near[k] = drives[0, self.driving[joint]]
        inverse = inverses(rows.jacobian(poses, near))
        last, largest = np.full(poses.samples, np.inf), np.inf
        for _ in range(MOST_STEPS):
            residual = rows.residual(poses, drives[0], near)
            step = -_times(inverse, residual)
            size = np.abs(step).max(axis=1)
            # a step that turns a body over is no correction of a nearby pose
            good = np.isfinite(size) & (size < 1.0)
            step[~good] = 0.0
            last = np.where(good, size / condition(inverse), np.inf)
            poses = poses.moved(by_body(step))
            if (last[good] <= 1e-3 * POLISHED).all() or not good.any():
                break
            before, largest = largest, float(size[good].max())
            # else the old J still gains at least three digits per step
            if largest > 1e-5 or largest > 1e-3 * before:
                inverse = inverses(rows.jacobian(poses, near))
        jacobian = rows.jacobian(poses, near)
        inverse = inverses(jacobian)
        forced = np.zeros((2, len(rows.owners), poses.samples), dtype=np.longdouble)
        for k, (row, size) in enumerate(rows.driven):
            forced[:, row] = size * drives[1:, k]
        v = by_body(_times(inverse, forced[0]))
        a = by_body(_times(inverse, forced[1] - rows.beyond(poses, v, near)))
        angles = nearest_turn(rows.angles(poses), near)
        return Solved(times, poses, angles, jacobian, inverse, v, a, last)

    def design(self) -> Solved:
        """Return the design position with the rates of the path."""
        start = np.zeros(1)
        near = np.zeros((len(self.rows.turning), 1), dtype=np.longdouble)
        poses = Poses.design(len(self.rows.bodies), 1)
        return self.solved(poses, self.drives(start), start, near)

    def knots(self, stop: float) -> tuple[Solved | None, float | None]:
        """Return the knots from the design to a time, as far as the path goes, and the time of the
        fold [s] if the path ends at one; no knots if the design does not close.
        """
        found, h, fold = [self.design()], stop * FIRST_PART, None
        if not found[0].step[0] <= POLISHED:
            return None, None
        while (at := found[-1]).times[0] != stop:
            ahead = float(at.times[0]) + h
            times = np.array([stop if abs(ahead) >= abs(stop) * (1.0 - SMALLEST_PART) else ahead])
            dt = times[0] - at.times[0]
            guess = at.poses.moved(dt * (at.v + 0.5 * dt * at.a))
            new = self.solved(guess, self.drives(times), times, at.angles)
            changed = np.inf
            if new.step[0] <= POLISHED:
                whole, along = changes(at, new)
                changed = float(whole[0] if abs(dt) > SMALL_PART * abs(stop) else along[0])
            if changed <= LARGEST_CHANGE:
                found.append(new)
                h = float(np.clip(0.6 * LARGEST_CHANGE / max(changed, 1e-9), 0.5, 2.0)) * dt
                h = min(abs(h), abs(stop) * FIRST_PART) * np.sign(stop)
            elif abs(dt) <= SMALLEST_PART * abs(stop):
                fold = _fold(at, found[max(0, len(found) - 1 - ROOT_KNOTS)], stop)
                break
            else:
                h = 0.5 * dt
        return Solved.join(found), fold

    def interpolate(self, knots: Solved, samples: Indices) -> Solved:
        """Return samples of the sweep on the path through the knots; the step is infinite if J
        changes too much from the nearer knot.
        """
        times, at = self.path.times[samples], knots.times
        left = np.clip(np.searchsorted(np.abs(at), np.abs(times), side="right") - 1, 0, len(at) - 2)
        span = at[left + 1] - at[left]
        s = extended((times - at[left]) / span)

        def cubic(values: Real, slopes: Real) -> Real:
            """Return Hermite's polynomial through values and rates of both knots."""
            s2, s3 = s * s, s * s * s
            return (
                values[..., left] * (2.0 * s3 - 3.0 * s2 + 1.0)
                + slopes[..., left] * (span * (s3 - 2.0 * s2 + s))
                + values[..., left + 1] * (3.0 * s2 - 2.0 * s3)
                + slopes[..., left + 1] * (span * (s3 - s2))
            )

        near = knots.angles[:, left] + s * (knots.angles[:, left + 1] - knots.angles[:, left])
        u, q = knots.poses.u, knots.poses.q
        q = cubic(q, 0.5 * spun(knots.v[:, 3:], q))
        poses = Poses(cubic(u, knots.v[:, :3]), q / np.sqrt((q * q).sum(axis=1, keepdims=True)))
        found = self.solved(poses, self.sampled(samples), times, near)
        changed = changes(knots.at(left + (s > 0.5)), found)[1]
        return replace(found, step=np.where(changed <= LARGEST_CHANGE, found.step, np.inf))


def _fold(at: Solved, earlier: Solved, stop: float) -> float | None:
    """Return the time at which the motion turns back [s]; None if the rates show no fold.

    Near a fold the unknowns follow the root of the remaining time tau, so v / 2a = tau, and v times
    the root of tau is constant. At other singular poses, such as a bifurcation, the rates stay
    finite and the motion passes.
    """
    k = int(np.abs(at.a).argmax())
    v, a = float(at.v.ravel()[k]), float(at.a.ravel()[k])
    left = v / (2.0 * a) if a else np.inf
    # the last step was refused as too large a fraction of the remaining time
    if not 0.0 < left * np.sign(stop) <= 64.0 * SMALLEST_PART * abs(stop):
        return None
    fold = float(at.times[0]) + left
    by_root = float(earlier.v.ravel()[k]) * abs(fold - float(earlier.times[0])) ** 0.5
    return fold if 0.5 <= by_root / (v * abs(left) ** 0.5) <= 2.0 else None


def _times(inverse: Array, rows: Real) -> Array:
    """Return the inverses times values of the rows, (rows, n), shape (n, unknowns)."""
    return (inverse @ rows.T[..., None].astype(np.float64))[..., 0]


def by_body(unknowns: Array) -> Real:
    """Return unknowns of samples, shape (n, unknowns), by body, the ground's first, shape
    (bodies + 1, 6, n).
    """
    moving = extended(unknowns).T.reshape(-1, 6, len(unknowns))
    return np.concatenate([np.zeros_like(moving[:1]), moving])


# The reference

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


def follow_motion(case: Case) -> Truth:
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
            solved = system.interpolate(knots, chunk) if len(at) > 1 else knots.at(0 * chunk)
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
        if not condition(inverses(system.rows.jacobian(poses)))[0] < UNPOLISHED:
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


def point_motion(
    rows: Rows, found: Solved, body: int, position: Sequence[float]
) -> tuple[Real, Real]:
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
    arm, motion = point_motion(rows, found, body, point.position)
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
