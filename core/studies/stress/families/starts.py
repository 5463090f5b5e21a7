"""Absolute drivers whose motions pass the design values at time zero: exactly, up to rounding, or
up to typed digits.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from ....algebra import triple
from ....case.case import TIME
from ....joints import RackPinion, Revolute, Translational
from ....mechanism.mechanism import GROUND, Body, Mechanism, Point
from ....mechanism.motions import Absolute, Motion, PointCoordinate, Sine
from .base import Family, Rng, Specimen, as_case
from .loops import random_mechanism
from .planar import any_plane, flat_plane

LARGEST, DRIVERS = 5, 3
# Excursion of the drivers in a second, as a fraction of the reach: few motions meet a fold.
EXCURSION = 0.3
# Below this slope of the sine at the design [-], the excursion grows with the square of time.
TURNING = 0.1

DIGITS = ("exact", "rounded", "typed")
"""Precision of the design value: to the last bit, up to rounding, or with six digits."""


class Starts(Family):
    """Starts of motions, where the last bits of numbers must not decide the result."""

    name = "starts"
    about = (
        "two-link arms whose tip goes round the base, with a rack that counts the turns, and random"
        f" closed mechanisms of 1 to {LARGEST} bodies; 1 to {DRIVERS} absolute drivers on sines"
        " that pass the design values at time zero: exactly, up to rounding, or as typed with six"
        " digits; times around zero, after it or before it"
    )
    samples = 41

    def specimen(self, rng: Rng, samples: int) -> Specimen:
        """Return an arm or a closed mechanism, swept over time."""
        digits = str(rng.choice(DIGITS))
        make = _arm if rng.random() < 0.5 else _closed
        mechanism, motions = make(rng, digits)
        first, last = ((-1.0, 1.0), (0.2, 1.0), (-1.0, -0.2))[int(rng.integers(3))]
        times = np.linspace(first, last, samples)
        return Specimen(
            f"{digits} start, {mechanism.name}, {len(mechanism.drivers)} drivers",
            partial(as_case, mechanism, TIME, times, motions=motions),
            facts=(("bodies", len(mechanism.bodies)),),
        )


def _closed(rng: Rng, digits: str) -> tuple[Mechanism, dict[str, Motion]]:
    """Return a random closed mechanism; its drivers swing by a part of its reach."""
    mechanism, reach = random_mechanism(rng, lambda: int(rng.integers(1, LARGEST + 1)), DRIVERS)
    mechanism = replace(
        mechanism, drivers=[replace(each, relative=False) for each in mechanism.drivers]
    )
    return mechanism, {
        driver.name: _sine(rng, mechanism.design_value(driver.name), EXCURSION * reach, digits)
        for driver in mechanism.drivers
    }


def _arm(rng: Rng, digits: str) -> tuple[Mechanism, dict[str, Motion]]:
    """Return two links and their motion; the tip circles the base once a second.

    A straight path of the drivers from the design to a later sample passes near the base, and may
    end in the other assembly, in another turn, or at no pose.
    """
    origin, exact = np.zeros(3), digits == "exact"
    plane = flat_plane(rng, origin) if exact else any_plane(rng, origin)
    first, second = rng.uniform(0.3, 1.0, 2)
    least, most = abs(first - second), first + second
    radius = float(least + rng.uniform(0.2, 0.8) * (most - least))
    angle = 0.0 if exact else float(rng.uniform(-np.pi, np.pi))
    bend = np.arccos((first**2 + radius**2 - second**2) / (2.0 * first * radius))
    elbow = angle + bend * float(rng.choice((-1.0, 1.0)))
    at = plane.point((first * np.cos(elbow), first * np.sin(elbow)))
    tip = plane.point((radius * np.cos(angle), radius * np.sin(angle)))
    side = triple(plane.normal)
    mechanism = Mechanism(
        "two-link arm",
        [Body("upper"), Body("lower"), Body("rack")],
        [
            Revolute("base", GROUND, "upper", point=plane.point((0.0, 0.0)), axis=side),
            Revolute("elbow", "upper", "lower", point=at, axis=side),
            Translational("guide", GROUND, "rack", point=side, axis=plane.along((1.0, 0.0))),
        ],
        [Point("tip", "lower", tip), Point("on_rack", "rack", side)],
        [
            PointCoordinate("x", "tip", plane.along((1.0, 0.0)), relative=False),
            PointCoordinate("y", "tip", plane.along((0.0, 1.0)), relative=False),
        ],
        [RackPinion("turns", ("base", "guide"), 0.1)],
    )
    phases = {"x": angle + np.pi / 2.0, "y": angle}
    return mechanism, {
        name: _motion(mechanism.design_value(name), radius, 1.0, phase, digits)
        for name, phase in phases.items()
    }


def _sine(rng: Rng, design: float, excursion: float, digits: str) -> Motion:
    """Return a sine with the design value at time zero.

    It moves by about the excursion in the first second.
    """
    if not design:
        turns = 0 if digits == "exact" else int(rng.integers(-2, 3))
        phase, amplitude = np.pi * turns, excursion
    elif digits == "exact":  # the sine of this phase is exactly one
        phase, amplitude = np.pi / 2.0, design
    else:
        phase = float(rng.uniform(0.2, np.pi - 0.2)) * float(rng.choice((-1.0, 1.0)))
        amplitude = design / np.sin(phase)
    slope, part = abs(float(np.cos(phase))), excursion / abs(amplitude)
    turn = part / slope if slope > TURNING else np.sqrt(2.0 * part)
    frequency = min(float(turn), 1.0) * float(rng.uniform(0.3, 1.0)) / (2.0 * np.pi)
    return _motion(design, float(amplitude), frequency, phase, digits)


def _motion(design: float, amplitude: float, frequency: float, phase: float, digits: str) -> Motion:
    """Return a sine of absolute values, as a case file reads it."""
    numbers = amplitude, frequency, phase
    sine = Sine(*(float(f"{x:.6g}") for x in numbers) if digits == "typed" else numbers)
    return Absolute(sine, design) if design else sine
