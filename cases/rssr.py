"""Closed form of the RSSR linkage: two revolute pivots, joined by a rod between spherical joints.

The crank pin is  a (cos t, sin t, 0),  the rocker pin on the circle
O + b (0, cos s, sin s)  at the rod's length from the crank pin. The circle has two such points, of
two assemblies. The crank turns fully in both, so neither ever comes to the other.
"""

from __future__ import annotations

from .jet import Jet, Motion, constant, cos, sin
from .vectors import Circle, Vec, fixed

CRANK, ROCKER, ROD = 1.0, 4.0, 5.5  # a, b, l [m]
O = (2.0, 1.0, 3.0)  # noqa: E741  a point on the rocker's axis, which is along x [m]
# the tip sits beyond the pivot: this far along x, and at this radius opposite to the pin [m]
ARM = (0.5, 2.0)


def motion(turn: Jet, side: float = 1.0) -> Motion:
    """Points of the mechanism with the crank turned from the design by `turn` [rad]; side: which
    assembly, +1 or -1.
    """
    crank_pin = Vec(CRANK * cos(turn), CRANK * sin(turn), constant(0.0, turn))
    rocker_pin = Circle(O, (0.0, ROCKER, 0.0), (0.0, 0.0, ROCKER)).meet(crank_pin, ROD, side)
    pivot = fixed(O, turn)
    tip = pivot + fixed((ARM[0], 0.0, 0.0), turn) + (ARM[1] / ROCKER) * (pivot - rocker_pin)
    return {"crank_pin": crank_pin, "rocker_pin": rocker_pin, "rocker_tip": tip}


def other_branch(turn: Jet) -> Motion:
    """The same for the other assembly."""
    return motion(turn, -1.0)
