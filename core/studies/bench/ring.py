"""A ring of coupled loops of any size with a known motion: no loop can be solved alone."""

from __future__ import annotations

import math

from ...joints import Inline, Joint, Revolute, Spherical
from ...mechanism.mechanism import Body, Mechanism, Point, Vector
from ...mechanism.motions import JointAngle

LEAN = 0.3
"""Angle of the cranks at design [rad]; a quarter turn from upright the ring is singular."""
BEFORE, AFTER = 1.0, 0.25
"""Heights of a plate's pins above its ball [m]; with equal heights, errors would grow with the
square of the ring's length.
"""
UP: Vector = (0.0, 0.0, 1.0)


def pivot(k: int, cranks: int) -> float:
    """Return the position of a crank's pivot along x [m]: outwards in steps of two and back in
    between, so that the last is near the first.
    """
    return 2.0 * k if 2 * k < cranks else 2.0 * (cranks - k) - 1.0


def tip(k: int, cranks: int, turn: float = 0.0) -> Vector:
    """Return the tip of a crank at a turn of the driver [m]; all cranks turn alike."""
    return pivot(k, cranks) + math.sin(LEAN - turn), math.cos(LEAN - turn), 0.0


def ring(cranks: int) -> Mechanism:
    """Return three or more parallel unit cranks in a ring; a plate ties each crank but the first,
    which is driven, to both neighbours.

    A plate holds a ball of its crank, and by two pins in grooves along the tips of the cranks
    before and after it. Ball and pins leave one equation between three angles, BEFORE d_k+1 =
    -AFTER d_k between their differences at design, so none of the 2 N - 2 loops can be solved
    before the others. There are 12 N - 6 unknowns and as many rows. Like the chain of
    parallelograms of IFToMM's benchmark A02, it has a known motion: every crank turns like the
    first, and every plate moves without turning.
    """
    tips = [tip(k, cranks) for k in range(cranks)]
    joints: list[Joint] = [
        Revolute(f"pivot{k}", "ground", f"crank{k}", (pivot(k, cranks), 0.0, 0.0), UP)
        for k in range(cranks)
    ]
    for k in range(1, cranks):
        joints.append(Spherical(f"ball{k}", f"crank{k}", f"plate{k}", tips[k]))
        for which, to, height in (("before", k - 1, BEFORE), ("after", (k + 1) % cranks, AFTER)):
            x, y, _ = tips[to]
            joints.append(Inline(f"{which}{k}", f"crank{to}", f"plate{k}", (x, y, height), UP))
    return Mechanism(
        f"ring of {cranks} cranks",
        [
            *(Body(f"crank{k}") for k in range(cranks)),
            *(Body(f"plate{k}") for k in range(1, cranks)),
        ],
        joints,
        [Point(f"tip{k}", f"crank{k}", tips[k]) for k in range(cranks)],
        [JointAngle("turn", "pivot0")],
    )
