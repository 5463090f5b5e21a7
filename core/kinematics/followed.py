"""The angle of a joint and the attitude of a body with their turns, followed along the way of the
drivers from the design.

A pose gives an angle or an attitude but for whole turns, and samples far apart do not tell how many
lie between them. The drivers' way is then solved at further samples, so near to each other that the
rates tell. The Euler parameters e and -e are the same attitude. Along a way from the design the
sign is continuous, so that rotations beyond half a turn differ from those the other way round.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Protocol, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from ..algebra import ZERO, Quat, quat, vec
from ..caches import cache_last
from ..errors import SolveError
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from ..primitives.base import Pose
from ..trajectory import Array, Trajectory
from .compiled.request import Request
from .compiled.routes import start_of
from .forces.reactions import TURN, Follow, expected_change, joint_angle
from .motion_solver import prepare_motion

Indices: TypeAlias = NDArray[np.intp]

# Way of the drivers between two samples [rad, or half the mechanism's size]: as far as turns are
# read from the samples alone, and in the parts of longer ways, finer from one try to the next.
NEAR, PARTS = 0.5, (0.25, 0.05, 0.01)
# A change that differs from what the rates tell by more might be another number of turns [rad].
DOUBT = 0.5 * math.pi
# More samples than these would take long, and such a sweep has passed no turn unseen.
MOST = 200_000
# Poses of bodies that are kept at once, of some hundred bytes each.
MOST_POSES = 500_000
# Places between two samples where the drivers' way is measured.
AMONG = 8
TOL = 1e-9
"""Residual of the further samples: only whole turns are read from them."""


class Followed(Protocol):
    """What is followed, with its turns; hashable.

    Attributes:
        at_design: its value there; values at n samples have the shape (n, *at_design.shape).
    """

    @property
    def at_design(self) -> Array: ...

    def bodies(self, mechanism: Mechanism) -> tuple[str, ...]:
        """Return the names of the bodies it reads, of moving ones."""
        ...

    def count_turns(
        self, mechanism: Mechanism, times: Array, motion: Trajectory, order: Indices
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return the values at ordered samples but for turns, shape (m, ...), the turns between
        them, NaN where any number may be, and where they are in doubt, shape (m - 1,).
        """
        ...

    def turns(self, value: Array, near: Array) -> float:
        """Return the turns that bring a value near to another."""
        ...

    def with_turns(self, values: Array, turns: Array) -> Array:
        """Return values after numbers of turns."""
        ...


def _count_from(
    what: Followed, mechanism: Mechanism, times: Array, motion: Trajectory, start: float, at: Array
) -> tuple[Array, bool]:
    """Return the value at each sample, counted both ways from the value `at` the start and NaN if
    not reached, and whether no change is in doubt.
    """
    found = np.full((len(times), *at.shape), np.nan)
    reached = np.flatnonzero(motion.solved)
    order = reached[np.argsort(times[reached], kind="stable")]
    if not len(order):
        return found, True
    values, changes, doubtful = what.count_turns(mechanism, times, motion, order)
    first = int(np.argmin(np.abs(times[order] - start)))
    turns = np.full(len(order), what.turns(values[first], at))
    turns[first + 1 :] += np.cumsum(changes[first:])
    turns[:first] -= np.cumsum(changes[:first][::-1])[::-1]
    found[order] = what.with_turns(values, turns)
    return found, not doubtful.any()


def _is_builtin(_: Mechanism, path: Path, *__: object) -> bool:
    """Return whether a path may be kept: motions of other classes may change, or have no hash."""
    return path.is_builtin


@cache_last(8, when=_is_builtin)  # asked for each angle and attitude of a motion
def near_design(mechanism: Mechanism, path: Path) -> bool:
    """Return whether the drivers go from the design to all samples in short steps."""
    times = path.times[np.isfinite(path.times)]
    if not len(times) or not path.motions:  # a free motion is known at all its steps
        return True
    start = start_of(mechanism, path)
    # turns are read from samples as if the design were at time zero
    if not start.starts_at_design or start.time != 0.0:
        return False
    return bool(_way(mechanism, path, _sorted_times(path, start.time)).max(initial=0.0) <= NEAR)


@cache_last(32, when=_is_builtin)
def follow_turns(mechanism: Mechanism, path: Path, what: Followed) -> Array | None:
    """Return values at the samples of a path, turns counted on the way from the design; NaN if a
    sample is not reached or its turns are in doubt.

    None if the native solver has no solution of the mechanism.
    """
    found: Array | None = None
    for part in PARTS:
        try:
            found, sure = _follow_in_parts(mechanism, path, what, part)
        except SolveError:
            return None
        if sure:
            break
    return found


