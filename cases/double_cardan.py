"""Closed form of two Hooke's joints in a row, bent alike: the last shaft turns as the first.

The yokes between the joints are parallel. At the first joint  tan t2 = tan t1 / cos b.  At the
second  tan t3 = cos b tan t2,  because its driving yoke is across the plane at design.
"""

from __future__ import annotations

from .hooke_joint import BEND, driven, on_shaft
from .jet import Jet, Motion, cos, sin

BETWEEN = (0.4, 0.0, 0.3)  # the second joint; the first is at the origin [m]
# cos 2b, sin 2b: both bends are towards z
TWICE = BEND[0] ** 2 - BEND[1] ** 2, 2.0 * BEND[0] * BEND[1]


def motion(turn: Jet) -> Motion:
    """Return a point of the middle shaft and the tip of the last one, the first shaft turned from
    the design by `turn` [rad].
    """
    return {
        "between": on_shaft((0.0, 0.0, 0.0), BEND, *driven(turn, BEND[0])),
        "last_tip": on_shaft(BETWEEN, TWICE, cos(turn), sin(turn)),
    }
