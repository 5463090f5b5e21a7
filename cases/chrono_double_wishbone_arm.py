"""Closed form of Project Chrono's generic double wishbone, driven at its lower arm.

Hardpoints (BSD-3-Clause) as in the case.
"""

from __future__ import annotations

from .jet import Jet, Motion
from .suspension import Arm, Upright, double_wishbone

LOWER = Arm((0.199, 0.479, -0.206), (-0.279, 0.539, -0.2), (-0.04, 0.898, -0.265))
UPPER = Arm((0.16, 0.539, 0.243), (-0.339, 0.587, 0.249), (-0.088, 0.808, 0.243))
UPRIGHT = Upright((-0.279, 0.479, -0.026), (-0.22, 0.898, -0.026), (-0.04, 1.1, -0.026))


def motion(turn: Jet) -> Motion:
    """Return points of the suspension with the lower arm turned from the design by `turn` [rad]."""
    return double_wishbone(LOWER, UPPER, UPRIGHT, turn)
