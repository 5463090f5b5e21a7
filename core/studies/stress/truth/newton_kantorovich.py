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
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ....case.case import Case
from ....mechanism.motions import JointAngle
from ....trajectory import Array
from .conditions import conditions
from .evaluation import Evaluator, Poses, spun
from .long_double import Real, extended
from .solutions import POLISHED, Solved, changes, condition, inverted

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


class System:
    """The equations of a case and its driver inputs."""

    def __init__(self, case: Case) -> None:
        self.case, self.mechanism = case, case.mechanism
        self.rows = Evaluator(conditions(case.mechanism))
        self.path = case.sweep.path
        self.names = [driver.name for driver in self.mechanism.drivers]
        self.driving = {
            d.joint: k for k, d in enumerate(self.mechanism.drivers) if isinstance(d, JointAngle)
        }

    def drives(self, times: Array) -> Real:
        """Return value, velocity and acceleration of all drivers [SI], shape (3, drivers, n)."""
        return extended(self.path.drive(self.names, times))

    def sampled(self, samples: NDArray[np.intp]) -> Real:
        """Return the drives at samples of the sweep, with the given swept values."""
        found = self.drives(self.path.times[samples])
        if self.case.sweep.driver in self.names:
            found[0, self.names.index(self.case.sweep.driver)] = extended(
                self.case.sweep.change[samples]
            )
        return found

    def solved(self, poses: Poses, drives: Real, times: Array, near: Real) -> Solved:
        """Return solutions and their rates by Newton's iteration from nearby poses.

        Args:
            near: nearby angles of the turns [rad], shape (turns, n); driven angles replace them.
        """
        near = self._known(near, drives)
        jacobian = self.rows.jacobian(poses)
        inverse = inverted(jacobian)
        last, largest = np.full(poses.samples, np.inf), np.inf
        for _ in range(MOST_STEPS):
            residual = self.rows.residual(poses, drives[0], near)
            step = -np.matmul(inverse, residual.T[..., None].astype(np.float64))[..., 0]
            size = np.abs(step).max(axis=1)
            # a step that turns a body over is no correction of a nearby pose
            good = np.isfinite(size) & (size < 1.0)
            step[~good] = 0.0
            last = np.where(good, size / condition(inverse), np.inf)
            poses = poses.moved(extended(step).T.reshape(-1, 6, len(step)))
            if (last[good] <= 1e-3 * POLISHED).all() or not good.any():
                break
            before, largest = largest, float(size[good].max())
            # else the old J still gains at least three digits per step
            if largest > 1e-5 or largest > 1e-3 * before:
                jacobian = self.rows.jacobian(poses)
                inverse = inverted(jacobian)
        jacobian = self.rows.jacobian(poses)
        inverse = inverted(jacobian)
        forced = np.zeros((len(inverse), self.rows.stated.rows, 2))
        for k, (row, size) in enumerate(self.rows.stated.driven):
            forced[:, row] = float(size) * drives[1:, k].T.astype(np.float64)
        v = _bodies(inverse @ forced[:, :, :1])
        beyond = self.rows.beyond(poses, v).T[..., None].astype(np.float64)
        a = _bodies(inverse @ (forced[:, :, 1:] - beyond))
        angles = self.rows.angles(poses)
        angles = angles + 2.0 * np.pi * np.rint((near - angles) / (2.0 * np.pi))
        return Solved(times, poses, angles, jacobian, inverse, v, a, last)

    def _known(self, near: Real, drives: Real) -> Real:
        near = near.copy()
        for k, joint in enumerate(self.rows.stated.turning):
            if joint in self.driving:
                near[k] = drives[0, self.driving[joint]]
        return near

    def design(self) -> Solved:
        """Return the design position with the rates of the path."""
        start = np.zeros(1)
        poses = Poses.design(self.rows.bodies, 1)
        return self.solved(
            poses,
            self.drives(start),
            start,
            np.zeros((len(self.rows.stated.turns), 1), dtype=np.longdouble),
        )

    def knots(self, stop: float) -> tuple[list[Solved], float | None]:
        """Return the knots from the design to a time, as far as the path goes, and the time of the
        fold [s] if the path ends at one.
        """
        found, h = [self.design()], stop * FIRST_PART
        if not found[0].step[0] <= POLISHED:
            return [], None
        while (at := found[-1]).times[0] != stop:
            ahead = float(at.times[0]) + h
            times = np.array([stop if abs(ahead) >= abs(stop) * (1.0 - SMALLEST_PART) else ahead])
            dt = times[0] - at.times[0]
            guess = at.poses.moved(dt * (at.v + 0.5 * dt * at.a))
            new = self.solved(guess, self.drives(times), times, at.angles)
            changed = np.inf
            if new.step[0] <= POLISHED:
                whole, along = changes([at], np.zeros(1, dtype=np.intp), new)
                changed = float(whole[0] if abs(dt) > SMALL_PART * abs(stop) else along[0])
            if changed <= LARGEST_CHANGE:
                found.append(new)
                h = float(np.clip(0.6 * LARGEST_CHANGE / max(changed, 1e-9), 0.5, 2.0)) * dt
                h = min(abs(h), abs(stop) * FIRST_PART) * np.sign(stop)
            elif abs(dt) <= SMALLEST_PART * abs(stop):
                return found, _fold(found, stop)
            else:
                h = 0.5 * dt
        return found, None

    def between(self, knots: Sequence[Solved], samples: NDArray[np.intp]) -> Solved:
        """Return samples of the sweep on the path through the knots; the step is infinite if J
        changes too much from the nearer knot.
        """
        times = self.path.times[samples]
        at = np.array([knot.times[0] for knot in knots])
        left = np.clip(np.searchsorted(np.abs(at), np.abs(times), side="right") - 1, 0, len(at) - 2)
        span = at[left + 1] - at[left]
        s = extended((times - at[left]) / span)
        angles = np.stack([knot.angles[:, 0] for knot in knots], axis=1)
        near = angles[:, left] + s * (angles[:, left + 1] - angles[:, left])
        u = _hermite([k.poses.u[..., 0] for k in knots], [_shift(k) for k in knots], left, s, span)
        q = _hermite([k.poses.q[..., 0] for k in knots], [_spin(k) for k in knots], left, s, span)
        q = q / np.sqrt((q * q).sum(axis=1, keepdims=True))
        found = self.solved(Poses(u, q), self.sampled(samples), times, near)
        changed = changes(knots, left + (s > 0.5), found)[1]
        return replace(found, step=np.where(changed <= LARGEST_CHANGE, found.step, np.inf))


