"""A case as equations in extended precision: polished samples, rates, condition, and the path from
the design.

The path is followed independently of the engines' predictors. A step dx from one knot to the next
is accepted if the norm of row sums of J0^-1 J1 - I is less than a half. The simplified iteration
from the knot then contracts all along the step, so its solution continues the motion
(Newton-Kantorovich). Near a singular pose this would need steps as small as the smallest singular
value. A small step is therefore accepted under two weaker conditions. (J0^-1 J1 - I) dx must be
less than a half of dx, seen from both ends. And det(J0^-1 J1) must be positive: beyond a gap
between two solutions it is negative. Samples between two knots are interpolated, polished, and
tested under the same conditions from the nearer knot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...case.case import Case
from ...mechanism.motions import JointAngle
from ...trajectory import Array
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
        first = {name: getattr(self, name)[lanes] for name in LANES_FIRST}
        last = {name: getattr(self, name)[..., lanes] for name in LANES_LAST}
        return Solved(poses=self.poses.at(lanes), **first, **last)

    @staticmethod
    def joined(parts: Sequence[Solved]) -> Solved:
        """Return the samples of all parts."""

        def lanes(names: Sequence[str], axis: int, of: Sequence[Any]) -> dict[str, Any]:
            return {name: np.concatenate([getattr(x, name) for x in of], axis) for name in names}

        poses = Poses(**lanes(("u", "q"), -1, [part.poses for part in parts]))
        return Solved(poses=poses, **lanes(LANES_FIRST, 0, parts), **lanes(LANES_LAST, -1, parts))


LANES_FIRST = ("times", "jacobian", "inverse", "step")
LANES_LAST = ("angles", "v", "a")


def condition(inverse: Array) -> Array:
    """Return the largest displacement of any unknown [units, rad] per unit error of each row, shape
    (n,).
    """
    return np.maximum(1.0, np.abs(inverse).sum(axis=2).max(axis=1))


def inverted(jacobian: Array) -> Array:
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
        inverse = inverted(rows.jacobian(poses, near))
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
                inverse = inverted(rows.jacobian(poses, near))
        jacobian = rows.jacobian(poses, near)
        inverse = inverted(jacobian)
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
        return Solved.joined(found), fold

    def between(self, knots: Solved, samples: Indices) -> Solved:
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
