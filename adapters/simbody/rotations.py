"""Rotations of ball joints: Euler parameters here, Euler angles in OpenSim.

OpenSim disables Simbody's quaternions, and its package cannot enable them. At a second angle of 90
degrees the rates of the other two are infinite (gimbal lock), but the velocities of a ball joint in
Simbody are its angular velocity, which has no lock. So a step rotates Euler parameters by this
velocity, and Simbody gets the angles of the result: no rate of an angle is used.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, sin

from ..shared.opensim_frames import Parameters

UNTURNED: Parameters = (1.0, 0.0, 0.0, 0.0)


def turned(p: Sequence[float], turn: Sequence[float]) -> Parameters:
    """Return Euler parameters p after a further rotation by a rotation vector in the axes of the
    parent [rad].
    """
    e0, e1, e2, e3 = p
    x, y, z = turn
    angle = hypot(x, y, z)
    # sin(angle / 2) / angle; at an angle of 1e-8 its next term is below round-off
    scale = sin(0.5 * angle) / angle if angle > 1e-8 else 0.5
    w, x, y, z = cos(0.5 * angle), scale * x, scale * y, scale * z
    parameters = (
        w * e0 - x * e1 - y * e2 - z * e3,
        w * e1 + x * e0 + y * e3 - z * e2,
        w * e2 - x * e3 + y * e0 + z * e1,
        w * e3 + x * e2 - y * e1 + z * e0,
    )
    size = hypot(*parameters)
    e0, e1, e2, e3 = parameters
    return e0 / size, e1 / size, e2 / size, e3 / size
