"""Suspension outputs in the terms of kinematics engineers, each with its derivative by wheel travel
and the meaning of its sign.
"""

from .axle import AxleOutput
from .base import PerTravel, Rate, SuspensionOutput
from .corner import Axle, Convention, Reaction, Side, Vehicle
from .instant_centers import SWING_ARMS
from .wheel import Camber, MotionRatio, Toe, camber_of_front_view

__all__ = [
    "SWING_ARMS",
    "Axle",
    "AxleOutput",
    "Camber",
    "Convention",
    "MotionRatio",
    "PerTravel",
    "Rate",
    "Reaction",
    "Side",
    "SuspensionOutput",
    "Toe",
    "Vehicle",
    "camber_of_front_view",
]