def _follow_in_parts(
    mechanism: Mechanism, path: Path, what: Followed, part: float
) -> tuple[Array, bool]:
    """Return the values by further samples, and whether no number of turns is in doubt."""
    fine = _fine(mechanism, path, part)
    motion = _motion(mechanism, fine, what)
    taken = motion.details.get("start", {"time": 0.0, "lead": {}})
    at_start, sure = what.at_design, True
    if any(taken["lead"].values()):
        lead = _lead(mechanism, path, taken["time"], part)
        led = _motion(mechanism, lead, what)
        values, sure = _count_from(what, mechanism, lead.times, led, 0.0, at_start)
        at_start = np.asarray(values[-1])
    found, certain = _count_from(what, mechanism, fine.times, motion, taken["time"], at_start)
    return found[: len(path.times)], sure and certain


# The same samples serve all that is followed along a path.


@cache_last(4, when=_is_builtin)
def _fine(mechanism: Mechanism, path: Path, part: float) -> Path:
    """Return a path with further samples."""
    times = _sorted_times(path, start_of(mechanism, path).time)
    # the samples first: they decide where the motion starts
    return replace(
        path, times=np.concatenate([path.times, _divide_times(mechanism, path, times, part)])
    )


@cache_last(4, when=_is_builtin)
def _lead(mechanism: Mechanism, path: Path, to: float, part: float) -> Path:
    """Return the way from the design to a time of a path, with further samples."""
    lead = path.lead_in(to)
    return replace(lead, times=_divide_times(mechanism, lead, np.array([0.0, 1.0]), part))


def _motion(mechanism: Mechanism, path: Path, what: Followed) -> Trajectory:
    """Return the motion of all bodies, which others ask for next, or if it is long of its own."""
    bodies = tuple(body.name for body in mechanism.moving)
    if len(bodies) * len(path.times) > MOST_POSES:
        bodies = what.bodies(mechanism)
    return _solve_motion(mechanism, path, bodies)


@cache_last(2, when=_is_builtin)
def _solve_motion(mechanism: Mechanism, path: Path, bodies: tuple[str, ...]) -> Trajectory:
    return prepare_motion(mechanism, Request(tuple(path.motions), (), bodies, 1), path)(TOL)


def _sorted_times(path: Path, start: float) -> Array:
    """Return the times of samples and start, increasing."""
    return np.unique([start, *path.times]) if path.covers(start) else np.unique(path.times)


def _way(mechanism: Mechanism, path: Path, times: Array) -> Array:
    """Return the way of the drivers between increasing times [rad, or half the mechanism's size]:
    the longest of any driver, shape (n - 1,).
    """
    if len(times) < 2 or not path.motions:
        return np.zeros(max(len(times) - 1, 0))
    turning = [mechanism.driver(name).turns for name in path.motions]
    scale = np.where(turning, 1.0, 0.5 * mechanism.size)
    share = np.linspace(0.0, 1.0, AMONG + 1)
    between = times[:-1, None] + np.diff(times)[:, None] * share
    values = path.values(between.ravel()).reshape(len(scale), *between.shape)
    ways: Array = np.abs(np.diff(values, axis=-1)).sum(axis=-1) / scale[:, None]
    return ways.max(axis=0)


def _divide_times(mechanism: Mechanism, path: Path, times: Array, part: float) -> Array:
    """Return increasing times with further ones between them, so that drivers go a part at most."""
    parts = np.ceil(_way(mechanism, path, times) / part).clip(1.0)
    if parts.sum() > MOST:
        parts = np.ceil(parts * (MOST / parts.sum()))
    pieces: list[Array] = [
        np.linspace(low, high, int(count), endpoint=False)
        for low, high, count in zip(times[:-1], times[1:], parts, strict=True)
    ]
    return np.concatenate([*pieces, times[-1:]])


def in_doubt(x: Array, v: Array, times: Array) -> bool:
    """Return whether a change from sample to sample contradicts the rates by its turns.

    Args:
        x, v: angle with its turns [rad] and its rate, samples along the first axis; NaN if unknown.
    """
    known = np.isfinite(x).any(axis=tuple(range(1, x.ndim)))
    order = np.flatnonzero(known)[np.argsort(times[known], kind="stable")]
    t, x, v = times[order].reshape(-1, *(1,) * (x.ndim - 1)), x[order], v[order]
    # nothing contradicts what is unknown
    return bool((np.abs(expected_change(v, t) - np.diff(x, axis=0)) > DOUBT).any())


def angle_with_turns(mechanism: Mechanism, path: Path, joint: str) -> Array | None:
    """Return a joint's angle [rad] at the samples of a path, zero at design, turns counted on the
    way from there; shape (n,). See `follow_turns`.
    """
    return follow_turns(mechanism, path, _OfJoint(joint))


