"""Time of outputs of many designs against their kinematics alone, of slopes by the geometry, of
sweeps, of the live page's answer, and of the first use in a process, by processor time.
"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np

from ....case.case import Case, without_forces
from ....errors import KincheckError
from ....kinematics import NativeSolver, placed
from ...designs.prepared import prepare_designs
from ...hardpoints.options import WheelOptions
from ...live.protocol import Solve
from ...live.table import LiveTable
from ...sweep.curves import ReadyCurves, prepare_curves
from ...sweep.study import Ready, Study
from ...sweep.study_choices import Mode
from ...sweep.variation import Coordinate, Law, Variation
from .rounds import Spread, Work, spread, take_turns

DESIGNS, SAMPLES, PLACES, SLOPES = 1000, 41, 27, 2
"""Designs and samples of the outputs; places and outputs of the slopes, which are of one design."""
SCATTER, SEED = 1e-3, 943745
"""Standard deviation of the hardpoints [m]."""
PROCESSES = 3
"""Rounds of processes; as many come before them, in which programs are compiled."""

SCHEMA = "kincheck-bench-curves/1"

ONCE = """
import pickle, sys
from time import process_time
import numpy as np
from kincheck.core.extensions.sweep.curves import prepare_curves
case, places, outputs = pickle.load(sys.stdin.buffer)
begin = process_time()
prepare_curves(case, places, outputs).solve(np.zeros((1, len(places))), 1e-12)
print(process_time() - begin)
"""


def measure(
    case: Case, file: Path, supplied: WheelOptions, rounds: int, tol: float = 1e-12
) -> dict[str, object]:
    """Return times per sample and design, of the points that outputs read, of all outputs, and of a
    sweep that reduces them [us]; of the slopes of the first outputs by the first places of a table,
    and of the live page's answer [ms]; and of the first use in a process that finds its programs in
    the cache: of the motion, of outputs, and of outputs of a table with new numbers [s].

    Args:
        case: of the table in the file, with the facts supplied.

    Raises:
        KincheckError: the case is not one of a table of hardpoints.
    """
    ends = case.sweep.values
    values = np.linspace(float(ends[0]), float(ends[-1]), SAMPLES)
    case = without_forces(replace(case, sweep=replace(case.sweep, values=values)))
    rows = [(each.name, axis) for each in case.hardpoints if each.moves for axis in "xyz"]
    places = [" ".join(each) for each in rows]
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
    drawn = tuple(Coordinate(*row, "m", Law.NORMAL, SCATTER) for row in rows)
    moves = ready.varied
    variation = Variation(moves.places, moves.nominal, moves.moves, Mode.MONTE_CARLO, drawn)
    sweep = Ready.of(Study(case, variation, DESIGNS * SAMPLES, SEED, tol=tol))
    live = LiveTable(file, supplied)
    edit = Solve(points=live.positions)
    work: dict[str, Work] = {
        "points": lambda: points.solve(geometry, tol),
        "outputs": lambda: _outputs(ready, geometry, tol),
        "sweep": lambda: sweep.chunk(0),
        "slopes": lambda: sloped.solve(np.zeros((1, len(places[:PLACES]))), tol),
        "live": lambda: live.solve(edit),
    }
    for _ in range(rounds):  # programs are compiled after some use
        for each in work.values():
            each()
    seconds = take_turns(work, rounds, clock=process_time)
    per_sample = 1e6 / (DESIGNS * SAMPLES)
    other = placed(case.mechanism, moves.values(offsets[0]))
    once = first_uses(
        {
            "motion": (case, places, ()),
            "outputs": (case, places, None),
            "new_numbers": (replace(case, mechanism=other), places, None),
        }
    )
    return {
        "schema": SCHEMA,
        "case": case.name,
        "designs": DESIGNS,
        "samples": SAMPLES,
        "outputs": len(case.outputs),
        "places": len(places[:PLACES]),
        "axle": bool(supplied.axle),
        "us_per_sample_of_points": seconds["points"].times(per_sample),
        "us_per_sample_of_outputs": seconds["outputs"].times(per_sample),
        "us_per_sample_of_sweep": seconds["sweep"].times(1e6 / (sweep.study.of_a_chunk * SAMPLES)),
        "ms_of_slopes": seconds["slopes"].times(1e3),
        "ms_of_live": seconds["live"].times(1e3),
        **{f"s_of_first_{name}": each for name, each in once.items()},
        "ratio": seconds["outputs"].least / seconds["points"].least,
    }


def first_uses(given: Mapping[str, tuple[Case, Sequence[str], object]]) -> dict[str, Spread]:
    """Return the seconds of the first use in a process whose cache has the programs, by what is
    used; the last has numbers that no process before had.
    """
    found: dict[str, list[float]] = {name: [] for name in given}
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "XDG_CACHE_HOME": cache}
        for turn in range(2 * PROCESSES):
            for name, each in given.items():
                if name == "new_numbers" and turn < PROCESSES:
                    continue
                done = subprocess.run(
                    [sys.executable, "-P", "-c", ONCE],
                    input=pickle.dumps(each),
                    stdout=subprocess.PIPE,
                    env=environment,
                    check=True,
                )
                found[name].append(json.loads(done.stdout))
    return {name: spread(each[-PROCESSES:]) for name, each in found.items()}


def _outputs(ready: ReadyCurves, geometry: np.ndarray, tol: float) -> None:
    solved = ready.outputs.solve(geometry, tol)
    for name in ready.outputs.outputs:
        solved.values(name)


def lines(found: dict[str, object]) -> list[str]:
    """Return the results in words, with the goals of this project."""

    def shown(key: str, unit: str) -> str:
        each = found[key]
        assert isinstance(each, Spread)
        return f"{each.least:.3g} {unit} at least, median {each.median:.3g}"

    most = 2.5 if found["axle"] else 2.0
    return [
        f"{found['case']}: {found['designs']} designs of {found['samples']} samples, by processor"
        " time",
        f"  points alone: {shown('us_per_sample_of_points', 'us a sample')}",
        f"  {found['outputs']} outputs: {shown('us_per_sample_of_outputs', 'us a sample')},"
        f" {found['ratio']:.3g} times the points (goal: at most {most})",
        f"  sweep of {found['outputs']} outputs: {shown('us_per_sample_of_sweep', 'us a sample')}"
        " (goal: at most 0.4 with 29 outputs)",
        f"  slopes of {SLOPES} outputs by {found['places']} places: {shown('ms_of_slopes', 'ms')}"
        " (goal: at most 8)",
        f"  answer of the live page: {shown('ms_of_live', 'ms')} (goal: at most 15)",
        "  first use in a process, programs in the cache:",
        f"    motion alone: {shown('s_of_first_motion', 's')}",
        f"    with outputs: {shown('s_of_first_outputs', 's')} (goal: at most 0.1 more)",
        f"    a table with new numbers: {shown('s_of_first_new_numbers', 's')} (goal: at most 0.1)",
    ]
