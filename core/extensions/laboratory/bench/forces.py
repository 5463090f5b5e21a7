"""Time of forces beside the motion: of a whole sweep by its program, and of reading every reaction,
effort and force element.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from time import process_time
from typing import Any

from ....case.case import Case
from ....kinematics import NativeSolver
from ....kinematics.motion_solver import Solver
from ....program.executor import compiled_at_once
from .rounds import Work, take_turns

WAYS = "motion", "forces", "forces, read"


@compiled_at_once()
def measure(cases: Mapping[str, Case], rounds: int, tol: float = 1e-12) -> dict[str, Any]:
    """Return the processor time per sample of the motion of each case, with accelerations, with all
    forces, and with all of them read [us], in turns.
    """
    work: dict[tuple[str, str], Work] = {}
    for name, case in cases.items():
        mechanism = case.mechanism
        of = (*mechanism.given_joints, *mechanism.drivers, *mechanism.forces)
        prepare = partial(NativeSolver().prepare, mechanism, case.sweep.path, case.points)
        motion, forces = prepare(), prepare(forces=[each.name for each in of])
        ways = partial(motion, tol), partial(forces, tol), partial(_read, forces, tol)
        work |= {(name, what): each for what, each in zip(WAYS, ways, strict=True)}
    seconds = take_turns(work, rounds, clock=process_time)
    samples = {name: len(case.sweep.values) for name, case in cases.items()}
    times = {
        name: {what: seconds[name, what].times(1e6 / n) for what in WAYS}
        for name, n in samples.items()
    }
    return {"schema": "kincheck-bench-forces/1", "samples": samples, "us_per_sample": times}


def _read(solve: Solver, tol: float) -> list[Any]:
    forces: Any = solve(tol).forces
    return [*forces.joints.values(), *forces.drivers.values(), *forces.elements.values()]


def lines(found: Mapping[str, Any]) -> list[str]:
    """Return the results in words."""
    return [
        f"{name}, {what}: {each.least:.3g} us a sample at least"
        for name, of in found["us_per_sample"].items()
        for what, each in of.items()
    ]
