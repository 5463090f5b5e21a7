"""Sizes: very small and large mechanisms, distant origins, and links of very different lengths."""

from __future__ import annotations

from functools import partial
from typing import ClassVar

import numpy as np

from ....algebra import triple
from ...truth.motion import closed
from .base import Family, Rng, Specimen, as_case, power
from .dimensions import crank_rocker, turning_crank
from .planar import (
    JOINTS_OF_A_LOOP,
    Plan,
    Plane,
    any_plane,
    flat_plane,
    four_bar,
    four_bar_motion,
    slider_crank,
    slider_crank_motion,
)

TURN = np.pi
"""Rotation of a crank to either side of the design [rad]: one full turn in total."""


def linkage(
    rng: Rng,
    plane: Plane,
    samples: int,
    *,
    scale: float = 1.0,
    grid: float = 0.0,
    rate: float = 1.0,
) -> Specimen:
    """Return a four-bar or a slider-crank, whose crank makes one full turn."""
    way, turn = str(rng.choice(JOINTS_OF_A_LOOP)), np.linspace(-TURN, TURN, samples)
    if rng.random() < 0.5:
        points = crank_rocker(rng, scale, grid)
        mechanism, motion = four_bar(plane, *points, way), four_bar_motion(plane, *points)
    else:
        b, c = (_times(scale, each) for each in turning_crank(rng, grid))
        mechanism = slider_crank(plane, b, c, way, "turn")
        motion = slider_crank_motion(plane, b, c, "turn")
    return Specimen(
        f"{mechanism.name} with {way}",
        partial(as_case, mechanism, "turn", turn, rate=rate),
        partial(closed, motion=motion),
    )


def _times(scale: float, at: Plan) -> Plan:
    return scale * at[0], scale * at[1]


class Units(Family):
    """Mechanisms from one micrometre to one kilometre."""

    name = "units"
    about = "four-bars and slider-cranks of 1e-6 to 1e3 m in any orientation, one turn"

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a linkage of random size, at a similar distance from the origin."""
        scale, plane = power(rng, -6.0, 3.0), any_plane(rng)
        return linkage(rng, Plane(scale * plane.origin, plane.e1, plane.e2), samples, scale=scale)


class Offset(Family):
    """Mechanisms far from the origin of their coordinates."""

    name = "offset"
    about = (
        "four-bars and slider-cranks of 1 m, up to 1e7 m from the origin, coordinates on a grid"
        " that avoids rounding"
    )
    GRID: ClassVar[float] = 2.0**-20

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a linkage in a plane along the global axes.

        A double holds both the 24 bits of the offset and the 20 bits of the grid.
        """
        origin = np.round(rng.uniform(-1.0, 1.0, 3) * power(rng, 0.0, 7.0) / self.GRID) * self.GRID
        return linkage(rng, flat_plane(rng, np.array(triple(origin))), samples, grid=self.GRID)


class Ratios(Family):
    """Links down to a millionth of the other lengths."""

    name = "ratios"
    about = "cranks, and cranks with rockers, of 1e-6 to 1 of the other links' lengths, one turn"

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a slider-crank with a short crank, or a four-bar with two opposite short bars or
        one short crank.
        """
        plane, way, turn = (
            any_plane(rng),
            str(rng.choice(JOINTS_OF_A_LOOP)),
            np.linspace(-TURN, TURN, samples),
        )
        ratio, at = power(rng, -6.0, 0.0), rng.uniform(0.3, 2.8)
        short: Plan = (0.3 * ratio * float(np.cos(at)), 0.3 * ratio * float(np.sin(at)))
        kind = int(rng.integers(3))
        facts = (("ratio", ratio),)
        if kind == 0:
            c: Plan = (float(rng.uniform(1.0, 1.3)), 0.0)
            mechanism, motion = (
                slider_crank(plane, short, c, way, "turn"),
                slider_crank_motion(plane, short, c, "turn"),
            )
        else:
            d: Plan = (1.0, 0.0)
            # the rocker is 1.3 / 0.3 times the crank and perpendicular to the ground, or about as
            # long as the other links
            c = (
                (1.0, 1.3 * ratio)
                if kind == 1
                else (float(rng.uniform(0.4, 0.6)), float(rng.uniform(0.6, 0.8)))
            )
            mechanism, motion = (
                four_bar(plane, short, d, c, way),
                four_bar_motion(plane, short, d, c),
            )
        return Specimen(
            f"{mechanism.name} with {way}, ratio {ratio:.3g}",
            partial(as_case, mechanism, "turn", turn),
            partial(closed, motion=motion),
            facts=facts,
        )
