"""The drivers' way from the design to samples far apart, solved at further samples.

A pose gives an angle or an attitude but for whole turns, and samples far apart do not tell how many
lie between them. The drivers' way is then solved at further samples, so near to each other that the
rates tell.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Protocol, TypeAlias

import numpy as np

from ..caches import keep_last
from ..errors import SolveError
from ..mechanism.mechanism import Mechanism
from ..mechanism.motions import Path
from ..trajectory import Array, Trajectory
from .compiled.motion_start import start_of
from .compiled.request import Request
from .formulation.constraints import size_of

Prepare: TypeAlias = Callable[[Mechanism, Request, Path], Callable[[float], Trajectory]]
"""Makes a mechanism ready to be solved along a path, to a tolerance."""

# Way of the drivers between two samples [rad, or half the mechanism's size]: as far as turns are
# read from the samples alone, and in the parts of longer ways, finer from one try to the next.
NEAR, PARTS = 0.5, (0.25, 0.05, 0.01)
# A change that differs from what the rates tell by more might be another number of turns [rad].
DOUBT = 0.5 * math.pi
# More samples than these would take long, and such a sweep has passed no turn unseen.
MOST = 200_000
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
        """Return the names of the bodies it reads, of those that move."""
        ...

    def counted(
        self, mechanism: Mechanism, times: Array, motion: Trajectory, start: float, at: Array
    ) -> tuple[Array, bool]:
        """Return the value at each sample, counted both ways from the value `at` the start and NaN
        if not reached, and whether no change is in doubt.
        """
        ...


def near_design(mechanism: Mechanism, path: Path) -> bool:
    """Return whether the drivers go from the design to all samples in short steps."""
    times = path.times[np.isfinite(path.times)]
    if not len(times):
        return True
    start = start_of(mechanism, path)
    # turns are read from samples as if the design were at time zero
    if not start.stands or start.time != 0.0:
        return False
    return bool(_way(mechanism, path, _sorted(path, start.time)).max(initial=0.0) <= NEAR)


def followed(prepare: Prepare, mechanism: Mechanism, path: Path, what: Followed) -> Array | None:
    """Return values at the samples of a path, turns counted on the way from the design; NaN if a
    sample is not reached or its turns are in doubt.

    None if the native solver has no solution of the mechanism.

    Args:
        prepare: makes the mechanism ready for a path.
    """
    # motions of other classes may change, or have no hash
    return (_recent if path.is_builtin else _finer)(prepare, mechanism, path, what)


def _finer(prepare: Prepare, mechanism: Mechanism, path: Path, what: Followed) -> Array | None:
    found: Array | None = None
    for part in PARTS:
        try:
            found, sure = _followed(prepare, mechanism, path, what, part)
        except SolveError:
            return None
        if sure:
            break
    return found


_recent = keep_last(32)(_finer)


def _followed(
    prepare: Prepare, mechanism: Mechanism, path: Path, what: Followed, part: float
) -> tuple[Array, bool]:
    """Return the values by further samples, and whether no number of turns is in doubt."""
    start = start_of(mechanism, path)
    times = _divided(mechanism, path, _sorted(path, start.time), part)
    # the samples first: they decide where the motion starts
    fine = replace(path, times=np.concatenate([path.times, times]))
    motion = _motion(prepare, mechanism, fine, what)
    taken = motion.details.get("start", {"time": 0.0, "lead": {}})
    at_start, sure = what.at_design, True
    if any(taken["lead"].values()):
        lead = path.lead_in(taken["time"])
        lead = replace(lead, times=_divided(mechanism, lead, np.array([0.0, 1.0]), part))
        led = _motion(prepare, mechanism, lead, what)
        values, sure = what.counted(mechanism, lead.times, led, 0.0, at_start)
        at_start = np.asarray(values[-1])
    found, certain = what.counted(mechanism, fine.times, motion, taken["time"], at_start)
    return found[: len(path.times)], sure and certain


def _motion(prepare: Prepare, mechanism: Mechanism, path: Path, what: Followed) -> Trajectory:
    request = Request(tuple(path.motions), (), what.bodies(mechanism), 1)
    return prepare(mechanism, request, path)(TOL)


def _sorted(path: Path, start: float) -> Array:
    """Return the times of samples and start, increasing."""
    return np.unique([start, *path.times]) if path.covers(start) else np.unique(path.times)


def _way(mechanism: Mechanism, path: Path, times: Array) -> Array:
    """Return the way of the drivers between increasing times [rad, or half the mechanism's size]:
    the longest of any driver, shape (n - 1,).
    """
    if len(times) < 2 or not path.motions:
        return np.zeros(max(len(times) - 1, 0))
    turning = [mechanism.driver(name).turns for name in path.motions]
    scale = np.where(turning, 1.0, 0.5 * size_of(mechanism))
    share = np.linspace(0.0, 1.0, AMONG + 1)
    between = times[:-1, None] + np.diff(times)[:, None] * share
    values = path.values(between.ravel()).reshape(len(scale), *between.shape)
    ways: Array = np.abs(np.diff(values, axis=-1)).sum(axis=-1) / scale[:, None]
    return ways.max(axis=0)


def _divided(mechanism: Mechanism, path: Path, times: Array, part: float) -> Array:
    """Return increasing times with further ones between them, so that drivers go a part at most."""
    parts = np.ceil(_way(mechanism, path, times) / part).clip(1.0)
    if parts.sum() > MOST:
        parts = np.ceil(parts * (MOST / parts.sum()))
    pieces: list[Array] = [
        np.linspace(low, high, int(count), endpoint=False)
        for low, high, count in zip(times[:-1], times[1:], parts, strict=True)
    ]
    return np.concatenate([*pieces, times[-1:]])
