"""A simulator's floor: the time of its compiled code for a sample, without the surrounding Python.

Each call of the projection mode into the simulator is timed on the case's model and on the smallest
possible model; the difference is the compiled work, and the rest is Python and its binding. A
linear system is timed as LAPACK's LU with as many rows as unknowns, minus the time of one row, even
if the adapter needs least squares. Residual tests, predictor and copying do not count. So no loop
around these calls is faster than the floor, in any language.
"""

from __future__ import annotations

import importlib
import timeit
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...core.harness.engine import Floor
from ...core.trajectory import Trajectory

# Rounds of calls; the fastest round counts, so that interruptions do not matter. A round is long
# against the clock's resolution.
ROUNDS = 15
CALLS = 200

Call = Callable[[], Any]


def floor_of(
    engine: str,
    solved: Trajectory,
    unknowns: int,
    pose: Mapping[str, tuple[Call, Call, int]],
    rates: Mapping[str, tuple[Call, Call, int]],
) -> Floor:
    """Return the floor of Newton's method with the iterations of a solved trajectory.

    Args:
        engine: name of the engine.
        pose: calls for the residual and Jacobian of a pose, by name: on the case's model, on the
            smallest model, and their number.
        rates: further calls once per sample, for velocities and accelerations.
    """
    large, small = (np.eye(n) + 0.1 * np.ones((n, n)) for n in (unknowns, 1))
    lapack: Any = importlib.import_module("scipy.linalg.lapack")
    solve = {
        f"LU of {unknowns} rows": (
            lambda: lapack.dgesv(large, large[0]),
            lambda: lapack.dgesv(small, small[0]),
            1,
        )
    }
    # the adapter's last step only confirms convergence; the pose before it counts as the pose for
    # the Jacobian of the rates
    poses = float(solved.iterations[solved.solved].mean())
    counts = {**dict.fromkeys([*pose, *solve], poses), **dict.fromkeys(rates, 1.0)}
    parts = {
        name: counts[name] * each * microseconds(call, least)
        for name, (call, least, each) in {**pose, **solve, **rates}.items()
    }
    counted = (
        f"{engine}: {poses:.3g} poses ({', '.join([*pose, *solve])}) and once"
        f" {', '.join(rates)}; the fastest of {ROUNDS} rounds, less the same calls on the smallest"
        " model"
    )
    return Floor(sum(parts.values()), counted, parts)


def microseconds(call: Call, least: Call) -> float:
    """Return the time of a call minus the time on the smallest model [us]."""
    fastest = [min(timeit.repeat(each, number=CALLS, repeat=ROUNDS)) for each in (call, least)]
    return max(0.0, 1e6 * (fastest[0] - fastest[1]) / CALLS)
