"""Primitive constraints: one geometric condition a file, its derivation on top."""

from .base import Drive, Pose, Primitive, Row, Twist
from .constant_velocity import ConstantVelocity
from .distance import Distance
from .dot10 import Dot10
from .dot11 import Dot11
from .dot12 import Dot12
from .dot20 import Dot20
from .dot21 import Dot21, LockedDisplacement
from .driven import DrivenAngle, DrivenCoordinate
from .ground import Ground
from .named import NamedSlide, NamedTurn
from .spherical import Spherical

__all__ = [
    "ConstantVelocity",
    "Distance",
    "Dot10",
    "Dot11",
    "Dot12",
    "Dot20",
    "Dot21",
    "Drive",
    "DrivenAngle",
    "DrivenCoordinate",
    "Ground",
    "LockedDisplacement",
    "NamedSlide",
    "NamedTurn",
    "Pose",
    "Primitive",
    "Row",
    "Spherical",
    "Twist",
]
