"""Coarse sweeps of small closed mechanisms that end at a fold, pass near one, or ask for more than there is."""

from __future__ import annotations

from functools import partial

import numpy as np

from ....motions import Motion, Table
from .base import Family, Rng, Specimen, as_case, power
from .loops import Builder

LARGEST, DRIVERS = 4, 3
# A sweep goes so many times as far as the rates at design would turn something by a third to a whole radian: [powers of ten].
FARTHER = -0.5, 0.7


class Folds(Family):
    """Steps so long that a motion may turn round between two samples, and another assembly go on."""

    name = "folds"
    about = (
        f"random closed mechanisms of 1 to {LARGEST} bodies, all joint types, gears and racks, 1 to {DRIVERS} drivers that move "
        "at once, in 2 to 4 samples: half of them come to a fold, or pass near one, within a step"
    )

    samples = 2

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """A sweep to both sides; the drivers that are not swept go through random values at both of its ends."""
        found = None
        while found is None:
            count = int(rng.integers(1, LARGEST + 1))
            found = Builder(rng, count, DRIVERS).built()
        mechanism, reach = found
        reach *= power(rng, *FARTHER)
        start, stop = -reach * float(rng.uniform(0.1, 1.0)), reach

        def passing() -> Motion:
            back, ahead = (float(each) for each in rng.uniform(-0.7, 0.7, 2) * reach)
            return Table((start, 0.0, stop), (back, 0.0, ahead))

        motions = {driver.name: passing() for driver in mechanism.drivers[1:]}
        return Specimen(
            f"mechanism of {count} bodies, {len(mechanism.drivers)} drivers",
            partial(as_case, mechanism, mechanism.drivers[0].name, np.linspace(start, stop, samples), motions=motions),
            facts=(("bodies", count),),
        )
