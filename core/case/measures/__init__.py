"""Measures: outputs of joints, bodies, pairs of points, and forces."""

from .base import NAMES, Measure, key_of
from .body import Component, Orientation
from .force import DriverEffort, ElementForce, ForceMeasure, JointForce, JointMoment
from .joint import JointAngle, JointDisplacement
from .pairs import Angle, Distance

__all__ = [
    "NAMES",
    "Angle",
    "Component",
    "Distance",
    "DriverEffort",
    "ElementForce",
    "ForceMeasure",
    "JointAngle",
    "JointDisplacement",
    "JointForce",
    "JointMoment",
    "Measure",
    "Orientation",
    "key_of",
]
