"""kincheck.core: describe a mechanism, solve it, compare engines."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .version import VERSION

if TYPE_CHECKING:
    from .analysis.assembly.assemble import assemble
    from .analysis.assembly.assemblies import find_assemblies
    from .analysis.designs import solve_designs
    from .analysis.singular.continuation import trace
    from .analysis.solve import solve
    from .drivers import JointAngle, JointDisplacement, PointCoordinate
    from .errors import CaseError, KincheckError, MechanismError, SolveError
    from .harness.joint_check.check_joint import check_joint
    from .joints import (
        ConstantVelocity,
        Cylindrical,
        Distance,
        Fixed,
        Gear,
        Inline,
        InPlane,
        Joint,
        OrientationLock,
        ParallelAxes,
        PerpendicularAxes,
        Planar,
        RackPinion,
        Revolute,
        RevoluteSpherical,
        Screw,
        Spherical,
        Translational,
        Universal,
    )
    from .mechanism import GROUND, Body, Mechanism, Point
    from .motions import Ramp, Sine, Table

__version__ = VERSION

__all__ = [
    "GROUND",
    "Body",
    "CaseError",
    "ConstantVelocity",
    "Cylindrical",
    "Distance",
    "Fixed",
    "Gear",
    "InPlane",
    "Inline",
    "Joint",
    "JointAngle",
    "JointDisplacement",
    "KincheckError",
    "Mechanism",
    "MechanismError",
    "OrientationLock",
    "ParallelAxes",
    "PerpendicularAxes",
    "Planar",
    "Point",
    "PointCoordinate",
    "RackPinion",
    "Ramp",
    "Revolute",
    "RevoluteSpherical",
    "Screw",
    "Sine",
    "SolveError",
    "Spherical",
    "Table",
    "Translational",
    "Universal",
    "__version__",
    "assemble",
    "check_joint",
    "find_assemblies",
    "solve",
    "solve_designs",
    "trace",
]

_ROOMS = (
    *(".errors", ".mechanism", ".drivers", ".motions", ".joints"),
    *(f".analysis.{name}" for name in ("solve", "designs", "assembly.assemble", "assembly.assemblies", "singular.continuation")),
    ".harness.joint_check.check_joint",
)


def __getattr__(name: str) -> Any:
    """Import a name when it is asked for: pytest loads its plugins every time, and would wait for numpy and the solver else."""
    if name in __all__:
        for room in _ROOMS:  # what is quick to import first
            found = getattr(import_module(room, __name__), name, None)
            if found is not None:
                globals()[name] = found
                return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
