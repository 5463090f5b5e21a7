"""Joints: each file a composition of primitives. Every module in this folder is loaded, so a new file is a new joint type."""

import importlib
import pkgutil

from .base import Attachment, AxialJoint, Coupler, Joint, Kind
from .distance import Distance
from .fixed import Fixed
from .revolute import Revolute
from .spherical import Spherical
from .translational import Translational
from .universal import Universal

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f".{_module.name}", __name__)

__all__ = [
    "Attachment",
    "AxialJoint",
    "Coupler",
    "Distance",
    "Fixed",
    "Joint",
    "Kind",
    "Revolute",
    "Spherical",
    "Translational",
    "Universal",
]
