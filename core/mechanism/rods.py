"""Rods with rubber at their ends: bodies without mass in place of distance joints."""

from __future__ import annotations

import math

from ..errors import MechanismError, Phrase
from ..joints import Distance
from ..joints.distance import NOTED
from .loads import Bushing

# A bushing's point and an end of its rod are one, as the digits of files have it, if they are not
# further apart than this part of the rod's length.
SAME_PLACE = 1e-5


def end_of(rod: Distance, bushing: Bushing) -> int:
    """Return the end of a rod at which its bushing is: 0 or 1.

    Raises:
        MechanismError: the bushing is at neither end, or acts on other bodies, or the rod has
            another length than its points at design.
    """
    who, key = f"joints.{rod.name}", bushing.name.removeprefix(f"{rod.name}.")
    if abs(rod.rod_length - rod.design_distance) > NOTED * rod.design_distance:
        raise MechanismError(
            f"{rod}: it has bushings, and a length that is not the distance of its points; leave"
            " length out, or move the points",
            f"{who}.length",
        )
    if {*bushing.bodies} != {rod.i, rod.j}:
        raise MechanismError(
            f"{bushing}: its bodies are not those of the rod, {rod.i!r} and {rod.j!r}; leave bodies"
            " out",
            f"{who}.bushings.{key}.bodies",
        )
    apart = [math.dist(bushing.point, end) for end in rod.points]
    if min(apart) > SAME_PLACE * rod.design_distance:
        (a, b, c), (d, e, f) = rod.points
        raise MechanismError(
            Phrase(
                f"{bushing}: its point is at neither end of the rod; give the one on {rod.i!r}, [",
                *(a, ", ", b, ", ", c, f"], or on {rod.j!r}, [", d, ", ", e, ", ", f, "]"),
            ),
            f"{who}.bushings.{key}.point",
        )
    return apart.index(min(apart))
