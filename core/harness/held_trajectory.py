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


def held_trajectories(
    case: Case, mode: str, found: Trajectory, solve: Callable[[Case], Trajectory]
) -> tuple[dict[tuple[str, ...], Trajectory], str]:
    """Return the poses of a trajectory with velocities caused by some drivers while the others are
    at rest, by these drivers, and the reasons for missing samples.

    There is none if no output needs it, or if the engine steps through time: its velocities then
    belong to its own path.

    Args:
        mode: mode of the engine.
        solve: solves another case with the engine.
    """
    wanted = [tuple(o.facts[HELD_BUT]) for o in case.outputs if HELD_BUT in o.facts]
    held, reasons = dict[tuple[str, ...], Trajectory](), list[str]()
    for by in dict.fromkeys(wanted) if mode == "projection" else ():
        held[by], why = _held(case, by, found, solve)
        reasons += [why] if why else []
    return held, "; ".join(reasons)


def _held(
    case: Case, by: tuple[str, ...], found: Trajectory, solve: Callable[[Case], Trajectory]
) -> tuple[Trajectory, str]:
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
