"""Time of forces beside the motion: of a whole sweep by its program, and of reading every reaction,
effort and force element.
"""

from __future__ import annotations

from collections.abc import Mapping
from time import process_time
from typing import Any

from ....case.case import Case, without_forces
from ....errors import SolveError
from ....kinematics import NativeSolver
from ....program.executor import compiled_at_once
from ....trajectory import Trajectory
from .rounds import Work, take_turns

SCHEMA = "kincheck-bench-forces/1"
MOTION, FORCES, READ = "motion", "forces", "forces, read"


def measure(cases: Mapping[str, Case], rounds: int, tol: float = 1e-12) -> dict[str, Any]:
    """Return the processor time per sample of the motion of each case, with accelerations, with all
    forces, and with all of them read [us], in turns.

    Raises:
        SolveError: not all samples of a case were reached.
    """
    work: dict[tuple[str, str], Work] = {}
    samples = {name: len(case.sweep.values) for name, case in cases.items()}
    for name, case in cases.items():
        mechanism, path, points = case.mechanism, case.sweep.path, without_forces(case).points
        of = (*mechanism.given_joints, *mechanism.drivers, *mechanism.forces)
        with compiled_at_once():
            motion = NativeSolver().prepare(mechanism, path, points)
            forces = NativeSolver().prepare(mechanism, path, points, (), [x.name for x in of])
            for solve in (motion, forces):
                if not (found := solve(tol)).solved.all():
                    raise SolveError(f"bench forces: {name}: {found.message}")
        work[name, MOTION] = lambda solve=motion: solve(tol)
        work[name, FORCES] = lambda solve=forces: solve(tol)
        work[name, READ] = lambda solve=forces: _read(solve(tol))
    seconds = take_turns(work, rounds, clock=process_time)
    times = {
        name: {what: seconds[name, what].times(1e6 / n) for what in (MOTION, FORCES, READ)}
        for name, n in samples.items()
    }
    return {"schema": SCHEMA, "samples": samples, "us_per_sample": times}


def _read(found: Trajectory) -> list[Any]:
    assert found.forces is not None  # they are asked for
    forces = found.forces
    return [*forces.joints.values(), *forces.drivers.values(), *forces.elements.values()]


def lines(found: Mapping[str, Any]) -> list[str]:
    """Return the results in words."""
    return [
        f"{name}, {what}: {each.least:.3g} us a sample at least, {each.least / motion:.3g} of the"
        " motion"
        for name, of in found["us_per_sample"].items()
        for motion in [of[MOTION].least]
        for what, each in of.items()
    ]
