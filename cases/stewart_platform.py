"""Closed form of a Stewart platform whose legs change in two groups of three.

The platform lifts and turns, and stays level and centred. Legs k = 0, 1, 2 of the two groups start
on the base circle, at 120 k + 10 and 120 k - 10 degrees. They end on the platform's circle, turned
by +A and -A from there. With the platform turned by t and lifted to h their squared lengths are

    R^2 + r^2 - 2 R r cos(A + t) + h^2    and    R^2 + r^2 - 2 R r cos(A - t) + h^2.

Their difference,  4 R r sin A sin t,  gives t. Either of them then gives h.
"""

from __future__ import annotations

import math

from .jet import Jet, Motion, constant, sqrt

R, r, H = 1.0, 0.6, 1.2  # radii of base and platform, height at design [m]
A = math.radians(40.0)  # from the foot of a leg to its head, seen from above
AT = math.radians(50.0)  # direction of the first leg's head at design
LENGTH = math.sqrt(R * R + r * r - 2.0 * R * r * math.cos(A) + H * H)  # of all legs at design


def motion(a0: Jet, a1: Jet, a2: Jet, b0: Jet, b1: Jet, b2: Jet) -> Motion:
    """Return the platform's centre and the first leg's head, the legs lengthened by a in the first
    group, by b in the second [m].

    Raises:
        ValueError: the legs of a group differ; there is no closed form then.
    """
    if any((one.x != other.x).any() for one, other in ((a0, a1), (a0, a2), (b0, b1), (b0, b2))):
        raise ValueError(
            "the legs of a group differ, expected them equal; the 3-2-1 platform has a closed form"
            " for unequal ones"
        )
    a, b = a0 + LENGTH, b0 + LENGTH
    s = (a * a - b * b) / (4.0 * R * r * math.sin(A))
    c = sqrt(1.0 - s * s)
    h = sqrt(a * a - (R * R + r * r) + 2.0 * R * r * (math.cos(A) * c - math.sin(A) * s))
    zero = constant(0.0, a)
    x, y = r * math.cos(AT), r * math.sin(AT)
    return {"centre": (zero, zero, h), "head": (x * c - y * s, x * s + y * c, h)}
