"""The native engine in detail: by request, by executor, and with and without the Python around its
loops.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ...case.case import Case
from ...harness.native_engine import NativeEngine
from ...kinematics import Method, NativeSolver, ProgramSize
from ...trajectory import Array

EVERYTHING = "every body and point: position, velocity, acceleration"
"""The level that all others are compared with."""
ALONE = f"{EVERYTHING}; loops alone"
NUMPY = f"{EVERYTHING}; numpy executor"
FORCES = f"{EVERYTHING}; all forces"


def level(
    *, order: int = 2, bodies: bool = True, compiled: bool = True, forces: bool = False
) -> NativeEngine:
    """Return the native engine, asked for more or less: as one program, made ready anew.

    Args:
        order: 0 positions, 1 and velocities, 2 and accelerations.
        bodies: of every body too, in the paper's variables, and not of the compared points only.
        compiled: by machine code, else by numpy.
        forces: of all joints, drivers and force elements too.
    """
    solver = NativeSolver(order=order, compiled=compiled, method=Method.ONE_PROGRAM)
    return NativeEngine(solver, every_body=bodies, every_force=forces)


LEVELS: Mapping[str, NativeEngine] = {
    EVERYTHING: level(),
    "every body and point: position, velocity": level(order=1),
    "every body and point: position": level(order=0),
    "compared points: position, velocity, acceleration": level(bodies=False),
    "compared points: position": level(order=0, bodies=False),
    NUMPY: level(compiled=False),
    "every body and point: position; numpy executor": level(order=0, compiled=False),
}
"""What is timed as a whole call, by what is asked."""
WITH_FORCES: Mapping[str, NativeEngine] = {
    FORCES: level(forces=True),
    f"{FORCES}; numpy executor": level(forces=True, compiled=False),
}
"""The same of cases with masses or force elements."""


def levels(case: Case) -> Mapping[str, NativeEngine]:
    """Return what is timed of a case."""
    return {**LEVELS, **(WITH_FORCES if case.mechanism.has_loads else {})}


def loops_alone(case: Case, tol: float) -> Callable[[], Array]:
    """Return a call of the executor's loops over all samples, everything requested: no Python but
    two calls, no result built.

    It is the native engine's floor, tests and copying included.

    Raises:
        SolveError: a step has to be divided, which needs Python.
    """
    whole = level()
    return whole.solver.loops(case.mechanism, case.sweep.path, case.points, whole.bodies(case), tol)


def program_size(case: Case) -> ProgramSize:
    """Return the size of the programs with everything requested."""
    whole = level()
    return whole.solver.program_size(
        case.mechanism, case.sweep.path, case.points, whole.bodies(case)
    )
