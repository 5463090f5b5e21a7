"""Over a singular pose of a cascade, as `bridge` does it for one program: eight poses beside it and
the last one before it are on one smooth curve, or the motion is not known to go on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...mechanism.motions import Path
from ...trajectory import Array
from ..compiled.request import accept_by
from ..continuation.singular_crossing import COVERED, EIGHT, NODES, PLACES, SIX
from ..continuation.step_halving import longest
from .component_lanes import Lanes

# Nothing is interpolated here: it is enough to see that there is one curve, and other assemblies
# are farther off.
SMOOTH = 1e-7
# Number of the first of the eight that is beyond, halvings of a step to one of them, and how many
# parts it is gone in at most.
BEYOND, HALVED, MOST = 4, 8, 64
# The last pose before is followed to where rounding leaves rates uncertain by a hundredth: itself
# by this.
NEARLY = 1e-7


def cross(
    lanes: Lanes,
    path: Path,
    sound: Sequence[Array],
    start: float,
    here: float,
    aim: float,
    tol: float,
) -> float | None:
    """Take the pose before the lanes over a singular pose; return its time beyond, or None if it
    stays.

    Args:
        lanes: predicted from the last pose before the singular one.
        sound, start: the last sound pose before the lanes, and its time.
        here, aim: time of the last pose, and of a sample out of reach from there.
    """
    near, stands = lanes.anchor, lanes.stands()
    lanes.anchor = sound
    speed = float(np.abs(lanes.stands(rates=True)).max())
    for node in NODES if speed > 0.0 else ():
        lanes.anchor = sound
        times = here + np.copysign(node / speed, aim - here) * PLACES
        found = _eight(lanes, path, start, times, tol)
        if found is not None and _smooth(*found, stands):
            lanes.accept_by(accept_by(tol))
            return float(times[-1])
    lanes.anchor = near
    lanes.accept_by(accept_by(tol))
    return None


def _eight(
    lanes: Lanes, path: Path, start: float, times: Array, tol: float
) -> tuple[Array, Array] | None:
    """States and rates at eight times, a singular pose between the fourth and the fifth; then it
    goes on there.
    """
    found, here = list[tuple[Array, Array]](), start
    for k, time in enumerate(times.tolist()):
        lanes.accept_by(accept_by(tol, crossing=k == BEYOND))
        if not _reach(lanes, path, here, time):
            return None
        found.append((lanes.kept()[:, 0], lanes.kept(rates=True)[:, 0]))
        lanes.carry(0)
        here = time
    state, rates = (np.stack(each, axis=1) for each in zip(*found, strict=True))
    return state, rates


def _reach(lanes: Lanes, path: Path, here: float, time: float) -> bool:
    """Solve at a time as lane 0, by parts of the step if needed."""
    for _ in range(MOST):
        parts: Array = here + (time - here) * 0.5 ** np.arange(0.0, HALVED)
        part = longest(lanes.attempt(parts, path))
        if part is None:
            return False
        if part == 0:
            return True
        lanes.carry(part)
        here = float(parts[part])
    return False


def _smooth(state: Array, rates: Array, near: Array) -> bool:
    off = [
        float(np.abs(x @ (EIGHT - SIX)).max() / max(1.0, np.abs(x).max())) for x in (state, rates)
    ]
    known = COVERED * np.abs(state @ (EIGHT - SIX)) + NEARLY
    return max(off) <= SMOOTH and bool((np.abs(state @ EIGHT - near) <= known).all())
