"""Closed form of the RSSR linkage: two revolute pivots, joined by a rod between spherical joints.

The crank pin is  a (cos t, sin t, 0).  The rocker pin is on the circle  O + b (0, cos s, sin s),
at the rod's length from the crank pin. The circle has two such points, one for each assembly. The
crank turns fully in both assemblies, so neither ever meets the other.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from ..core.mechanism.mechanism import Mechanism
from .dynamics import Three, effort, standing
from .jet import Jet, Lanes, Motion, constant, cos, sin
from .vectors import Circle, Vec, fixed

CRANK, ROCKER, ROD = 1.0, 4.0, 5.5  # a, b, l [m]
O = (2.0, 1.0, 3.0)  # noqa: E741  a point on the rocker's axis, which is along x [m]
# the tip is beyond the pivot: this far along x, and at this radius opposite to the pin [m]
ARM = (0.5, 2.0)


def motion(turn: Jet, side: float = 1.0) -> Motion:
    """Return the points of the mechanism, the crank turned from the design by `turn` [rad].

    Args:
        side: the assembly, +1 or -1.
    """
    crank_pin = Vec(CRANK * cos(turn), CRANK * sin(turn), constant(0.0, turn))
    rocker_pin = Circle(O, (0.0, ROCKER, 0.0), (0.0, 0.0, ROCKER)).meet(crank_pin, ROD, side)
    pivot = fixed(O, turn)
    tip = pivot + fixed((ARM[0], 0.0, 0.0), turn) + (ARM[1] / ROCKER) * (pivot - rocker_pin)
    return {"crank_pin": crank_pin, "rocker_pin": rocker_pin, "rocker_tip": tip}


def other_branch(turn: Jet) -> Motion:
    """Return the points in the other assembly."""
    return motion(turn, -1.0)


def forces(mechanism: Mechanism, turn: Jet, side: float = 1.0) -> Mapping[str, Lanes]:
    """Return the torque of the crank, and the force of the rod on the rocker along y and z.

    The rod pulls along itself; the rocker's moment about its axis gives the tension.
    """
    rocker = mechanism.moving[1]
    at = motion(turn, side)
    crank_pin, pin = Vec(*at["crank_pin"]), Vec(*at["rocker_pin"])
    arm, rod = pin - fixed(O, turn), crank_pin - pin
    design = motion(standing(turn), side)
    y0, z0 = (float(x.x[0]) - o for x, o in zip([*design["rocker_pin"]][1:], O[1:], strict=True))
    turned = (arm.y.x * arm.z.a - arm.z.x * arm.y.a) / ROCKER**2
    _, y, z = (x - o for x, o in zip(rocker.center_of_mass or rocker.origin, O, strict=True))
    along, across = (y * y0 + z * z0) / ROCKER**2, (z * y0 - y * z0) / ROCKER**2
    center_y, center_z = along * arm.y - across * arm.z, along * arm.z + across * arm.y
    inertia = (rocker.inertia[0] if rocker.inertia else 0.0) + rocker.mass * (y * y + z * z)
    _, gy, gz = mechanism.gravity
    moment = inertia * turned - rocker.mass * (center_y.x * gz - center_z.x * gy)
    tension = moment / (arm.y * rod.z - arm.z * rod.y).x  # per length of the rod
    torque = effort(mechanism, turn, partial(bodies, side=side))
    return {
        "crank_torque": torque,
        "rod_force_y": tension * rod.y.x,
        "rod_force_z": tension * rod.z.x,
    }


def bodies(turn: Jet, side: float) -> Mapping[str, Three]:
    """Return three points of each body."""
    at, origin, pivot = motion(turn, side), fixed((0.0, 0.0, 0.0), turn), fixed(O, turn)
    return {
        "crank": (origin, Vec(*at["crank_pin"]), fixed((0.0, 0.0, 1.0), turn)),
        "rocker": (pivot, Vec(*at["rocker_pin"]), pivot + fixed((1.0, 0.0, 0.0), turn)),
    }


def other_branch_forces(mechanism: Mechanism, turn: Jet) -> Mapping[str, Lanes]:
    """Return the forces in the other assembly."""
    return forces(mechanism, turn, -1.0)
