"""kincheck.core: describe a mechanism, solve it, compare engines."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .version import VERSION

if TYPE_CHECKING:
    from .caches import clear_caches
    from .case.case import Case
    from .case.io.reader_options import Supplied
    from .errors import CaseError, KincheckError, MechanismError, SolveError, UnknownNameError
    from .harness.engine import Engine
    from .harness.record import Outcome, Record, Results
    from .joints import (
        ConstantVelocity,
        Cylindrical,
        Distance,
        Fixed,
        Gear,
        Inline,
        InPlane,
        Joint,
        LinearCoupler,
        OrientationLock,
        ParallelAxes,
        PerpendicularAxes,
        Planar,
        Polynomial,
        RackPinion,
        Revolute,
        RevoluteSpherical,
        Screw,
        Spherical,
        Spline,
        Translational,
        Universal,
    )
    from .kinematics import solve
    from .mechanism.mechanism import GROUND, Body, Mechanism, Point
    from .mechanism.motions import JointAngle, JointDisplacement, PointCoordinate, Ramp, Sine, Table
    from .studies.checks.check_joint import check_joint
    from .trajectory import BodyMotion, PointMotion, Trajectory

__version__ = VERSION

__all__ = [
    "GROUND",
    "Body",
    "BodyMotion",
    "Case",
    "CaseError",
    "ConstantVelocity",
    "Cylindrical",
    "Distance",
    "Engine",
    "Fixed",
    "Gear",
    "InPlane",
    "Inline",
    "Joint",
    "JointAngle",
    "JointDisplacement",
    "KincheckError",
    "LinearCoupler",
    "Mechanism",
    "MechanismError",
    "OrientationLock",
    "Outcome",
    "ParallelAxes",
    "PerpendicularAxes",
    "Planar",
    "Point",
    "PointCoordinate",
    "PointMotion",
    "Polynomial",
    "RackPinion",
    "Ramp",
    "Record",
    "Results",
    "Revolute",
    "RevoluteSpherical",
    "Screw",
    "Sine",
    "SolveError",
    "Spherical",
    "Spline",
    "Supplied",
    "Table",
    "Trajectory",
    "Translational",
    "Universal",
    "UnknownNameError",
    "__version__",
    "check_joint",
    "clear_caches",
    "solve",
]

_NAMES = {
    "caches": "clear_caches",
    "errors": "CaseError KincheckError MechanismError SolveError UnknownNameError",
    "trajectory": "BodyMotion PointMotion Trajectory",
    "mechanism.mechanism": "GROUND Body Mechanism Point",
    "mechanism.motions": "JointAngle JointDisplacement PointCoordinate Ramp Sine Table",
    "joints": (
        "ConstantVelocity Cylindrical Distance Fixed Gear Inline InPlane "
        "Joint LinearCoupler OrientationLock ParallelAxes PerpendicularAxes Planar Polynomial "
        "RackPinion Revolute RevoluteSpherical Screw Spherical Spline Translational Universal"
    ),
    "case.case": "Case",
    "case.io.reader_options": "Supplied",
    "kinematics": "solve",
    "harness.engine": "Engine",
    "harness.record": "Outcome Record Results",
    "studies.checks.check_joint": "check_joint",
}
"""Public names by the module that defines them, as for type checkers above."""
_MODULES = {name: module for module, names in _NAMES.items() for name in names.split()}


if not TYPE_CHECKING:  # type checkers would take any name for one of these

    def __getattr__(name: str) -> Any:
        """Import a name on first use: pytest loads its plugins at every start and must not wait for
        numpy.
        """
        if name in _MODULES:
            found = getattr(import_module(f".{_MODULES[name]}", __name__), name)
        elif not name.startswith("_") and (offer := _offered(name)):
            found = offer.load()
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        globals()[name] = found
        return found

    def _offered(name: str) -> Any:
        """Return what an extension offers under a public name; see `doors`."""
        return import_module(".doors", __name__).offers("public").get(name)


def __dir__() -> list[str]:
    """Return the public names, loaded or not."""
    return sorted({*globals(), *__all__})
