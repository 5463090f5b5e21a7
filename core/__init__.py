"""kincheck.core: describe a mechanism, solve it, compare engines."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .version import VERSION

if TYPE_CHECKING:
    from .caches import clear_caches
    from .errors import CaseError, KincheckError, MechanismError, SolveError
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
    from .kinematics import assemble, find_assemblies, solve, solve_designs, trace
    from .mechanism.drivers import JointAngle, JointDisplacement, PointCoordinate
    from .mechanism.mechanism import GROUND, Body, Mechanism, Point
    from .mechanism.motions import Ramp, Sine, Table
    from .studies.joint_check.check_joint import check_joint

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
    "clear_caches",
    "find_assemblies",
    "solve",
    "solve_designs",
    "trace",
]

_ROOMS = (
    ".errors",
    ".caches",
    ".mechanism.mechanism",
    ".mechanism.drivers",
    ".mechanism.motions",
    ".joints",
    ".kinematics",
    ".studies.joint_check.check_joint",
)


def __getattr__(name: str) -> Any:
    """Import a name on first use: pytest loads its plugins at every start and must not wait for
    numpy.
    """
    if name in __all__:
        for room in _ROOMS:  # # fastest imports first
            found = getattr(import_module(room, __name__), name, None)
            if found is not None:
                globals()[name] = found
                return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
