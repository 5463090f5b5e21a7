"""Closed form of Modelica's spatial four-bar, for every choice of joints at its rod.

The crank pin is  R_x(t) (0, 0.5, 0.1),  the slider's pin  (x, 0.2, 0).  The rod between them has
the squared length 1.1. Hence  x = sqrt(1.1 - (y - 0.2)^2 - z^2)  with the crank pin's y and z.
Modelica's displacement is  s = x - 1.2.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..core.mechanism.mechanism import Mechanism
from .dynamics import Three, effort
from .jet import Jet, Lanes, Motion, constant, cos, sin, sqrt
from .vectors import Vec, fixed

ROD_SQUARED = 1.1  # of (-1, 0.3, 0.1) [m^2]
PIN = 0.2  # the slider's pin above the slide [m]


def motion(turn: Jet) -> Motion:
    """Return points of the mechanism with the crank turned from the design by `turn` [rad]."""
    c, s = cos(turn), sin(turn)
    y, z = 0.5 * c - 0.1 * s, 0.5 * s + 0.1 * c
    x = sqrt(ROD_SQUARED - (y - PIN) * (y - PIN) - z * z)
    middle = 0.5 * x, 0.5 * (y + PIN), 0.5 * z
    return {"slider_pin": (x, constant(PIN, turn), constant(0.0, turn)), "rod_middle": middle}


def bodies(turn: Jet) -> Mapping[str, Three]:
    """Return three points of crank and slider."""
    c, s = cos(turn), sin(turn)
    pin = Vec(constant(0.0, turn), 0.5 * c - 0.1 * s, 0.5 * s + 0.1 * c)
    slider = Vec(*motion(turn)["slider_pin"])
    x, y = fixed((1.0, 0.0, 0.0), turn), fixed((0.0, 1.0, 0.0), turn)
    return {
        "crank": (fixed((0.0, 0.0, 0.0), turn), pin, x),
        "slider": (slider, slider + x, slider + y),
    }


def forces(mechanism: Mechanism, turn: Jet) -> Mapping[str, Lanes]:
    """Return the torque of the crank, and the push of a massless rod on the slider."""
    slider = mechanism.moving[1]
    push = slider.mass * (next(iter(motion(turn)["slider_pin"])).a - mechanism.gravity[0])
    torque = effort(mechanism, turn, bodies)
    return {"crank_torque": torque, "rod_force_x": push}
