"""The floor of Simbody: its calls of the projection mode."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ...core.case.case import Case
from ...core.mechanism.motions import PointCoordinate
from ..floors.floors import LEAST, Call, CountedCalls, Floor, floor_of
from .simbody import SimbodyModel


def floor(engine: Any, case: Case) -> Floor:
    """Return the floor of Simbody."""
    return floor_of(engine, case, _counted)


def _counted(engine: Any, model: Any, case: Case) -> CountedCalls:
    """Return Simbody's stages and its calls for constraints and points."""
    least = engine.model_of(replace(case, mechanism=LEAST, outputs=()))
    driven = sum(isinstance(each, PointCoordinate) for each in case.mechanism.drivers)
    points = len(model.wanted)
    poses = {"realizePosition": 1, "calcG": 1, "calcFrameJacobian": driven}
    rates = {
        "realizeVelocity": 2,
        "calcBiasForAccelerationConstraints": 1,
        "calcBiasForFrameJacobian": driven,
        "calcStationJacobian": points,
        "calcBiasForStationJacobian": points,
    }
    return CountedCalls(_calls(model), _calls(least), poses, rates)


def _calls(of: SimbodyModel) -> Mapping[str, Call]:
    """Return the calls of the projection mode into Simbody, by name."""
    whole, matter, state, J, b = of.model, of.matter, of.state, of.matrix, of.column
    q, u = (of.o.Vector.createFromMat(np.zeros(n)) for n in (of.slots, of.unknowns))
    body, point = of.make_frame(1, np.zeros(3))
    at = body.getMobilizedBodyIndex(), point
    return {
        "realizePosition": lambda: (state.setQ(q), whole.realizePosition(state)),
        "realizeVelocity": lambda: (state.setU(u), whole.realizeVelocity(state)),
        "calcG": partial(matter.calcG, state, J),
        "calcBiasForAccelerationConstraints": partial(
            matter.calcBiasForAccelerationConstraints, state, b
        ),
        "calcFrameJacobian": partial(matter.calcFrameJacobian, state, *at, J),
        "calcBiasForFrameJacobian": partial(matter.calcBiasForFrameJacobian, state, *at),
        "calcStationJacobian": partial(matter.calcStationJacobian, state, *at, J),
        "calcBiasForStationJacobian": partial(matter.calcBiasForStationJacobian, state, *at),
    }
