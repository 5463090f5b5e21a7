"""Closed form of the McPherson strut of SAE 943745, driven at arm and rack.

Joint points are reconstructed as in mcpherson_strut.
"""

from __future__ import annotations

from .jet import Jet, Motion
from .suspension import Arm, Upright, macpherson

ARM = Arm((2.17, 0.353, 0.005), (1.17, 0.353, 0.005), (0.9676, 0.66, -0.01))  # hinged along x
TOP, CLAMP = (1.0, 0.55, 0.6), (0.97772, 0.605, 0.18)
UPRIGHT = Upright((1.14, 0.355, 0.1455), (1.115, 0.665, 0.118), (0.975, 0.715, 0.101))


def motion(turn: Jet, rack: Jet) -> Motion:
    """Return the points of the suspension, the arm turned by `turn` [rad] and the rack shifted
    along y by `rack` [m] from the design.
    """
    return macpherson(ARM, TOP, CLAMP, UPRIGHT, turn, rack)
