"""A motion through values at one and the same rate, for derivatives by one driver while others are
held.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..trajectory import Array
from .motions import Motion


@dataclass(frozen=True)
class Waypoints(Motion):
    """Twice differentiable motion through values at increasing times, with the same rate and
    without acceleration at each.

    Between two times it is a quintic, outside of them a ramp.

    Attributes:
        times: of the values [s].
        values: from the design [m or rad].
        rate: at each of the times [driver units per second].
    """

    times: tuple[float, ...]
    values: tuple[float, ...]
    rate: float

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Return value, velocity and acceleration; they are exact at the times given."""
        times, values = np.array(self.times), np.array(self.values)
        k = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 1)
        lengths = np.append(np.diff(times), 1.0)
        surplus = np.append(np.diff(values) - self.rate * lengths[:-1], 0.0)[k]
        h, since = lengths[k], t - times[k]
        part = np.maximum(since / h, 0.0)
        rest = 1.0 - part
        return (
            values[k] + surplus * part**3 * (10.0 + part * (6.0 * part - 15.0)) + self.rate * since,
            self.rate + surplus * 30.0 * (part * rest) ** 2 / h,
            surplus * 60.0 * part * rest * (rest - part) / h**2,
        )
