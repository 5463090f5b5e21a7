"""Closed form of the Bennett linkage: four links and four skew hinges, mobile by its geometry.

The linkage has no freedom by count, but one by geometry. Opposite links are alike. Their lengths a
and b are in proportion to the sines of their twists alpha and beta. The step from hinge to hinge is
a turn by an angle about the axis z, a shift by the link's length along the new x, and a turn by the
link's twist about the new x. The angles are p, q, -p and -q with

    tan(p / 2) tan(q / 2) = K = sin((beta + alpha) / 2) / sin((beta - alpha) / 2)

(Bennett, A new mechanism, Engineering 76, 1903). Twists of sines 0.6 and 0.8 make K = 5.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..core.mechanism.mechanism import Mechanism
from .dynamics import Three, effort
from .jet import Jet, Lanes, Motion, cos, sin
from .vectors import Vec, cross, fixed

A, B = 0.3, 0.4  # lengths of coupler and crank [m]
COSINE, SINE = 0.6, 0.8  # of the crank's twist, beta
K = 5.0
# from the crank's pin: along the coupler, across it, and along the hinge [m]
TRACER = (0.2, 0.3, 0.1)


def motion(turn: Jet) -> Motion:
    """Return both hinges of the coupler and a point on it, the crank turned by `turn` [rad] from
    the design with q = 90 degrees.
    """
    c, s = -sin(turn), cos(turn)  # of q
    x, z = fixed((1.0, 0.0, 0.0), turn), fixed((0.0, 0.0, 1.0), turn)
    x = c * x + s * cross(z, x)
    z = COSINE * z + SINE * cross(x, z)
    crank_pin = B * x
    # the squares of sin(q / 2) and of K cos(q / 2), doubled
    near, far = 1.0 - c, (K * K) * (1.0 + c)
    # turned by -p
    x = ((near - far) / (near + far)) * x - (2.0 * K) * (s / (near + far)) * cross(z, x)
    follower_pin = crank_pin + A * x
    along, across, up = TRACER
    return {
        "crank_pin": crank_pin,
        "follower_pin": follower_pin,
        "tracer": crank_pin + along * x + across * cross(z, x) + up * z,
    }


def bodies(turn: Jet) -> Mapping[str, Three]:
    """Return three points of each body."""
    at = {name: Vec(*point) for name, point in motion(turn).items()}
    crank_pin, follower_pin = at["crank_pin"], at["follower_pin"]
    hinge = fixed((-0.3, 0.0, 0.0), turn)
    return {
        "crank": (fixed((0.0, 0.0, 0.0), turn), crank_pin, fixed((0.0, 0.0, 1.0), turn)),
        "coupler": (crank_pin, follower_pin, at["tracer"]),
        "follower": (hinge, follower_pin, hinge + fixed((0.0, 0.6, 0.8), turn)),
    }


def forces(mechanism: Mechanism, turn: Jet) -> Mapping[str, Lanes]:
    """Return the torque of the crank."""
    return {"crank_torque": effort(mechanism, turn, bodies)}