def _fold(knots: Sequence[Solved], stop: float) -> float | None:
    """Return the time at which the motion turns back [s]; None if the rates show no fold.

    Near a fold the unknowns follow the root of the remaining time tau, so v / 2a = tau, and v times
    the root of tau is constant. At other singular poses, such as a bifurcation, the rates stay
    finite and the motion passes.
    """
    at, earlier = knots[-1], knots[max(0, len(knots) - 1 - ROOT_KNOTS)]
    k = int(np.abs(at.a).argmax())
    v, a = float(at.v.ravel()[k]), float(at.a.ravel()[k])
    left = v / (2.0 * a) if a else np.inf
    # the last step was refused as too large a fraction of the remaining time
    if not 0.0 < left * np.sign(stop) <= 64.0 * SMALLEST_PART * abs(stop):
        return None
    fold = float(at.times[0]) + left
    by_root = float(earlier.v.ravel()[k]) * abs(fold - float(earlier.times[0])) ** 0.5
    return fold if 0.5 <= by_root / (v * abs(left) ** 0.5) <= 2.0 else None


def _bodies(x: Array) -> Real:
    """Return unknowns of samples, shape (n, unknowns, 1), by body, shape (bodies, 6, n)."""
    return extended(x[..., 0].T.reshape(-1, 6, len(x)))


def _shift(knot: Solved) -> Real:
    return np.concatenate([np.zeros((1, 3), dtype=np.longdouble), knot.v[:, :3, 0]])


def _spin(knot: Solved) -> Real:
    still = np.zeros((1, 3, 1), dtype=np.longdouble)
    return 0.5 * spun(np.concatenate([still, knot.v[:, 3:]]), knot.poses.q)[..., 0]


def _hermite(
    x: Sequence[Real], rates: Sequence[Real], left: NDArray[np.intp], s: Real, span: Array
) -> Real:
    """Return the cubic through values and rates of both knots, shape (bodies, 3 or 4, n)."""
    values, slopes = np.stack(x, axis=-1), np.stack(rates, axis=-1)
    s2, s3 = s * s, s * s * s
    return (
        values[..., left] * (2.0 * s3 - 3.0 * s2 + 1.0)
        + slopes[..., left] * (span * (s3 - 2.0 * s2 + s))
        + values[..., left + 1] * (3.0 * s2 - 2.0 * s3)
        + slopes[..., left + 1] * (span * (s3 - s2))
    )
