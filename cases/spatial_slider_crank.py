"""Closed form of the spatial slider-crank, after the IFToMM multibody benchmark.

The crank pin is  B = (0, Ay - r sin t, Az + r cos t), the slider at  x = sqrt(l^2 - By^2 - Bz^2)
on the x axis. Three unit vectors turn with the conrod: u from the slider to B,
a = X x u / |X x u|, and u x a. X is the universal joint's axis on the slider; a is its axis on the
conrod, perpendicular to both u and X.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..core.mechanism.mechanism import Mechanism
from .dynamics import Three, effort
from .jet import Jet, Lanes, Motion, constant, cos, sin, sqrt
from .vectors import Vec, fixed

CRANK, CONROD = 0.08, 0.3  # r, l [m]
AY, AZ = 0.1, 0.12  # crank pivot [m]
# The side point from the slider at design (-0.1, 0.09, 0.12), along u = (-2, 1, 2)/3, and along a =
# (0, -2, 1)/SQRT5 and u x a = (5, 2, 4)/(3 SQRT5), both times SQRT5.
SIDE_U, SIDE_A, SIDE_W = 0.53 / 3, -0.06, 0.16 / 3
SQRT5 = 5.0**0.5


def motion(turn: Jet) -> Motion:
    """Return points of the mechanism with the crank turned from the design by `turn` [rad]."""
    zero = constant(0.0, turn)
    by, bz = AY - CRANK * sin(turn), AZ + CRANK * cos(turn)
    rr = by * by + bz * bz
    x, r = sqrt(CONROD**2 - rr), sqrt(rr)
    ux, uy, uz = -x / CONROD, by / CONROD, bz / CONROD
    ay, az = -bz / r, by / r
    wx, wy, wz = uy * az - uz * ay, -(ux * az), ux * ay
    su, sa, sw = SIDE_U, SIDE_A / SQRT5, SIDE_W / SQRT5
    return {
        "slider": (x, zero, zero),
        "conrod_centre": (0.5 * x, 0.5 * by, 0.5 * bz),
        "conrod_side": (
            x + su * ux + sw * wx,
            su * uy + sa * ay + sw * wy,
            su * uz + sa * az + sw * wz,
        ),
    }


def bodies(turn: Jet) -> Mapping[str, Three]:
    """Return three points of each body."""
    at = {name: Vec(*point) for name, point in motion(turn).items()}
    slider, middle = at["slider"], at["conrod_centre"]
    pivot = fixed((0.0, AY, AZ), turn)
    pin = 2.0 * middle - slider
    return {
        "crank": (pivot, pin, pivot + fixed((1.0, 0.0, 0.0), turn)),
        "conrod": (slider, pin, at["conrod_side"]),
        "slider": (
            slider,
            slider + fixed((1.0, 0.0, 0.0), turn),
            slider + fixed((0.0, 1.0, 0.0), turn),
        ),
    }


def forces(mechanism: Mechanism, turn: Jet) -> Mapping[str, Lanes]:
    """Return the torque of the crank."""
    return {"crank_torque": effort(mechanism, turn, bodies)}
