"""The native engine in detail: by requested quantities, by executor, and with or without the Python
around its loops.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from ...case.case import Case
from ...harness.native_engine import NativeEngine
from ...kinematics import Method, NativeSolver, ProgramSize
from ...trajectory import Array

EVERYTHING = "every body and point: position, velocity, acceleration"
"""The base level of the comparison."""
ALONE = f"{EVERYTHING}; loops alone"
NUMPY = f"{EVERYTHING}; numpy executor"
FORCES = f"{EVERYTHING}; all forces"


def level(
    *, order: int = 2, bodies: bool = True, compiled: bool = True, forces: bool = False
) -> NativeEngine:
    """Return the native engine with requested quantities, as one program, prepared again.

    Args:
        order: 0 for positions, 1 also velocities, 2 also accelerations.
        bodies: also solve every body in the paper's variables, instead of only the compared points.
        compiled: run machine code; else numpy.
        forces: also solve the forces of all joints, drivers and force elements.
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
"""Levels that are timed as a whole call, by requested quantities."""
WITH_FORCES: Mapping[str, NativeEngine] = {
    FORCES: level(forces=True),
    f"{FORCES}; numpy executor": level(forces=True, compiled=False),
}
"""Further levels for cases with masses or force elements."""


def levels(case: Case) -> Mapping[str, NativeEngine]:
    """Return the timed levels of a case."""
    return {**LEVELS, **(WITH_FORCES if case.mechanism.has_loads else {})}


def loops_alone(case: Case, tol: float) -> Callable[[], Array]:
    """Return a function that runs the executor's loops over all samples with everything requested:
    two calls from Python, without results.

    It is the native engine's floor, including tests and copying.

    Raises:
        SolveError: a step must be halved, which needs Python.
    """
    whole = level()
    return whole.solver.loops(case.mechanism, case.sweep.path, case.points, whole.bodies(case), tol)


def program_size(case: Case) -> ProgramSize:
    """Return the size of the programs with everything requested."""
    whole = level()
    return whole.solver.program_size(
        case.mechanism, case.sweep.path, case.points, whole.bodies(case)
    )
