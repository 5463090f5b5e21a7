"""Measures: outputs of joints, bodies and pairs of points."""

from .base import NAMES, Measure, key_of, own_keys
from .body import Component, Orientation
from .joint import JointAngle, JointDisplacement
from .pairs import Angle, Distance

__all__ = [
    "NAMES",
    "Angle",
    "Component",
    "Distance",
    "JointAngle",
    "JointDisplacement",
    "Measure",
    "Orientation",
    "key_of",
    "own_keys",
]
