"""Velocities caused by some drivers while the others are at rest, for outputs defined as such
derivatives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..case.case import HELD_BUT, Case, size
from ..case.closing import held_case
from ..trajectory import Trajectory

# Largest difference of a pose reached on two paths, over the mechanism's size: larger than any
# tolerance, smaller than the distance of two assemblies.
SAME_POSE = 1e-6


def held_trajectory(
    case: Case, mode: str, found: Trajectory, solve: Callable[[Case], Trajectory]
) -> tuple[Trajectory | None, str]:
    """Return the poses of a trajectory with velocities caused by some drivers while the others are
    at rest, and the reason for missing samples.

    The trajectory is None if no output needs it, or if the engine steps through time: its
    velocities then belong to its own path.

    Args:
        mode: mode of the engine.
        solve: solves another case with the engine.
    """
    by = next((output.facts[HELD_BUT] for output in case.outputs if HELD_BUT in output.facts), None)
    if by is None or mode != "projection":
        return None, ""
    held = solve(held_case(case, by))
    off = [
        np.abs(held.points[name].position - found.points[name].position).max(axis=1)
        for name in case.points
    ]
    same = np.nan_to_num(np.max(off, axis=0), nan=np.inf) <= SAME_POSE * size(case)
    solved = held.solved & same
    lost = int((np.asarray(found.solved) & ~solved).sum())
    why = held.message or "another assembly was found there"
    return (
        replace(held, solved=solved),
        f"no derivative by {' and '.join(by)} at {lost} of {len(same)} samples: {why}"
        if lost
        else "",
    )
