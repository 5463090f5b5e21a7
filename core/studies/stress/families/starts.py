"""Absolute drivers whose motions pass the design values at time zero: exactly, or up to rounding
or typed digits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from ....case.case import TIME
from ....mechanism.motions import Absolute, Motion, Sine
from .base import Family, Rng, Specimen, as_case
from .loops import Builder

LARGEST, DRIVERS = 5, 3
# The drivers stay within this part of the reach, so that most motions end before a fold.
EXCURSION = 0.3
# Beside a turning point of its sine, a driver's rate at the design says little of its excursion.
TURNING = 0.1


def _doubles(x: float) -> float:
    return x


def _typed(x: float) -> float:
    return float(f"{x:.6g}")


DIGITS: Mapping[str, Callable[[float], float]] = {
    "exact": _doubles,
    "rounded": _doubles,
    "typed": _typed,
}
"""Digits of the motions' numbers: "exact" motions pass the design value to the last bit."""


class Starts(Family):
    """The start of a motion must not be decided by the last bits of its numbers."""

    name = "starts"
    about = (
        f"random closed mechanisms of 1 to {LARGEST} bodies with 1 to {DRIVERS} absolute drivers on"
        " sines that pass the design values at time zero: exactly, up to rounding, or as typed with"
        " six digits; times around zero, after it or before it"
    )
    samples = 41

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return a mechanism swept over time."""
        while True:
            count = int(rng.integers(1, LARGEST + 1))
            found = Builder(rng, count, DRIVERS).built()
            if found is not None:
                break
        mechanism, reach = found
        mechanism = replace(
            mechanism,
            drivers=[replace(each, relative=False) for each in mechanism.drivers],
        )
        digits = str(rng.choice(list(DIGITS)))
        motions: dict[str, Motion] = {
            driver.name: _sine(rng, mechanism.design_value(driver.name), EXCURSION * reach, digits)
            for driver in mechanism.drivers
        }
        first, last = ((-1.0, 1.0), (0.2, 1.0), (-1.0, -0.2))[int(rng.integers(3))]
        times = np.linspace(first, last, samples)
        return Specimen(
            f"{digits} start, {count} bodies, {len(mechanism.drivers)} drivers",
            partial(as_case, mechanism, TIME, times, motions=motions),
            facts=(("bodies", count),),
        )


def _sine(rng: Rng, design: float, excursion: float, digits: str) -> Motion:
    """Return a sine that is at the design value at time zero, and moves by about the excursion in
    a second.
    """
    if not design:
        turns = 0 if digits == "exact" else int(rng.integers(-2, 3))
        phase, amplitude = np.pi * turns, excursion
    elif digits == "exact":  # the sine of this phase is one to the last bit
        phase, amplitude = np.pi / 2.0, design
    else:
        phase = float(rng.uniform(0.2, np.pi - 0.2)) * float(rng.choice((-1.0, 1.0)))
        amplitude = design / np.sin(phase)
    slope, part = abs(float(np.cos(phase))), excursion / abs(amplitude)
    turn = part / slope if slope > TURNING else np.sqrt(2.0 * part)
    frequency = min(float(turn), 1.0) * float(rng.uniform(0.3, 1.0)) / (2.0 * np.pi)
    keep = DIGITS[digits]
    return Absolute(Sine(keep(float(amplitude)), keep(frequency), keep(phase)), design)
