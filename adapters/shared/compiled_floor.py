"""A simulator's floor: the time of its compiled code for a sample, without the Python around it.

Each call of the projection mode into the simulator is timed on the case's model and on the
smallest model there is; the difference is the compiled work, the rest is Python and its binding. A
linear system is timed as LAPACK's LU of as many rows as there are unknowns, less the time of one
row, also if the adapter needs least squares. Nothing else counts: no residual test, no predictor,
no copying. So a floor is below what any loop around these calls can reach, in whatever language.
"""

from __future__ import annotations

import importlib
import timeit
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ...core.harness.engine import Floor
from ...core.trajectory import Trajectory

# Rounds of calls; the fastest one counts, so that interruptions do not. A round is long against the
# clock's resolution.
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
        pose: calls for the residual and Jacobian of a pose: by name, on the case's model, on the
            smallest, and how many.
        rates: further calls once a sample, for velocities and accelerations.
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
    # the adapter's last step only confirms; the pose before it stands for the one that gives the
    # Jacobian of the rates
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
    """Return the time of a call less the time on the smallest model [us]."""
    fastest = [min(timeit.repeat(each, number=CALLS, repeat=ROUNDS)) for each in (call, least)]
    return max(0.0, 1e6 * (fastest[0] - fastest[1]) / CALLS)
