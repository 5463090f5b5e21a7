"""Closed form of the planar four-bar: the coupler pin is an intersection of two circles.

In the plane of motion, its distance from the crank pin is the coupler's length, and its distance
from the rocker's pivot is the rocker's length. The linkage is a crank-rocker (shortest + longest =
0.39 m < 0.446 m, Grashof). It never stretches out, so the coupler pin stays on the side of the
design.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..core.mechanism.mechanism import Mechanism
from .dynamics import Three, effort, standing
from .jet import Jet, Lanes, Motion, constant, cos, sin
from .vectors import Numbers, Vec, fixed, meet_in_plane

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
    """Return points of the mechanism with the crank turned from the design by `turn` [rad]."""
    crank_pin, coupler_pin = pins(turn)
    d = coupler_pin - crank_pin
    tip = crank_pin + ALONG * d + ACROSS * Vec(-d.y, d.x, d.z)
    return {"coupler_pin": in_space(coupler_pin), "coupler_tip": in_space(tip)}


def in_space(point: Vec) -> Vec:
    """Return the global coordinates of in-plane ones."""
    return fixed(A, point.x) + Vec(
        *(e1 * point.x + e2 * point.y for e1, e2 in zip(E1, E2, strict=True))
    )


def pins(turn: Jet) -> tuple[Vec, Vec]:
    """Return crank pin and coupler pin in the plane of motion."""
    zero = constant(0.0, turn)
    crank_pin = Vec(-CRANK * sin(turn), CRANK * cos(turn), zero)
    pivot = fixed((*D, 0.0), turn)
    return crank_pin, meet_in_plane(crank_pin, COUPLER_SQUARED, pivot, ROCKER_SQUARED, 1.0)


def bodies(turn: Jet) -> Mapping[str, Three]:
    """Return three points of each body."""
    base, pivot = in_space(fixed((0.0, 0.0, 0.0), turn)), in_space(fixed((*D, 0.0), turn))
    B, C = map(in_space, pins(turn))
    normal = fixed((2 / 3, -1 / 3, 2 / 3), turn)
    return {
        "crank": (base, B, base + normal),
        "coupler": (B, C, B + normal),
        "rocker": (pivot, C, pivot + normal),
    }


def forces(mechanism: Mechanism, turn: Jet) -> Mapping[str, Lanes]:
    """Return the torque of the crank, and the force of the coupler on the rocker in the plane.

    The moments of the coupler about the crank pin and of the rocker about its pivot give two
    equations for the two components.
    """
    pin, at = pins(turn)
    pivot = fixed((*D, 0.0), turn)
    coupler, rocker = at - pin, at - pivot
    designs = pins(standing(turn))
    origins = designs[0], fixed((*D, 0.0), designs[0].x)
    moments: list[Lanes] = []
    for body, start, arm, origin in zip(
        mechanism.moving[1:], (pin, pivot), (coupler, rocker), origins, strict=True
    ):
        before = designs[1] - origin
        center = in_plane(np.subtract(body.center_of_mass or body.origin, A).tolist())
        x, y = center[0] - float(origin.x.x[0]), center[1] - float(origin.y.x[0])
        p, q = float(before.x.x[0]), float(before.y.x[0])
        square = p * p + q * q
        along, across = (x * p + y * q) / square, (y * p - x * q) / square
        to_center = along * arm + across * Vec(-arm.y, arm.x, arm.z)
        place = start + to_center
        g = in_plane(mechanism.gravity)
        falling = to_center.x.x * (place.y.a - g[1]) - to_center.y.x * (place.x.a - g[0])
        turned = (arm.x.x * arm.y.a - arm.y.x * arm.x.a) / square
        moments.append(about_normal(body.inertia) * turned + body.mass * falling)
    u, w = rocker, coupler
    turns = w.x.x * u.y.x - w.y.x * u.x.x
    of_coupler, of_rocker = moments
    found = {
        f"coupler_pin_force_{axis}": -(of_coupler * b.x + of_rocker * c.x) / turns
        for axis, b, c in (("e1", u.x, w.x), ("e2", u.y, w.y))
    }
    return found | {"crank_torque": effort(mechanism, turn, bodies)}


def in_plane(vector: Numbers) -> tuple[float, float]:
    """Return the in-plane components of a global vector."""
    return float(np.dot(E1, vector)), float(np.dot(E2, vector))


def about_normal(inertia: Numbers | None) -> float:
    """Return the moment of inertia about the normal of the plane."""
    xx, yy, zz, xy, yz, xz = inertia or (0.0,) * 6
    n = np.array((2 / 3, -1 / 3, 2 / 3))
    return float(n @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ n)
