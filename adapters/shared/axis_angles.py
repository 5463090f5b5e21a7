"""Angles of frames about their axes x, y and z, one after the other, as OpenSim has them."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, hypot

from ...core.mechanism.mechanism import Vector

Parameters = tuple[float, float, float, float]


def orientation(move: str, axis: Vector) -> Vector:
    """Return the angles about x, y and z, one after the other, of frames along an axis [rad].

    A slider moves along x of its frames, a pin turns about z.
    """
    x, y, z = axis
    match move:
        case "slide":
            return 0.0, atan2(-z, x), atan2(y, hypot(x, z))
        case "hinge":
            return atan2(-y, z), atan2(x, hypot(y, z)), 0.0
        case _:
            return 0.0, 0.0, 0.0


def euler_angles(p: Sequence[float]) -> tuple[float, float, float]:
    """Return the angles [rad] of successive rotations about the body's x, y and z axes, exact to
    round-off at any rotation.

    With half angles a, b, c the parameters of such turns give (e1 ± e3, e0 ± e2) =
    (cos b ± sin b) (sin(a ± c), cos(a ± c)).
    """
    e0, e1, e2, e3 = p
    plus, minus = (e1 + e3, e0 + e2), (e1 - e3, e0 - e2)
    total, difference = atan2(*plus), atan2(*minus)
    large, small = hypot(*plus), hypot(*minus)
    return total + difference, 2.0 * atan2(large - small, large + small), total - difference
