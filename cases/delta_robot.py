"""Closed form of a delta robot (after R. Clavel).

The platform keeps its orientation, so each pair of rods is one sphere. Arm k hangs on the base at
the angle 120 k degrees about z and swings in an upright plane. A pair of equal parallel rods joins
it to the platform. Let E_k be the elbow, and p_k the place of the rods on the platform, seen from
the platform's centre X. The distance from E_k - p_k to X is the rods' length: X is the intersection
of three spheres below their centres.
"""

from __future__ import annotations

import math

from .jet import Jet, Motion, constant
from .vectors import Circle, Vec, fixed, meet_in_space

BASE, PLATFORM = 0.2, 0.05  # radii of the hinges and of the rods' lower ends [m]
# length of the arms, which are level at design, and the platform below the base there [m]
ARM, DROP = 0.3, 0.6
ROD_SQUARED = (BASE + ARM - PLATFORM) ** 2 + DROP**2


def motion(first: Jet, second: Jet, third: Jet) -> Motion:
    """Return the platform's centre with the arms turned down from the design by angles [rad]."""
    a, b, c = (
        _centre(math.radians(120.0 * k), turn) for k, turn in enumerate((first, second, third))
    )
    square = constant(ROD_SQUARED, first)
    return {"platform": meet_in_space(a, square, b, square, c, square, -1.0)}


def _centre(angle: float, turn: Jet) -> Vec:
    """Return the elbow less the rods' place on the platform. The hinge's axis is tangential: a
    positive turn is down.
    """
    c, s = math.cos(angle), math.sin(angle)
    elbow = Circle.about(
        (BASE * c, BASE * s, 0.0), (-s, c, 0.0), ((BASE + ARM) * c, (BASE + ARM) * s, 0.0)
    )
    return elbow.turned(turn) - fixed((PLATFORM * c, PLATFORM * s, 0.0), turn)
