"""Coarse sweeps of small closed mechanisms that end at a fold or pass near one."""

from __future__ import annotations

from functools import partial

import numpy as np

from ....mechanism.motions import Motion, Sine
from ..truth.first_fold import turning
from .base import Family, Rng, Specimen, as_case, power
from .loops import Builder

LARGEST, DRIVERS = 4, 3
# A fold is looked for so many times as far as the rates at design would turn something by a third
# of a radian to a whole one.
FARTHER = 5.0
# A sample stands before the fold by such a part of the way there. The next one is ahead by so many
# times that way: [powers of ten].
BEFORE, STEP = (-4.0, -0.3), (-1.0, 0.7)


class Folds(Family):
    """Steps so long that a motion may turn round between two samples, and another assembly go
    on.
    """

    name = "folds"
    about = (
        f"random closed mechanisms of 1 to {LARGEST} bodies, all joint types, gears and racks, 1 to"
        f" {DRIVERS} drivers that move at once, in 2 to 4 samples: most have one sample 1e-4 to 0.5"
        " of the way before a fold, and the next one far beyond it"
    )

    samples = 2

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a sweep past the first fold, where there is one; the other drivers swing."""
        while True:
            count = int(rng.integers(1, LARGEST + 1))
            found = Builder(rng, count, DRIVERS).built()
            if found is not None:
                break
        mechanism, reach = found
        driver, stop = mechanism.drivers[0].name, FARTHER * reach

        def swing() -> Motion:
            amplitude, turns = rng.uniform(-1.0, 1.0), rng.uniform(0.05, 0.3)
            return Sine(float(amplitude) * reach, float(turns) / reach)

        motions = {driver.name: swing() for driver in mechanism.drivers[1:]}
        fold = turning(as_case(mechanism, driver, np.array([stop]), motions=motions), stop)
        last = stop if fold is None else fold * (1.0 - power(rng, *BEFORE))
        step = (last if fold is None else fold) * power(rng, *STEP)
        values = np.linspace(last - (samples - 2) * step, last + step, samples)
        return Specimen(
            f"mechanism of {count} bodies, {len(mechanism.drivers)} drivers",
            partial(as_case, mechanism, driver, values, motions=motions),
            facts=(("bodies", count),),
        )
