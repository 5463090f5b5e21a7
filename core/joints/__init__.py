"""Joints: each file a composition of primitives. Every module in this folder is loaded, so a new
file is a new joint type.
"""

import importlib
import pkgutil

from .base import Attachment, AxialJoint, Joint, Kind
from .constant_velocity import ConstantVelocity
from .coupler import Coupler, Follower, PiecewisePolynomial
from .cylindrical import Cylindrical
from .distance import Distance
from .fixed import Fixed
from .gear import Gear
from .in_plane import InPlane
from .inline import Inline
from .linear_coupler import LinearCoupler
from .orientation_lock import OrientationLock
from .parallel_axes import ParallelAxes
from .perpendicular_axes import PerpendicularAxes
from .planar import Planar
from .polynomial import Polynomial
from .rack_pinion import RackPinion
from .revolute import Revolute
from .revolute_spherical import RevoluteSpherical
from .screw import Screw
from .spherical import Spherical
from .spline import Spline
from .translational import Translational
from .universal import Universal

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f".{_module.name}", __name__)

__all__ = [
    "Attachment",
    "AxialJoint",
    "ConstantVelocity",
    "Coupler",
    "Cylindrical",
    "Distance",
    "Fixed",
    "Follower",
    "Gear",
    "InPlane",
    "Inline",
    "Joint",
    "Kind",
    "LinearCoupler",
    "OrientationLock",
    "ParallelAxes",
    "PerpendicularAxes",
    "PiecewisePolynomial",
    "Planar",
    "Polynomial",
    "RackPinion",
    "Revolute",
    "RevoluteSpherical",
    "Screw",
    "Spherical",
    "Spline",
    "Translational",
    "Universal",
]
