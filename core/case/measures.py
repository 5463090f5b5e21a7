"""Measures: outputs of joints, bodies, pairs of points, and forces, by all their classes."""

from .force_measures import DriverEffort as DriverEffort
from .force_measures import ElementForce as ElementForce
from .force_measures import ForceMeasure as ForceMeasure
from .force_measures import JointForce as JointForce
from .force_measures import JointMoment as JointMoment
from .pose_measures import COORDINATES as COORDINATES
from .pose_measures import NAMES as NAMES
from .pose_measures import Angle as Angle
from .pose_measures import Component as Component
from .pose_measures import Distance as Distance
from .pose_measures import JointAngle as JointAngle
from .pose_measures import JointDisplacement as JointDisplacement
from .pose_measures import Measure as Measure
from .pose_measures import Orientation as Orientation
from .pose_measures import coordinate_of as coordinate_of
from .pose_measures import key_of as key_of
from .pose_measures import place_on as place_on
from .quantity import Axis as Axis
