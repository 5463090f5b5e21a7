"""Closed form of the planar four-bar: the coupler pin is where two circles meet.

In the plane of motion it has the coupler's length from the crank pin, and the rocker's from the
rocker's pivot. As a crank-rocker (shortest + longest = 0.39 m < 0.446 m, Grashof) it never
stretches out, so the side is that of the design.
"""

from __future__ import annotations

from .jet import Jet, Motion, constant, cos, sin
from .vectors import Vec, fixed, meet_in_plane

# In-plane coordinates at design [m] along the axes E1, E2; the crank's pivot is the origin, at A in
# space.
CRANK = 0.09  # B = (0, 0.09)
D = (0.3, 0.0)
C = (0.24, 0.18)
TIP = (0.15, 0.27)
A = (0.1, -0.2, 0.3)
E1 = (2 / 3, 2 / 3, -1 / 3)
E2 = (-1 / 3, 2 / 3, 2 / 3)

COUPLER_SQUARED = C[0] ** 2 + (C[1] - CRANK) ** 2
ROCKER_SQUARED = (C[0] - D[0]) ** 2 + (C[1] - D[1]) ** 2
# TIP = B + ALONG (C - B) + ACROSS (C - B)_perp
ALONG = (TIP[0] * C[0] + (TIP[1] - CRANK) * (C[1] - CRANK)) / COUPLER_SQUARED
ACROSS = (C[0] * (TIP[1] - CRANK) - (C[1] - CRANK) * TIP[0]) / COUPLER_SQUARED


def motion(turn: Jet) -> Motion:
    """Points of the mechanism with the crank turned from the design by `turn` [rad]."""
    zero = constant(0.0, turn)
    crank_pin = Vec(-CRANK * sin(turn), CRANK * cos(turn), zero)
    coupler_pin = meet_in_plane(
        crank_pin, COUPLER_SQUARED, fixed((*D, 0.0), turn), ROCKER_SQUARED, 1.0
    )
    d = coupler_pin - crank_pin
    tip = crank_pin + ALONG * d + ACROSS * Vec(-d.y, d.x, zero)
    return {"coupler_pin": in_space(coupler_pin), "coupler_tip": in_space(tip)}


def in_space(point: Vec) -> Vec:
    """Return the global coordinates of in-plane ones."""
    return fixed(A, point.x) + Vec(
        *(e1 * point.x + e2 * point.y for e1, e2 in zip(E1, E2, strict=True))
    )
