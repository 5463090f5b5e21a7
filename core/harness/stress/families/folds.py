"""Coarse sweeps of small closed mechanisms that end at a fold, pass near one, or ask for more than there is."""

from __future__ import annotations

from functools import partial

import numpy as np

from ....motions import Motion, Sine
from ..turning import turning
from .base import Family, Rng, Specimen, as_case, power
from .loops import Builder

LARGEST, DRIVERS = 4, 3
# A fold is looked for so many times as far as the rates at design would turn something by a third to a whole radian.
FARTHER = 5.0
# A sample stands before the fold by such a part of the way there; the next one is beyond it by a step of so many times that way:
# [powers of ten].
BEFORE, STEP = (-4.0, -0.3), (-1.0, 0.7)


class Folds(Family):
    """Steps so long that a motion may turn round between two samples, and another assembly go on."""

    name = "folds"
    about = (
        f"random closed mechanisms of 1 to {LARGEST} bodies, all joint types, gears and racks, 1 to {DRIVERS} drivers that move "
        "at once, in 2 to 4 samples: most have one 1e-4 to 0.5 of the way before a fold, and the next one far beyond it"
    )

    samples = 2

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """A sweep past the first fold, where there is one; the drivers that are not swept swing."""
        found = None
        while found is None:
            count = int(rng.integers(1, LARGEST + 1))
            found = Builder(rng, count, DRIVERS).built()
        mechanism, reach = found
        driver, stop = mechanism.drivers[0].name, FARTHER * reach

        def swing() -> Motion:
            return Sine(float(rng.uniform(-1.0, 1.0)) * reach, float(rng.uniform(0.05, 0.3)) / reach)

        motions = {driver.name: swing() for driver in mechanism.drivers[1:]}
        fold = turning(as_case(mechanism, driver, np.array([stop]), motions=motions), stop)
        last = stop if fold is None else fold * (1.0 - power(rng, *BEFORE))
        step = (last if fold is None else fold) * power(rng, *STEP)
        return Specimen(
            f"mechanism of {count} bodies, {len(mechanism.drivers)} drivers",
            partial(as_case, mechanism, driver, last + step * np.arange(2.0 - samples, 2.0), motions=motions),
            facts=(("bodies", count),),
        )
