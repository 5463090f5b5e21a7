"""Time of outputs of many designs against their kinematics alone, and of slopes by the geometry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ....case.case import Case, without_forces
from ....errors import KincheckError
from ....kinematics import NativeSolver
from ...designs.prepared import prepare_designs
from ...sweep.curves import ReadyCurves, prepare_curves
from .rounds import Spread, Work, take_turns

DESIGNS, SAMPLES, PLACES, SLOPES = 1000, 41, 27, 2
"""Designs and samples of the outputs; places and outputs of the slopes, which are of one design."""
SCATTER, SEED = 1e-3, 943745
"""Standard deviation of the hardpoints [m]."""

SCHEMA = "kincheck-bench-curves/1"


def measure(case: Case, rounds: int, tol: float = 1e-12) -> dict[str, object]:
    """Return times per sample and design, of the points that outputs read, and of all outputs [us];
    and of the slopes of the first outputs by the first places of a table [ms].

    Raises:
        KincheckError: the case is not one of a table of hardpoints.
    """
    ends = case.sweep.values
    values = np.linspace(float(ends[0]), float(ends[-1]), SAMPLES)
    case = without_forces(replace(case, sweep=replace(case.sweep, values=values)))
    places = [f"{each.name} {axis}" for each in case.hardpoints if each.moves for axis in "xyz"]
    if not places:
        raise KincheckError(f"bench curves: {case.name!r} has no rows. Give a table of hardpoints.")
    ready = prepare_curves(case, places)
    offsets = np.random.default_rng(SEED).normal(size=(DESIGNS, len(places))) * SCATTER
    geometry, varied = ready.varied.geometry(offsets.T), tuple(ready.varied.places)
    points = prepare_designs(
        NativeSolver(order=0), case.mechanism, case.sweep.path, varied, case.points
    )
    few = [each.name for each in case.outputs[:SLOPES]]
    sloped = prepare_curves(case, places[:PLACES], few, few)
    work: dict[str, Work] = {
        "points": lambda: points.solve(geometry, tol),
        "outputs": lambda: _outputs(ready, geometry, tol),
        "slopes": lambda: sloped.solve(np.zeros((1, len(places[:PLACES]))), tol),
    }
    for _ in range(rounds):  # programs are compiled after some use
        for each in work.values():
            each()
    seconds = take_turns(work, rounds)
    per_sample = 1e6 / (DESIGNS * SAMPLES)
    return {
        "schema": SCHEMA,
        "case": case.name,
        "designs": DESIGNS,
        "samples": SAMPLES,
        "outputs": len(case.outputs),
        "places": len(places[:PLACES]),
        "us_per_sample_of_points": seconds["points"].times(per_sample),
        "us_per_sample_of_outputs": seconds["outputs"].times(per_sample),
        "ms_of_slopes": seconds["slopes"].times(1e3),
        "ratio": seconds["outputs"].least / seconds["points"].least,
    }


def _outputs(ready: ReadyCurves, geometry: np.ndarray, tol: float) -> None:
    solved = ready.outputs.solve(geometry, tol)
    for name in ready.outputs.outputs:
        solved.values(name)


def lines(found: dict[str, object]) -> list[str]:
    """Return the results in words."""

    def shown(key: str, unit: str) -> str:
        each = found[key]
        assert isinstance(each, Spread)
        return f"{each.least:.3g} {unit} at least, median {each.median:.3g}"

    return [
        f"{found['case']}: {found['designs']} designs of {found['samples']} samples",
        f"  points alone: {shown('us_per_sample_of_points', 'us a sample')}",
        f"  {found['outputs']} outputs: {shown('us_per_sample_of_outputs', 'us a sample')},"
        f" {found['ratio']:.3g} times the points",
        f"  slopes of {SLOPES} outputs by {found['places']} places: {shown('ms_of_slopes', 'ms')}",
    ]
