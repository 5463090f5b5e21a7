"""Closed form of Project Chrono's sedan double wishbone, driven at its lower arm.

Hardpoints (BSD-3-Clause) as in the case.
"""

from __future__ import annotations

from .jet import Jet, Motion
from .suspension import Arm, Upright, double_wishbone

LOWER = Arm((0.2, 0.42, -0.27), (-0.2, 0.47, -0.265), (0.0, 0.77, -0.32))
UPPER = Arm((-0.1, 0.47, 0.105), (-0.25, 0.51, 0.11), (-0.04, 0.695, 0.105))
UPRIGHT = Upright((-0.2, 0.42, -0.12), (-0.15, 0.77, -0.12), (0.0, 0.7979, -0.1199))


def motion(turn: Jet) -> Motion:
    """Return points of the suspension with the lower arm turned from the design by `turn` [rad]."""
    return double_wishbone(LOWER, UPPER, UPRIGHT, turn)
