"""Bump steer at design, solved again with an end of the tie rod moved."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...case.case import HELD_BUT, PER_TRAVEL, Case, Hardpoint
from ...case.quantity import Quantity, point_jets, still_jets
from ...errors import SolveError
from ...kinematics import placed, places, solve
from ...mechanism.mechanism import Mechanism
from ...mechanism.motions import Motion, Ramp

REACH = 0.05
"""Longest move of a joint that is advice [m]: the packaging of a car leaves no more."""


def bump_steer(case: Case) -> float | None:
    """Return the slope of toe by travel at design [rad/m]; None without such an output."""
    slope = _slope_of_toe(case)
    return None if slope is None else _solved(case.mechanism, slope, case.sweep.driver)


def left_by_moves(case: Case) -> dict[str, list[float | None]]:
    """Return the bump steer with each move along x, y or z, by row [rad/m]; None for a move out of
    reach, or if the moved table cannot be solved.
    """
    found = dict[str, list[float | None]]()
    if (slope := _slope_of_toe(case)) is None:
        return found
    for row in case.hardpoints:
        if row.no_bump_steer is not None:
            found[row.name] = [
                _solved(_moved(case.mechanism, row, k, move), slope, case.sweep.driver)
                if abs(move) <= REACH
                else None
                for k, move in enumerate(row.no_bump_steer.tolist())
            ]
    return found


def _slope_of_toe(case: Case) -> Quantity | None:
    toes = [f"{x.name}{PER_TRAVEL}" for x in case.outputs if x.facts.get("type") == "toe"]
    return next((x for x in case.outputs if x.name in toes), None)


def _moved(mechanism: Mechanism, row: Hardpoint, axis: int, move: float) -> Mechanism:
    values: Mapping[str, Any] = places(mechanism)
    changed = {
        place: (np.array(values[place]) + move * by[:, axis]).tolist()
        for place, by in row.moves.items()
    }
    return placed(mechanism, changed)


def _solved(mechanism: Mechanism, slope: Quantity, swept: str) -> float | None:
    first, *others = slope.facts.get(HELD_BUT) or (swept,)
    motions: dict[str, Motion] = {name: Ramp(1.0) for name in others}
    try:
        found = solve(mechanism, first, [mechanism.design_value(first)], order=1, motions=motions)
    except SolveError:
        return None
    at = {name: point_jets(found.points[name]) for name in slope.points}
    design = {name: still_jets(mechanism.point(name).position) for name in slope.points}
    with np.errstate(all="ignore"):  # NaN where the sample is not reached
        value = float(np.ravel(slope.of(at, design).x)[0])
    return value if np.isfinite(value) else None
