"""Closed form of the planar four-bar: the coupler pin is where two circles meet.

In the plane of motion, with p the vector from the crank pin B to the rocker's pivot D, and b and c the lengths of coupler and
rocker, the coupler pin is  C = B + k p + h p_perp  with  k = (|p|^2 + b^2 - c^2) / (2 |p|^2)  and  k^2 + h^2 = b^2 / |p|^2.
As a crank-rocker (shortest + longest = 0.39 m < 0.446 m, Grashof) it never comes to h = 0, so the sign of h is that of the design.
"""

from __future__ import annotations

from .jet import Jet, Motion, constant, cos, sin, sqrt

# In-plane coordinates at design [m] along the axes E1, E2; the crank's pivot is the origin, at A in space.
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
    bx, by = -CRANK * sin(turn), CRANK * cos(turn)
    px, py = D[0] - bx, D[1] - by
    pp = px * px + py * py
    k = (pp + (COUPLER_SQUARED - ROCKER_SQUARED)) / (2.0 * pp)
    h = sqrt(constant(COUPLER_SQUARED, pp) / pp - k * k)
    dx, dy = k * px - h * py, k * py + h * px
    return {
        "coupler_pin": in_space(bx + dx, by + dy),
        "coupler_tip": in_space(bx + ALONG * dx - ACROSS * dy, by + ALONG * dy + ACROSS * dx),
    }


def in_space(x: Jet, y: Jet) -> tuple[Jet, Jet, Jet]:
    """In-plane coordinates to global ones."""
    gx, gy, gz = (a + e1 * x + e2 * y for a, e1, e2 in zip(A, E1, E2, strict=True))
    return gx, gy, gz
