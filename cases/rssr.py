"""Closed form of the RSSR linkage: two revolute pivots, joined by a rod between spherical joints.

Crank pin  P = a (cos t, sin t, 0),  rocker pin  Q = O + b (0, cos s, sin s),  |Q - P| = l.  Squaring gives
A cos s + B sin s + C = 0  with  A = 2 b (Oy - Py),  B = 2 b (Oz - Pz),  C = |O - P|^2 + b^2 - l^2
(Hartenberg and Denavit, Kinematic Synthesis of Linkages, 1964, ch. 12), solved for cos s and sin s on the branch of the design.
"""

from __future__ import annotations

from .jet import Jet, Motion, constant, cos, sin, sqrt

CRANK, ROCKER, ROD = 1.0, 4.0, 5.5  # a, b, l [m]
O = (2.0, 1.0, 3.0)  # noqa: E741  a point on the rocker's axis, which is along x [m]
ARM = (0.5, 2.0)  # the tip sits beyond the pivot: this far along x, and at this radius opposite to the pin [m]


def rocker(turn: Jet) -> tuple[Jet, Jet]:
    """Cosine and sine of the rocker's angle from y towards z, with the crank at the angle `turn` from x [rad]."""
    px, py = CRANK * cos(turn), CRANK * sin(turn)
    ox, oy = O[0] - px, O[1] - py
    A, B = 2.0 * ROCKER * oy, 2.0 * ROCKER * O[2]
    C = ox * ox + oy * oy + (O[2] ** 2 + ROCKER**2 - ROD**2)
    AABB = A * A + B * B
    S = sqrt(AABB - C * C)
    return (B * S - A * C) / AABB, -(B * C + A * S) / AABB


def motion(turn: Jet) -> Motion:
    """Points of the mechanism with the crank turned from the design by `turn` [rad]."""
    c, s = rocker(turn)
    return {
        "crank_pin": (CRANK * cos(turn), CRANK * sin(turn), constant(0.0, turn)),
        "rocker_pin": (constant(O[0], turn), O[1] + ROCKER * c, O[2] + ROCKER * s),
        "rocker_tip": (constant(O[0] + ARM[0], turn), O[1] - ARM[1] * c, O[2] - ARM[1] * s),
    }
