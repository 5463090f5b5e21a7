"""Driver values and times of a motion, with their units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .dataset import Variable


@dataclass(frozen=True, eq=False)
class Driving:
    """The drivers of a motion, over n samples.

    Attributes:
        times: zero at the design value of the swept driver [s], shape (n,).
        values: of the moving drivers by name, the swept one first [units], shape (n,) each.
        units: of the drivers, m or rad.
    """

    times: NDArray[np.float64]
    values: Mapping[str, NDArray[np.float64]]
    units: Mapping[str, str]

    def coords(self) -> dict[str, Variable]:
        """Return the drivers and the time as coordinates of the samples."""
        drivers = {
            name: Variable("sample", values, self.units[name])
            for name, values in self.values.items()
        }
        return {**drivers, "time": Variable("sample", self.times, "s")}


def in_words(drive: Driving | None) -> str:
    """Return the range of the swept driver, for a summary; empty if it is unknown."""
    if drive is None or not drive.times.size:
        return ""
    name, values = next(iter(drive.values.items()))
    return f"{name} {values[0]:.6g} to {values[-1]:.6g} {drive.units[name]}"
