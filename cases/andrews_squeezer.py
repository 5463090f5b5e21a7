"""Closed form of Andrews' squeezing mechanism.

Every further point, from the crank on, is an intersection of two circles. Names and numbers are
those of the Bari test set for initial value problems (problem andrews; Hairer and Wanner, Solving
Ordinary Differential Equations II, VII.7). The crank leads from the origin to F, a rod from there
to E; E is also on the circle of the triangle B D E about B. Two rods each lead over G and over H
from E to A. The published start selects the intersections.
"""

from __future__ import annotations

from collections.abc import Mapping

from ..core.mechanism.mechanism import Mechanism
from .dynamics import Three, effort
from .jet import Jet, Lanes, Motion, cos, sin
from .vectors import Vec, fixed, meet_in_plane

# with the misprint x = +0.03635 for B, the loops do not close
A, B = (-0.06934, -0.00227, 0.0), (-0.03635, 0.03273, 0.0)
# OF, FE, BE, EG, AG, EH, AH [m]
RR, D_, SS, E_, ZT, ZF, U = 0.007, 0.028, 0.035, 0.02, 0.04, 0.02, 0.04
SC, SD = 0.018, 0.02  # D of the triangle: from B along B E, and to its left [m]
START = -0.0617138900142764496358948458001  # published crank angle beta at the start [rad]


def motion(turn: Jet) -> Motion:
    """Return points of the mechanism, the crank turned from the published start by `turn` [rad]."""
    beta = START + turn
    a, b = fixed(A, turn), fixed(B, turn)
    F = RR * Vec(cos(beta), sin(beta), a.z)
    E = meet_in_plane(F, D_**2, b, SS**2, 1.0)
    G, H = meet_in_plane(a, ZT**2, E, E_**2, 1.0), meet_in_plane(a, U**2, E, ZF**2, -1.0)
    along = (1.0 / SS) * (E - b)
    D = b + SC * along + SD * Vec(-along.y, along.x, a.z)
    return {"F": F, "E": E, "D": D, "G": G, "H": H}


def bodies(turn: Jet) -> Mapping[str, Three]:
    """Return three points of each body."""
    at = {name: Vec(*point) for name, point in motion(turn).items()}
    a, b, z = fixed(A, turn), fixed(B, turn), fixed((0.0, 0.0, 1.0), turn)
    E, F, G, H = (at[name] for name in "EFGH")
    ends = (fixed((0.0, 0.0, 0.0), turn), F), (F, E), (b, E), (E, G), (a, G), (E, H), (a, H)
    return {f"K{k}": (start, end, start + z) for k, (start, end) in enumerate(ends, 1)}


def forces(mechanism: Mechanism, turn: Jet) -> Mapping[str, Lanes]:
    """Return the torque of the crank."""
    return {"crank_torque": effort(mechanism, turn, bodies)}
