"""Two loops on one crank with the same singular poses: the determinant of all rows changes its sign
twice there, so that it shows nothing.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ...truth.motion import closed
from .base import Family, Rng, Specimen, as_case
from .dimensions import nearly_kite, nearly_parallel, rockers
from .pairs import beside, beside_motion
from .planar import JOINTS_OF_A_LOOP, Plan, any_plane, flats, four_bar, four_bar_motion

TURN, TWIN = 0.97 * np.pi, "twin "


def _rockers(rng: Rng) -> tuple[Plan, Plan, Plan, float]:
    """Return the points of a four-bar that is far from any singular shape."""
    return *rockers(rng), 1.0


SHAPES = {"parallelograms": nearly_parallel, "kites": nearly_kite, "rockers": _rockers}


class Twins(Family):
    """Two simultaneous singularities."""

    name = "twins"
    about = (
        "two equal loops on one crank, with equal or different joints, so that the sign of the"
        " whole determinant shows no singular pose: parallelograms (exact, and off by 1e-12 to"
        " 1e-2), kites, and four-bars driven past their dead centres"
    )

    samples = 61

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return two equal loops on one crank."""
        plane, (first, second) = any_plane(rng), rng.choice(JOINTS_OF_A_LOOP, 2).tolist()
        kind = tuple(SHAPES)[int(rng.integers(len(SHAPES)))]
        b, d, c, off = SHAPES[kind](rng)
        motion = four_bar_motion(plane, b, d, c, parallel=kind == "parallelograms" and off == 0.0)
        mechanism = beside(four_bar(plane, b, d, c, first), plane, b, d, c, second, TWIN)
        return Specimen(
            f"{kind} with {first} and {second}, off by {off:.2g}",
            partial(as_case, mechanism, "turn", np.linspace(-TURN, TURN, samples)),
            partial(closed, motion=beside_motion(motion, motion, TWIN), nearest=flats(b, d)),
            facts=(("off", off),),
        )
