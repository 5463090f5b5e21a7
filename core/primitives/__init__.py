"""Primitive constraints: one geometric condition a file, its derivation on top.

A primitive says its residual phi, and which of its zeros is meant (branch). Rows, gamma and nu are
derived from phi and take as many operations as written by hand. Written are those that the paper
simplifies: of dot11, dot12, the named turn and the driven angle, a third of the strut's program.

Where the paper's equations are; core/extensions/laboratory/paper has its rows in body axes and
conventional ones, tests/oracles/naive.py the equations unsimplified.

    (1)-(7)     A(p), virtual rotations, velocities     algebra.py, base.py
    (8)-(12)    dot10         Table 1                   dot10.py
    (13)-(16)   dot11         Table 1                   dot11.py
    (17)-(21)   dot12         Table 1                   dot12.py
    (22)        dot20         Table 2                   dot20.py
    (23)        dot21         Table 2                   dot21.py
    (24)        spherical                               spherical.py
    (25)-(27)   joints        ../joints: spherical, revolute, translational
    (28)-(32)   position, velocity, acceleration        ../kinematics/compiled/programs.py

Table 3, the operations, is counted by `kincheck bench formulation`; Tables 4 and 5, the strut, are
cases/mcpherson_strut.toml. The tie rod's distance condition and the drivers have no numbers in the
paper: formulation section 2.
"""

from .base import GROUND_POSE, Drive, Pose, Primitive, Row, Twist
from .constant_velocity import ConstantVelocity
from .distance import Distance
from .dot10 import Dot10
from .dot11 import Dot11
from .dot12 import Dot12
from .dot20 import Dot20
from .dot21 import Dot21
from .driven import DrivenAngle, DrivenCoordinate
from .ground import Ground
from .named import NamedSlide, NamedTurn
from .spherical import Spherical

__all__ = [
    "GROUND_POSE",
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
    "NamedSlide",
    "NamedTurn",
    "Pose",
    "Primitive",
    "Row",
    "Spherical",
    "Twist",
]
