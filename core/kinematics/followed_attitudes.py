"""The attitude of a body with its turns, followed along the way of the drivers from the design.

The Euler parameters e and -e are the same attitude. Along a way from the design the sign is
continuous, so that rotations beyond half a turn differ from those the other way round.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np

from ..algebra import ZERO, Quat, quat, vec
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from ..primitives.base import Pose
from ..trajectory import Array, Trajectory
from .followed_way import DOUBT, Prepare, followed

DOUBTFUL = float(np.cos(0.5 * DOUBT))
"""Agreement less than this, of either sign, might be another number of turns."""


def followed_attitude(
    prepare: Prepare, mechanism: Mechanism, path: Path, body: str
) -> Array | None:
    """Return Euler parameters of a moving body's rotation since design at the samples of a path,
    their sign continuous on the way from there; global axes, shape (n, 4). See `followed`.
    """
    return followed(prepare, mechanism, path, _OfBody(body))


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

    def counted(
        self, mechanism: Mechanism, times: Array, motion: Trajectory, start: float, at: Array
    ) -> tuple[Array, bool]:
        """Return the parameters with a continuous sign; see `Followed`."""
        found = np.full((len(times), 4), np.nan)
        reached = np.flatnonzero(motion.solved)
        order = reached[np.argsort(times[reached], kind="stable")]
        if not len(order):
            return found, True
        moved = motion.bodies[self.body]
        assert moved.v is not None
        design = quat(mechanism.body(self.body).euler_parameters)
        pose = quat(moved.p[order].T)
        e = np.array([*(pose * design.conjugate())])
        t, spin = times[order], vec([*moved.v[order].T[3:]])
        rate = np.array([*Pose.of(ZERO, pose).turn(spin)])
        change = quat(e[:, 1:]) * quat(e[:, :-1]).conjugate()
        agrees = agreement(change, 0.5 * (rate[:, 1:] + rate[:, :-1]), np.diff(t))
        smallest = cast("Array", np.asarray(change.e0))
        doubtful = np.abs(agrees) < DOUBTFUL
        # rates have no bound towards a fold, but short steps change little
        kept = np.sign(np.where(doubtful, smallest, agrees))
        kept[doubtful & (np.abs(smallest) < DOUBTFUL)] = np.nan
        first = int(np.argmin(np.abs(t - start)))
        sign = np.full(len(order), np.sign(e[:, first] @ at))
        sign[first + 1 :] *= np.cumprod(kept[first:])
        sign[:first] *= np.cumprod(kept[:first][::-1])[::-1]
        found[order] = (sign * e).T
        return found, not doubtful.any()
