"""Coarse sweeps of small closed mechanisms, ending at a fold or passing near one."""

from __future__ import annotations

from functools import partial

import numpy as np

from ....mechanism.motions import Motion, Sine
from ...truth.fold import first_fold
from .base import Family, Rng, Specimen, as_case, power
from .loops import random_mechanism

LARGEST, DRIVERS = 4, 3
# The search for a fold ends after this multiple of the reach. Over one reach, the rates at design
# would turn or shift something by 0.3 to 1 [rad or m].
FARTHER = 5.0
# Distance from a sample to the fold ahead of it, and from this sample to the next, as fractions of
# the distance from the design to the fold [powers of ten].
BEFORE, STEP = (-4.0, -0.3), (-1.0, 0.7)


class Folds(Family):
    """Steps that span a fold: the motion turns back between two samples, where another assembly may
    continue.
    """

    name = "folds"
    about = (
        f"random closed mechanisms of 1 to {LARGEST} bodies, all joint types, gears and racks, 1 to"
        f" {DRIVERS} drivers that move at once, in 2 to 4 samples: most have one sample 1e-4 to 0.5"
        " of the way before a fold, and the next one far beyond it"
    )

    samples = 2

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a sweep past the first fold, if there is one; the other drivers swing."""
        mechanism, reach = random_mechanism(rng, lambda: int(rng.integers(1, LARGEST + 1)), DRIVERS)
        count = len(mechanism.bodies)
        driver, stop = mechanism.drivers[0].name, FARTHER * reach

        def swing() -> Motion:
            amplitude, turns = rng.uniform(-1.0, 1.0), rng.uniform(0.05, 0.3)
            return Sine(float(amplitude) * reach, float(turns) / reach)

        motions = {driver.name: swing() for driver in mechanism.drivers[1:]}
        fold = first_fold(as_case(mechanism, driver, np.array([stop]), motions=motions), stop)
        last = stop if fold is None else fold * (1.0 - power(rng, *BEFORE))
        step = (last if fold is None else fold) * power(rng, *STEP)
        values = np.linspace(last - (samples - 2) * step, last + step, samples)
        return Specimen(
            f"mechanism of {count} bodies, {len(mechanism.drivers)} drivers",
            partial(as_case, mechanism, driver, values, motions=motions),
            facts=(("bodies", count),),
        )
