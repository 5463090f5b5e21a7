"""Proposals of a table to the live page."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...case.case import Case
from ...errors import KincheckError
from .goals import Box, Goal, unit_in_table
from .tune import tune
from .tune_views import headline

STARTS = 3
"""Few starts: a page waits, and shows where the search ends."""


def propose(
    case: Case, bands: Mapping[str, tuple[float, float]], boxes: Mapping[str, float]
) -> tuple[dict[str, float], str]:
    """Return the least moves by place that bring outputs into bands over the whole travel, or come
    nearest [m], and a headline.

    Args:
        bands: ends by output [SI].
        boxes: largest move by place [m].

    Raises:
        KincheckError: there is no such output or place, a band or box is empty, or the table does
            not reach its travel.
    """
    units = {each.name: each.unit for each in case.outputs if not each.forces}
    rows = {f"{each.name} {axis}" for each in case.hardpoints if each.moves for axis in "xyz"}
    if not bands or not boxes:
        raise KincheckError("Set the band of an output, and tick a point that may move.")
    every, goals = np.arange(len(case.sweep.values)), list[Goal]()
    for name, (low, high) in bands.items():
        if name not in units or not low < high:
            raise KincheckError(f"{name}: expected an output of motion, and its low end first.")
        middle, unit = np.full(len(every), (low + high) / 2.0), unit_in_table(units[name], case)
        goals.append(Goal(name, name, unit, every, middle, (high - low) / 2.0))
    for place, size in boxes.items():
        if place not in rows or not size > 0.0:
            raise KincheckError(f"{place}: expected a point that moves the wheel, and a length.")
    found = tune(case, goals, {place: Box(-x, x) for place, x in boxes.items()}, STARTS)
    place, most = max(found.moves.items(), key=lambda each: abs(each[1]))
    unit = unit_in_table("m", case)
    largest = f"largest move {place} {most / unit.size:+.3g} {unit.name}"
    return dict(found.moves), f"{headline(found)}; {largest}"
