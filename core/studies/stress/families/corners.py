"""Four-bars near their change points, in coarse steps: redundant rows or a second loop must not
hide the sharp corners of their motion.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from ...truth.motion import closed
from ...truth.rows import extended
from .base import Family, Rng, Specimen, as_case, power
from .dimensions import crank_rocker
from .pairs import beside, beside_motion
from .planar import JOINTS_OF_A_LOOP, Plan, any_plane, flats, four_bar, four_bar_motion, meet

# Smallest relative area of a design: the coordinates of a nearly folded shape have too few digits.
FOLDED = 0.05
SMALL = "small "

# Lengths of crank, ground, coupler and rocker, from three sizes and an error.
SHAPES: Mapping[str, Callable[[float, float, float, float], tuple[float, float, float, float]]] = {
    "kite": lambda a, g, x, off: (g + off, g, x, x),
    "kite on its side": lambda a, g, x, off: (a, g, a + off, g),
    "parallelogram": lambda a, g, x, off: (a, g, g + off, a),
    "stretched four-bar": lambda a, g, x, off: (a, g, x, a + g - x + off),
    "folded four-bar": lambda a, g, x, off: (a, g, x, x + abs(g - a) + off),
}


class Corners(Family):
    """Motions with a sharp turn, or a narrowly missed passage, anywhere along a step."""

    name = "corners"
    about = (
        "four-bars of any sizes, off by 1e-7 to 0.1 from kites, parallelograms and others that can"
        " lie flat, from anywhere in coarse steps: rods on hinges (three redundant rows), on two"
        " universals (one), and on what leaves none; half of them with a regular loop of 1e-3 to"
        " 0.3 of their size on the same crank"
    )

    samples = 31

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a random four-bar, half of them beside a regular loop."""
        plane, way = any_plane(rng), str(rng.choice(["universals", "revolutes", *JOINTS_OF_A_LOOP]))
        off = power(rng, -7.0, -1.0) * float(rng.choice([-1.0, 1.0]))
        kind = tuple(SHAPES)[int(rng.integers(len(SHAPES)))]
        b, d, c = _loop(rng, kind, off)
        last = float(rng.uniform(2.0, 6.2) * rng.choice([-1.0, 1.0]))
        mechanism, motion = four_bar(plane, b, d, c, way), four_bar_motion(plane, b, d, c)
        name, facts = f"{kind} with {way}, off by {off:.2g}", [("off", off)]
        # the small loop's singular values are always small, and hide the singular values of the
        # large loop
        if rng.random() < 0.5:
            ratio, hung = power(rng, -3.0, -0.5), str(rng.choice(JOINTS_OF_A_LOOP))
            small = crank_rocker(rng, ratio)
            mechanism = beside(mechanism, plane, *small, hung, SMALL)
            motion = beside_motion(motion, four_bar_motion(plane, *small), SMALL)
            name, facts = (
                f"{name}, beside a loop of {ratio:.2g} with {hung}",
                [*facts, ("ratio", ratio)],
            )
        return Specimen(
            name,
            partial(as_case, mechanism, "turn", np.linspace(0.0, last, samples)),
            partial(closed, motion=motion, nearest=flats(b, d)),
            facts=tuple(facts),
        )


def _loop(rng: Rng, kind: str, off: float) -> tuple[Plan, Plan, Plan]:
    """Return B, D and C of a four-bar of this kind, at any unfolded pose."""
    while True:
        a, g, x = (float(each) for each in rng.uniform(0.3, 1.5, 3))
        crank, ground, coupler, rocker = SHAPES[kind](a, g, x, off)
        turn, side = float(rng.uniform(-np.pi, np.pi)), float(rng.choice([-1.0, 1.0]))
        b: Plan = (float(crank * np.cos(turn)), float(crank * np.sin(turn)))
        d: Plan = (ground, 0.0)
        pin, rest = (extended(each)[:, None] for each in (b, d))
        met = meet(pin, extended([coupler]) ** 2, rest, extended([rocker]) ** 2, side)
        c: Plan = (float(met[0, 0]), float(met[1, 0]))
        # twice the area; NaN if the circles do not meet
        twice = (c[0] - b[0]) * (d[1] - b[1]) - (c[1] - b[1]) * (d[0] - b[0])
        if min(coupler, rocker) > 0.1 and abs(twice) > FOLDED * float(
            np.hypot(d[0] - b[0], d[1] - b[1])
        ):
            return b, d, c
