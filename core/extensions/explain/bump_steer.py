"""Bump steer at design, solved again with an end of the tie rod moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...case.case import HELD_BUT, PER_TRAVEL, Case, Sweep
from ...harness.compare import numbers
from ...mechanism.motions import Ramp
from ..sweep.curves import curves
from ..sweep.varied_places import Geometry

REACH = 0.05
"""Longest move of a joint that is advice [m]: the packaging of a car leaves no more."""


def bump_steer(case: Case) -> tuple[float | None, dict[str, list[float | None]]]:
    """Return the slope of toe by travel at design [rad/m], None without such an output; and the
    slope left with each move along x, y or z, by row, None for a move out of reach, or if the moved
    table cannot be solved.
    """
    toes = [f"{x.name}{PER_TRAVEL}" for x in case.outputs if x.facts.get("type") == "toe"]
    slope = next((x for x in case.outputs if x.name in toes), None)
    if slope is None:
        return None, {}
    ends = {x.name: x.no_bump_steer for x in case.hardpoints if x.no_bump_steer is not None}
    places = [f"{name} {axis}" for name in ends for axis in "xyz"]
    moves = np.concatenate([*ends.values()]) if ends else np.zeros(1)
    far = np.abs(moves) > REACH
    first, *others = slope.facts.get(HELD_BUT) or (case.sweep.driver,)
    design = case.mechanism.design_value(first)
    still = Sweep(first, np.array([design]), 1.0, design, dict.fromkeys(others, Ramp(1.0)))
    offsets = np.vstack([np.zeros_like(moves), np.diag(np.where(far, 0.0, moves))])
    found = curves(
        replace(case, sweep=still),
        places or [next(x.numbers[0] for x in Geometry(case).variables if x.moves)],
        offsets,
        [slope.name],
    )
    now, *left = numbers(np.where([False, *far], np.nan, found.values[slope.name][:, 0]))
    return now, {name: left[3 * k : 3 * k + 3] for k, name in enumerate(ends)}
