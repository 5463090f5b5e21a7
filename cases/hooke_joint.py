"""Closed form of Hooke's joint,  tan t2 = tan t1 / cos b  (any textbook).

The driving yoke is in the plane of the shafts at t1 = 0. The driven yoke is normal to its own shaft
and to the driving yoke. Hence

    cos t2 = cos b cos t1 / n,  sin t2 = sin t1 / n,  n^2 = sin^2 t1 + cos^2 b cos^2 t1:

the same relation, with the right quadrant.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..core.mechanism.mechanism import Mechanism
from .dynamics import Three, effort
from .jet import Jet, Lanes, Motion, cos, sin, sqrt
from .vectors import Numbers, Vec, fixed

# cos b, sin b: the driving shaft is along x, the driven one turned from it towards z
BEND = 0.8, 0.6
TIP = 0.3, 0.2  # of the driven shaft: distance along it, and off it along y, at design [m]


def driven(turn: Jet, cosine: float) -> tuple[Jet, Jet]:
    """Return cosine and sine of the driven shaft's turn, from the driving shaft's `turn` [rad] and
    the cosine of b.
    """
    c, s = cosine * cos(turn), sin(turn)
    n = sqrt(s * s + c * c)
    return c / n, s / n


def on_shaft(start: Numbers, bend: tuple[float, float], c: Jet, s: Jet) -> Vec:
    """Return the tip of a shaft from its start, bent from x towards z by an angle (cosine, sine)
    and turned by an angle (cosine c, sine s).
    """
    direction, aside = (bend[0], 0.0, bend[1]), (-bend[1], 0.0, bend[0])  # aside = direction x y
    off = c * fixed((0.0, 1.0, 0.0), c) + s * fixed(aside, c)
    return fixed(start, c) + TIP[0] * fixed(direction, c) + TIP[1] * off


def motion(turn: Jet) -> Motion:
    """Return the driven shaft's tip, the driving shaft turned from the design by `turn` [rad]."""
    return {"driven_tip": on_shaft((0.0, 0.0, 0.0), BEND, *driven(turn, BEND[0]))}


def bodies(turn: Jet) -> Mapping[str, Three]:
    """Return three points of each shaft."""
    origin, x = fixed((0.0, 0.0, 0.0), turn), fixed((1.0, 0.0, 0.0), turn)
    bent = fixed((BEND[0], 0.0, BEND[1]), turn)
    tip = Vec(*motion(turn)["driven_tip"])
    return {
        "driving": (
            origin,
            x,
            cos(turn) * fixed((0.0, 1.0, 0.0), turn) + sin(turn) * fixed((0.0, 0.0, 1.0), turn),
        ),
        "driven": (origin, bent, tip),
    }


def forces(mechanism: Mechanism, turn: Jet) -> Mapping[str, Lanes]:
    """Return the torque of the driving shaft."""
    return {"shaft_torque": effort(mechanism, turn, bodies)}
