"""Closed form of two Hooke's joints in a row, bent alike, yokes between them parallel: the last
shaft turns as the first.

tan t2 = tan t1 / cos b  at the first, and as its driving yoke is across the plane at design,  tan t3 = cos b tan t2  at the second.
"""

from __future__ import annotations

from .hooke_joint import BEND, driven, on_shaft
from .jet import Jet, Motion, cos, sin

BETWEEN = (0.4, 0.0, 0.3)  # the second joint; the first is at the origin [m]
# cos 2b, sin 2b: both bends are towards z
TWICE = BEND[0] ** 2 - BEND[1] ** 2, 2.0 * BEND[0] * BEND[1]


def motion(turn: Jet) -> Motion:
    """A point of the shaft between and the tip of the last with the first turned from the design by
    `turn` [rad].
    """
    return {
        "between": on_shaft((0.0, 0.0, 0.0), BEND, *driven(turn, BEND[0])),
        "last_tip": on_shaft(BETWEEN, TWICE, cos(turn), sin(turn)),
    }
