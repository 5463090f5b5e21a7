"""Kinematics: from the description of a mechanism to its motion.

This module is the door to the native solver: code outside this folder imports from here only.

Solve:

    solve              one design over a sweep
    forces_of          reactions of joints and efforts of drivers of a solved motion
    angle_with_turns   the angle of a joint, followed from the design
    attitude_with_turns
                       the attitude of a body, followed from the design
    NativeSolver       settings of the solver; makes a mechanism ready for a path (`prepare`), and
                       tells the size of its programs

Describe:

    start_of, solve_from_start, notes_on_start      the start of the samples on a path
    degrees_of_freedom, require_driven              drivers against degrees of freedom
    largest_residual                                residual of joints over poses of bodies
    kinds, places, placed                           the geometry by name
    LoadPlace, load_places                          masses and loads by name
    constraints, Cartesian, Frames, Relation        the equations of joints and drivers
    formulate, styles, NATIVE, MIXED                the same in a row style
    is_continuation, continuous, regular_between    tests of a step
    motion_defects                                  a motion of bodies against the constraints

The folders:

    formulation      constraints as equations
    structure        degrees of freedom, redundant rows, components, sparse factors
    compiled         one mechanism as compiled programs: request, programs, model, routes
    continuation     the walk along a path, singular poses, curves by arc length
    forces           the equations of forces, and the forces of a solved motion
"""

# pyright: reportUnusedImport=false

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .compiled.request import LAST_ITERATION, WantedOutput
    from .compiled.routes import Start, notes_on_start, solve_from_start, start_of
    from .followed import (
        DOUBTFUL,
        agreement,
        angle_with_turns,
        attitude_with_turns,
        follower,
        in_doubt,
        near_design,
    )
    from .forces.reactions import forces_of, motion_defects, with_forces
    from .formulation.acceptance_criteria import (
        LONGEST_TURN,
        ROUNDING,
        continuous,
        is_continuation,
        regular_between,
    )
    from .formulation.cartesian import COLUMNS, Cartesian
    from .formulation.constraints import Frames, Relation, constraints, unit_near
    from .formulation.parameters import LoadPlace, kinds, load_places, placed, places
    from .formulation.styles import MIXED, NATIVE, formulate, styles
    from .motion_solver import Method, Solver
    from .native_solver import NativeSolver, ProgramSize
    from .one_design import solve
    from .structure.degrees_of_freedom import degrees_of_freedom, require_driven
    from .structure.redundancy import largest_residual

_NAMES = {
    "compiled.request": "LAST_ITERATION WantedOutput",
    "compiled.routes": "Start notes_on_start solve_from_start start_of",
    "followed": (
        "DOUBTFUL agreement angle_with_turns attitude_with_turns follower in_doubt near_design"
    ),
    "forces.reactions": "forces_of motion_defects with_forces",
    "formulation.acceptance_criteria": (
        "LONGEST_TURN ROUNDING is_continuation continuous regular_between"
    ),
    "formulation.cartesian": "COLUMNS Cartesian",
    "formulation.constraints": "Frames Relation constraints unit_near",
    "formulation.styles": "MIXED NATIVE formulate styles",
    "formulation.parameters": "LoadPlace kinds load_places placed places",
    "native_solver": "NativeSolver ProgramSize",
    "motion_solver": "Method Solver",
    "one_design": "solve",
    "structure.degrees_of_freedom": "degrees_of_freedom require_driven",
    "structure.redundancy": "largest_residual",
}
"""Module: its public names. No module of this folder has such a name: once imported, it would take
the place of the name.
"""
_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    """Import a public name on first use: most callers need a few of them."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(import_module(f".{_MODULES[name]}", __name__), name)
    globals()[name] = found
    return found
