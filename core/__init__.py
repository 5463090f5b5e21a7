"""kincheck.core: describe a mechanism, solve it, compare engines."""

from .analysis.assemble import assemble
from .analysis.designs import solve_designs
from .analysis.solve import solve
from .drivers import JointAngle, JointDisplacement, PointCoordinate
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
from .mechanism import GROUND, Body, Mechanism, Point
from .motions import Ramp, Sine, Table

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
    "assemble",
    "solve",
    "solve_designs",
]
