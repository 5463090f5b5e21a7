"""Closed form of Project Chrono's generic MacPherson strut, driven at its arm.

Hardpoints (BSD-3-Clause) as in the case.
"""

from __future__ import annotations

from .jet import Jet, Motion, constant
from .suspension import Arm, Upright, macpherson

ARM = Arm((0.22, 0.52, -0.156), (-0.3, 0.507, -0.137), (-0.02165371, 0.94057703, -0.17402826))
TOP, CLAMP = (-0.115, 0.785, 0.579), (-0.07402507, 0.8532915, 0.2484536)
UPRIGHT = Upright(
    (-0.3, 0.52, -0.059),
    (-0.2373756, 0.89495045, -0.01605418),
    (-0.04000403, 1.09999965, -0.02602507),
)


def motion(turn: Jet) -> Motion:
    """Return points of the suspension with the arm turned from the design by `turn` [rad]."""
    return macpherson(ARM, TOP, CLAMP, UPRIGHT, turn, constant(0.0, turn))
