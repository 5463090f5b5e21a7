"""Closed form of the planar slider-crank: x = r cos t + sqrt(l^2 - r^2 sin^2 t).

x is the slider's position (any textbook).
"""

from __future__ import annotations

from .jet import Jet, Motion, constant, cos, sin, sqrt

CRANK, ROD = 1.0, 3.0  # r, l [m]


def motion(turn: Jet) -> Motion:
    """Points of the mechanism with the crank turned from the design, stretched out, by `turn`
    [rad].
    """
    zero = constant(0.0, turn)
    px, py = CRANK * cos(turn), CRANK * sin(turn)
    x = px + sqrt(ROD**2 - py * py)
    return {"slider": (x, zero, zero), "rod_middle": (0.5 * (x + px), 0.5 * py, zero)}
