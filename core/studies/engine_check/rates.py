"""Check of an engine's velocities and accelerations against differences of its positions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from ...case.case import TIME, Case
from ...harness.record import OutputSeries, Record
from ...trajectory import QUANTITIES, Array
from ..findings import Finding, Verdict
from ..joint_check.loop import WEIGHTS, differences

NOISE = 1e-9
"""Error of the compared values relative to the largest: a thousand times the residual tolerance."""
RATES_WHY = "over the change of the differences with a doubled step"


def rates(solved: Sequence[tuple[Case, Record]]) -> Iterator[Finding]:
    """Yield the worst defect of velocity and of acceleration over all cases.

    Only uniform sweeps of one driver count: others have motions with corners.
    """
    for before, after in pairwise(QUANTITIES):
        worst, where, compared = 0.0, "", 0
        for case, record in solved:
            dt = _step(case)
            if dt is None or record.solved != record.samples:
                continue
            for name, output in record.outputs.items():
                share = _share(output, before, after, dt)
                compared += share is not None
                if share is not None and share > worst:
                    worst, where = share, f"{case.name}: {name}"
        if not compared:
            yield Finding(f"rates: {after}", Verdict.SKIP, message="the engine gives none")
            continue
        verdict = Verdict.PASS if worst <= 1.0 else Verdict.FAIL
        message = "" if worst <= 1.0 else f"is not the rate of its {before}"
        yield Finding(f"rates: {after}", verdict, worst, 1.0, RATES_WHY, row=where, message=message)


def _step(case: Case) -> float | None:
    """Return the time between samples [s]; None if the sweep is short, uneven or has several
    drivers.
    """
    steps = np.diff(case.sweep.path.times)
    if case.sweep.driver == TIME or case.sweep.motions or len(steps) < 3 * len(WEIGHTS):
        return None
    even = np.allclose(steps, steps[0], rtol=1e-9, atol=0.0)
    return float(steps[0]) if even else None


def _share(output: OutputSeries, before: str, after: str, dt: float) -> float | None:
    """Return the defect of a rate over its limit; None if there is nothing to compare."""
    values, found = getattr(output, before), getattr(output, after)
    if values is None or found is None or None in values or None in found:
        return None
    position, rate = np.array(values, dtype=np.float64), np.array(found, dtype=np.float64)
    slopes, coarse = differences(position, dt), differences(position[::2], 2.0 * dt)
    noise = NOISE * (float(np.abs(position).max()) + abs(dt)) / abs(dt)
    limit = float(np.abs(coarse - _beside(slopes, coarse)).max()) + noise
    return float(np.abs(slopes - rate[3:-3]).max()) / limit


def _beside(slopes: Array, coarse: Array) -> Array:
    """Return the fine differences at the samples of the coarse differences."""
    return slopes[3::2][: len(coarse)]