def follower(mechanism: Mechanism, path: Path, solved: NDArray[np.bool_]) -> Follow:
    """Return the function that corrects the turns of angles at the solved samples of a path."""

    def follow(joint: str, angle: Array, rate: Array) -> Array:
        if near_design(mechanism, path) and not in_doubt(angle, rate, path.times[solved]):
            return angle
        if (found := angle_with_turns(mechanism, path, joint)) is None:
            return angle
        return angle + TURN * np.round((found[solved] - angle) / TURN)

    return follow


@dataclass(frozen=True)
class _OfJoint:
    """The angle of a joint, shape ()."""

    joint: str

    @property
    def at_design(self) -> Array:
        """Zero."""
        return np.zeros(())

    def bodies(self, mechanism: Mechanism) -> tuple[str, ...]:
        """Return its two, or the one that moves."""
        moving = {body.name for body in mechanism.moving}
        return tuple(name for name in mechanism.joint(self.joint).bodies if name in moving)

    def count_turns(
        self, mechanism: Mechanism, times: Array, motion: Trajectory, order: Indices
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return the angle but for turns; see `Followed`."""
        angle, rate = (x[order] for x in joint_angle(mechanism, self.joint, motion))
        change, expected = np.diff(angle), expected_change(rate, times[order])
        turns, fewest = np.rint((expected - change) / TURN), -np.rint(change / TURN)
        doubtful = np.abs(expected - change - TURN * turns) > DOUBT
        # rates have no bound towards a fold, but short steps change little
        near = np.abs(change + TURN * fewest) <= DOUBT
        turns[doubtful] = np.where(near, fewest, np.nan)[doubtful]
        return angle, turns, doubtful

    def turns(self, value: Array, near: Array) -> float:
        """Return whole turns."""
        return float(np.rint((near - value) / TURN))

    def with_turns(self, values: Array, turns: Array) -> Array:
        """Return the angle with its turns."""
        return values + TURN * turns


DOUBTFUL = float(np.cos(0.5 * DOUBT))
"""Agreement less than this, of either sign, might be another number of turns."""


def attitude_with_turns(mechanism: Mechanism, path: Path, body: str) -> Array | None:
    """Return Euler parameters of a moving body's rotation since design at the samples of a path,
    their sign continuous on the way from there; global axes, shape (n, 4). See `follow_turns`.
    """
    return follow_turns(mechanism, path, _OfBody(body))


def agreement(change: Quat, rate: Array, dt: Array) -> Array:
    """Return the cosine of half the turn from the rotation that the rates tell to a change.

    It is negative if the negative Euler parameters are nearer.

    Args:
        rate: mean angular velocity [rad/s], shape (3, ...); NaN if unknown, taken as rest.
        dt: time of the change [s].
    """
    half = 0.5 * np.nan_to_num(rate) * dt
    size = np.sqrt((half * half).sum(axis=0))
    # sinc(x) is sin(pi x) / (pi x)
    along = vec([*(np.sinc(size / np.pi) * half)])
    found: Array = np.cos(size) * change.e0 + along @ change.e
    return found


@dataclass(frozen=True)
class _OfBody:
    """The Euler parameters of a body's rotation since design, shape (4,)."""

    body: str

    @property
    def at_design(self) -> Array:
        """No rotation."""
        return np.array([1.0, 0.0, 0.0, 0.0])

    def bodies(self, mechanism: Mechanism) -> tuple[str, ...]:
        """Return the body."""
        return (self.body,)

    def count_turns(
        self, mechanism: Mechanism, times: Array, motion: Trajectory, order: Indices
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return the parameters but for their sign, and where it changes; see `Followed`."""
        moved = motion.bodies[self.body]
        assert moved.v is not None
        design = quat(mechanism.body(self.body).euler_parameters)
        pose = quat(moved.p[order].T)
        e = np.array([*(pose * design.conjugate())])
        rate = np.array([*Pose.of(ZERO, pose).turn(vec([*moved.v[order].T[3:]]))])
        change = quat(e[:, 1:]) * quat(e[:, :-1]).conjugate()
        mean = 0.5 * (rate[:, 1:] + rate[:, :-1])
        agrees = agreement(change, mean, np.diff(times[order]))
        smallest = cast("Array", np.asarray(change.e0))
        doubtful = np.abs(agrees) < DOUBTFUL
        # rates have no bound towards a fold, but short steps change little
        turns = np.where(np.where(doubtful, smallest, agrees) < 0.0, 1.0, 0.0)
        turns[doubtful & (np.abs(smallest) < DOUBTFUL)] = np.nan
        return e.T, turns, doubtful

    def turns(self, value: Array, near: Array) -> float:
        """Return one for the other sign."""
        return float(value @ near < 0.0)

    def with_turns(self, values: Array, turns: Array) -> Array:
        """Return the parameters, of the other sign after an odd number of turns."""
        return (1.0 - 2.0 * (turns % 2.0))[:, None] * values
