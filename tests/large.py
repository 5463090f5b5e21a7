"""Mechanisms of any size whose motion is known: every crank turns as the first."""

import numpy as np
from kincheck.core import Body, Inline, JointAngle, Mechanism, Point, Revolute, Spherical, Universal

LEAN = 0.3
"""Of the cranks at design [rad]; at a right angle from upright the mechanisms are singular."""
UP = (0.0, 0.0, 1.0)


def crank_tip(x, turn=0.0):
    """Of a crank of length one whose pivot is at (x, 0, 0), the driver having turned [m], shape (..., 3)."""
    return np.stack(np.broadcast_arrays(x + np.sin(LEAN - turn), np.cos(LEAN - turn), 0.0), axis=-1)


def chain(loops):
    """N four-bar loops (IFToMM A02): parallel unit cranks at (k, 0), tied by couplers of length one; the first is driven.

    12 N + 6 unknowns, as many rows; every loop follows from the one before.
    """
    tips = [tuple(map(float, crank_tip(float(k)))) for k in range(loops + 1)]
    pivots = [Revolute(f"pivot{k}", "ground", f"crank{k}", (float(k), 0.0, 0.0), UP) for k in range(loops + 1)]
    balls = [Spherical(f"ball{k}", f"crank{k}", f"coupler{k}", tips[k]) for k in range(loops)]
    crosses = [
        Universal(f"cross{k}", f"crank{k + 1}", f"coupler{k}", tips[k + 1], (UP, (0.0, 1.0, 0.0))) for k in range(loops)
    ]
    return Mechanism(
        "chain",
        [*(Body(f"crank{k}") for k in range(loops + 1)), *(Body(f"coupler{k}") for k in range(loops))],
        [*pivots, *balls, *crosses],
        [Point("end", f"crank{loops}", tips[loops])],
        [JointAngle("turn", "pivot0")],
    )


BEFORE, AFTER = 1.0, 0.25
"""Heights of a plate's pins above its ball [m]; were they alike, errors would grow by the square of the ring's length."""


def ring_pivots(cranks):
    """x of the pivots of a ring: out in steps of two, and back between them, so that first and last are neighbours too [m]."""
    out = (cranks + 1) // 2
    return np.array([2.0 * k if k < out else 2.0 * (cranks - k) - 1.0 for k in range(cranks)])


def ring(cranks):
    """N parallel unit cranks in a ring, every one but the first between its neighbours by a plate; the first is driven.

    A plate holds a ball of its crank, and by two pins in grooves along the tips of the cranks before and after it; none of its
    loops can be solved before the others. 12 N - 6 unknowns, as many rows: a plate gives one equation between three angles,
    BEFORE d(k+1) = -AFTER d(k) for the differences d at design. Every plate moves along a circle and does not turn.
    """
    tips = [tuple(map(float, each)) for each in crank_tip(ring_pivots(cranks))]
    pivots = [Revolute(f"pivot{k}", "ground", f"crank{k}", (tips[k][0] - float(np.sin(LEAN)), 0.0, 0.0), UP) for k in range(cranks)]
    joints = []
    for k in range(1, cranks):
        after = (k + 1) % cranks
        joints.append(Spherical(f"ball{k}", f"crank{k}", f"plate{k}", tips[k]))
        joints += [
            Inline(f"{which}{k}", f"crank{to}", f"plate{k}", (*tips[to][:2], height), UP)
            for which, to, height in (("before", k - 1, BEFORE), ("after", after, AFTER))
        ]
    return Mechanism(
        "ring",
        [*(Body(f"crank{k}") for k in range(cranks)), *(Body(f"plate{k}") for k in range(1, cranks))],
        [*pivots, *joints],
        [Point(f"tip{k}", f"crank{k}", tips[k]) for k in range(cranks)]
        + [Point(f"plate{k}", f"plate{k}", (*tips[k][:2], BEFORE)) for k in range(1, cranks)],
        [JointAngle("turn", "pivot0")],
    )
