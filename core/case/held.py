"""A case on a path for derivatives by single drivers, such as the travel of a wheel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..mechanism.motions import Motion, Waypoints
from ..trajectory import Array
from .case import TIME, Case, Sweep, size

# Displacement of a driver at that rate in the time between two samples, over the mechanism's
# size: small, so that the path between samples goes hardly beyond them.
STEP = 1e-3


def held_case(case: Case, drivers: Sequence[str]) -> Case:
    """Return the case on a path through the same poses, on which these drivers alone move at each
    sample.
    """
    # only ratios of rates count, and those of a path at rest are the same
    sweep = replace(case.sweep, rate=1.0) if case.sweep.static else case.sweep
    path = sweep.path
    times: Array = np.unique([0.0, *path.times]) if path.covers(0.0) else np.unique(path.times)
    shortest = float(np.diff(times).min(initial=1.0))
    rate = STEP * size(case) / shortest
    motions = dict[str, Motion]()
    for name in dict.fromkeys((*path.motions, *drivers)):
        values = path.motions[name].at(times)[0] if name in path.motions else np.zeros_like(times)
        motions[name] = Waypoints(
            tuple(times.tolist()), tuple(values.tolist()), rate if name in drivers else 0.0
        )
    return replace(case, sweep=Sweep(TIME, path.times, motions=motions))
