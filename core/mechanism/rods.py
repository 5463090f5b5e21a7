"""Rods with rubber at their ends: bodies without mass in place of distance joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from ..algebra import vec
from ..errors import MechanismError, Phrase
from ..joints import Distance, Joint, PerpendicularAxes, Spherical
from ..joints.base import triad
from ..joints.distance import NOTED
from .body import Body
from .loads import Bushing

# A bushing's point and an end of its rod are one, as the digits of files have it, if they are not
# further apart than this part of the rod's length.
SAME_PLACE = 1e-5
# An axis of a bushing is across the rod if less than this part of it is along: round-off.
ACROSS = 1e-12


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


def rod_in_rubber(
    rod: Distance, bushings: Sequence[Bushing]
) -> tuple[Body, list[Joint], list[Bushing]]:
    """Return a rod as a body without mass, its joints and its bushings.

    An end without a bushing is a ball joint. If no bushing resists turns about the rod, a row keeps
    it from turning, which carries no torque. Bushings along all axes alike that resist no turn are
    then exactly a spring between the ends, as stiff as both in series.

    Raises:
        MechanismError: a bushing does not fit the rod.
    """
    body = Body(f"rod {rod.name}", rod.points[0])
    ends = [end_of(rod, each) for each in bushings]
    soft = list[Bushing]()
    for k, each in zip(ends, bushings, strict=True):
        far = (rod.j, rod.i)[k]
        i, j = (body.name if name == far else name for name in each.bodies)
        soft.append(replace(each, i=i, j=j))
    neighbors = (rod.i, body.name), (body.name, rod.j)
    joints: list[Joint] = [
        Spherical(f"{rod.name} ball", *neighbors[k], rod.points[k]) for k in (0, 1) if k not in ends
    ]
    along = vec(rod.points[1]) - vec(rod.points[0])
    least = ACROSS * rod.design_distance
    if not any(
        k > 0.0 and abs(vec(axis) @ along) > least
        for each in soft
        for k, axis in zip(each.turning_stiffness, each.triad, strict=True)
    ):
        first, second, _ = triad([*along])
        axes = (first.x, first.y, first.z), (second.x, second.y, second.z)
        joints.append(PerpendicularAxes(f"{rod.name} spin", rod.i, body.name, axes))
    return body, joints, soft
