"""Closed form of a Gough platform of the 3-2-1 kind; its six legs change independently.

Three legs lead to the first point, two to the second, one to the third. Each point is an
intersection of three spheres. Their centres are feet of legs, and known points at constant
distances.
"""

from __future__ import annotations

import math

from .jet import Jet, Motion, constant
from .vectors import Vec, carried, fixed, meet_in_space

# at design [m]
FEET = (
    (0.0, 0.0, 0.0),
    (1.0, 0.1, 0.0),
    (0.2, 0.9, 0.1),
    (1.2, -0.2, 0.0),
    (1.1, 0.9, 0.1),
    (0.4, 1.1, 0.0),
)
HEADS = ((0.4, 0.3, 0.9), (1.0, 0.4, 1.0), (0.5, 0.9, 0.8))
TOOL = (0.6, 0.5, 1.3)


def motion(a: Jet, b: Jet, c: Jet, d: Jet, e: Jet, f: Jet) -> Motion:
    """Return the platform's three points and its tool, the legs lengthened from the design by these
    lengths [m].
    """
    feet, heads = [fixed(foot, a) for foot in FEET], tuple(fixed(head, a) for head in HEADS)
    A, B, C, D, E, F = (
        _squared(change + math.dist(foot, HEADS[head]))
        for change, foot, head in zip((a, b, c, d, e, f), FEET, (0, 0, 0, 1, 1, 2), strict=True)
    )
    one_two, one_three, two_three = (
        constant(math.dist(HEADS[i], HEADS[j]) ** 2, a) for i, j in ((0, 1), (0, 2), (1, 2))
    )
    one = meet_in_space(feet[0], A, feet[1], B, feet[2], C, 1.0)
    two = meet_in_space(one, one_two, feet[3], D, feet[4], E, 1.0)
    three = meet_in_space(one, one_three, two, two_three, feet[5], F, 1.0)
    first, second, third = heads
    found: tuple[Vec, Vec, Vec] = one, two, three
    return {
        "first": one,
        "second": two,
        "third": three,
        "tool": carried((first, second, third), found, fixed(TOOL, a)),
    }


def _squared(a: Jet) -> Jet:
    return a * a
