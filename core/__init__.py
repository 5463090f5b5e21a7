"""kincheck.core: describe a mechanism, solve it, compare engines."""

from .analysis.solve import solve
from .drivers import JointAngle, JointDisplacement, PointCoordinate
from .errors import CaseError, KincheckError, MechanismError, SolveError
from .joints import Distance, Fixed, Joint, Revolute, Spherical, Translational, Universal
from .mechanism import GROUND, Body, Mechanism, Point

__all__ = [
    "GROUND",
    "Body",
    "CaseError",
    "Distance",
    "Fixed",
    "Joint",
    "JointAngle",
    "JointDisplacement",
    "KincheckError",
    "Mechanism",
    "MechanismError",
    "Point",
    "PointCoordinate",
    "Revolute",
    "SolveError",
    "Spherical",
    "Translational",
    "Universal",
    "solve",
]
