"""Suspension outputs in the terms of kinematics engineers, each with its derivative by wheel travel
and the meaning of its sign.
"""

from . import axle as axle
from . import instant_axis as instant_axis
from . import steering_axis as steering_axis
from . import wheel as wheel
from .axle import AxleOutput
from .base import Rate, SuspensionOutput
from .per_travel import PerTravel
from .vehicle import Axle, Convention, Reaction, Side, Vehicle
from .wheel import Camber, Toe, camber_of_front_view

__all__ = [
    "Axle",
    "AxleOutput",
    "Camber",
    "Convention",
    "PerTravel",
    "Rate",
    "Reaction",
    "Side",
    "SuspensionOutput",
    "Toe",
    "Vehicle",
    "camber_of_front_view",
]
