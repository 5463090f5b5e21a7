"""A lower bound of an engine's time per sample: the calls into its simulator, timed one by one."""

from __future__ import annotations

import importlib
import timeit
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from ...core.case.case import Case
from ...core.joints import Translational
from ...core.mechanism.mechanism import GROUND, Body, Mechanism, Point
from ...core.mechanism.motions import PointCoordinate

# The smallest model: one slide with a driven point, so one frame in a condition.
LEAST = Mechanism(
    "slide",
    [Body("slide")],
    [Translational("rail", GROUND, "slide", point=(0.0, 0.0, 0.0), axis=(1.0, 0.0, 0.0))],
    [Point("slide", "slide", (1.0, 0.0, 0.0))],
    [PointCoordinate("stroke", "slide", (1.0, 0.0, 0.0))],
)

# Rounds of calls; the fastest round counts, so that interruptions do not matter. A round is long
# against the clock's resolution.
ROUNDS = 15
CALLS = 200

Call = Callable[[], Any]


@dataclass(frozen=True)
class CountedCalls:
    """The calls of the projection mode into a simulator, by name.

    Attributes:
        own, least: on the case's model, and on the smallest possible one.
        poses: how many there are for the residual and Jacobian of a pose.
        rates: how many more once per sample, for velocities and accelerations.
    """

    own: Mapping[str, Call]
    least: Mapping[str, Call]
    poses: Mapping[str, int]
    rates: Mapping[str, int]


def _microseconds(call: Call) -> float:
    return 1e6 * min(timeit.repeat(call, number=CALLS, repeat=ROUNDS)) / CALLS


CallsOf: TypeAlias = Callable[[Any, Any, Case], CountedCalls]
"""Counted calls of an engine, for its model and the case."""


@dataclass(frozen=True)
class Floor:
    """A lower bound of an engine's time per sample.

    Attributes:
        us_per_sample: the sum of the parts [us].
        counted: description of the counted parts and of the method.
        parts: time of each part [us].
    """

    us_per_sample: float
    counted: str
    parts: Mapping[str, float]


def floor_of(engine: Any, case: Case, calls_of: CallsOf) -> Floor:
    """Return the time of the simulator's compiled code for a sample, by Newton's method with
    the iterations of the solved case.
    """
    model = engine.model_of(engine.scaled_case(case))
    solved = engine.solve(model, case, 1e-12)
    calls = calls_of(engine, model, case)
    large, small = (np.eye(n) + 0.1 * np.ones((n, n)) for n in (model.unknowns, 1))
    lapack: Any = importlib.import_module("scipy.linalg.lapack")
    linear = f"LU of {model.unknowns} rows"
    own = {**calls.own, linear: lambda: lapack.dgesv(large, large[0])}
    least = {**calls.least, linear: lambda: lapack.dgesv(small, small[0])}
    # the adapter's last step only confirms convergence; the pose before it counts as the pose
    # for the Jacobian of the rates
    poses = float(solved.iterations[solved.solved].mean())
    once = {**calls.poses, linear: 1}
    counts: dict[str, float] = {name: poses * n for name, n in once.items()}
    counts |= calls.rates
    parts = {
        name: count * max(0.0, _microseconds(own[name]) - _microseconds(least[name]))
        for name, count in counts.items()
    }
    counted = (
        f"{engine.name}: {poses:.3g} poses ({', '.join(once)}) and once"
        f" {', '.join(calls.rates)}; the fastest of {ROUNDS} rounds, less the same calls on the"
        " smallest model"
    )
    return Floor(sum(parts.values()), counted, parts)
