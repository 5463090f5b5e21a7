"""Strokes beyond reach: no engine may have values at a pose without an assembly."""

from __future__ import annotations

from functools import partial

import numpy as np

from ...truth.motion import closed
from .base import Family, Rng, Specimen, as_case, power
from .dimensions import rockers
from .planar import (
    JOINTS_OF_A_LOOP,
    Plan,
    any_plane,
    four_bar,
    four_bar_motion,
    slider_crank,
    slider_crank_motion,
)


class Reach(Family):
    """Drivers beyond the reach of the mechanism."""

    name = "reach"
    about = (
        "sliders driven past the stretched rod, rockers past their dead centres, struts and tie"
        " rods within 1e-6 of them at design"
    )

    samples = 81

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a driven slider, or a four-bar whose driven bar cannot turn fully."""
        plane, way = any_plane(rng), str(rng.choice(JOINTS_OF_A_LOOP))
        if rng.random() < 0.5:
            crank, rod = float(rng.uniform(0.2, 0.6)), float(rng.uniform(0.7, 1.3))
            # the angle at the crank pin: stretched out at 0, folded at pi
            bend = power(rng, -6.0, 0.0) if rng.random() < 0.5 else float(rng.uniform(0.3, 2.8))
            c: Plan = (float(np.sqrt(crank**2 + rod**2 + 2.0 * crank * rod * np.cos(bend))), 0.0)
            up = float(np.arctan2(rod * np.sin(bend), crank + rod * np.cos(bend)))
            b: Plan = (crank * float(np.cos(up)), crank * float(np.sin(up)))
            stroke = np.linspace(
                -1.2 * (c[0] - abs(rod - crank)), 1.2 * (crank + rod - c[0]) + 0.1 * crank, samples
            )
            mechanism, motion = (
                slider_crank(plane, b, c, way, "slide"),
                slider_crank_motion(plane, b, c, "slide"),
            )
            return Specimen(
                f"slider_crank with {way}, bend {bend:.3g}",
                partial(as_case, mechanism, "slide", stroke),
                partial(closed, motion=motion),
                facts=(("bend", bend),),
            )
        b, d, c = rockers(rng)
        turn = np.linspace(-TURN, TURN, samples)
        return Specimen(
            f"four_bar with {way}, driven past its dead centres",
            partial(as_case, four_bar(plane, b, d, c, way), "turn", turn),
            partial(closed, motion=four_bar_motion(plane, b, d, c)),
        )


TURN = 0.99 * np.pi
