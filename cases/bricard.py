"""Closed form of the threefold symmetric Bricard linkage.

Six links of 1 m and six revolutes, neighbouring axes at right angles. The angles between
neighbouring links are alternately p and q, with  cos p + cos q + cos p cos q = 0  (Chen, You and
Tarnai, Threefold-symmetric Bricard linkages for deployable structures, Int. J. Solids Structures
42, 2005). The benchmark starts as six edges of a cube: p = q = 90 degrees. At p = 120 degrees q is
zero; this is the driver's dead centre.

From link to link, the direction u turns about the axis z by the angle. The axis then turns about
the new u by a right angle, to one side and the other: the next axis is  -u x z,  then  u x z.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..core.mechanism.mechanism import Mechanism
from .dynamics import Three, effort
from .jet import Jet, Lanes, Motion, cos, sin, sqrt
from .vectors import cross, fixed


def motion(turn: Jet) -> Motion:
    """Return the ends of the links after the grounded one, its neighbour turned from the design by
    `turn` [rad].
    """
    return {f"P{k + 2}": end for k, (_, end, _) in enumerate(chain(turn))}


def chain(turn: Jet) -> list[Three]:
    """Return start, end and a point of the end's hinge, of four links from the ground on."""
    c, s = -sin(turn), cos(turn)  # of p = 90 degrees + turn
    d = -(c / (1.0 + c))  # cosine of q
    angles = (c, s), (d, sqrt(1.0 - d * d))
    point, u, z = (
        fixed((1.0, 0.0, 0.0), turn),
        fixed((1.0, 0.0, 0.0), turn),
        fixed((0.0, 0.0, -1.0), turn),
    )
    links: list[Three] = []
    for k in range(4):
        cosine, sine = angles[k % 2]
        u = cosine * u + sine * cross(z, u)
        z = (1.0 if k % 2 else -1.0) * cross(u, z)
        links.append((point, point + u, point + u + z))
        point = point + u
    return links


def bodies(turn: Jet) -> Mapping[str, Three]:
    """Return three points of each body."""
    links = {f"link{k}": link for k, link in enumerate(chain(turn), 1)}
    origin = fixed((0.0, 0.0, 0.0), turn)
    return links | {"link5": (links["link4"][1], origin, fixed((0.0, -1.0, 0.0), turn))}


def forces(mechanism: Mechanism, turn: Jet) -> Mapping[str, Lanes]:
    """Return the torque of the driven hinge."""
    return {"hinge_torque": effort(mechanism, turn, bodies)}
