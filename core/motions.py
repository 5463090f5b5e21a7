"""Motions: how a driver's value goes with time. Each gives the value and its first two derivatives.

Values are measured from the design position [m or rad]; times are in seconds.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from .errors import MechanismError
from .trajectory import Array


@dataclass(frozen=True)
class Motion(ABC):
    """Base of the motions. Declaring one registers its type, which case files name."""

    type: ClassVar[str]
    registry: ClassVar[dict[str, type[Motion]]] = {}

    def __init_subclass__(cls) -> None:
        Motion.registry[cls.type] = cls

    @abstractmethod
    def at(self, t: Array) -> tuple[Array, Array, Array]:
        """Value, velocity and acceleration at times t [s], each of t's shape."""


@dataclass(frozen=True)
class Ramp(Motion):
    """value = rate * t."""

    type = "ramp"
    rate: float

    def __post_init__(self) -> None:
        _finite("ramp", rate=self.rate)

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        return self.rate * t, np.full_like(t, self.rate), np.zeros_like(t)


@dataclass(frozen=True)
class Sine(Motion):
    """value = amplitude * sin(2 pi frequency t + phase); frequency in Hz, phase in radians."""

    type = "sine"
    amplitude: float
    frequency: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        _finite("sine", amplitude=self.amplitude, frequency=self.frequency, phase=self.phase)

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        omega = 2.0 * math.pi * self.frequency
        s, c = np.sin(omega * t + self.phase), np.cos(omega * t + self.phase)
        return self.amplitude * s, self.amplitude * omega * c, -self.amplitude * omega**2 * s


@dataclass(frozen=True)
class Table(Motion):
    """The natural cubic spline through values at increasing times: twice differentiable, so that accelerations exist.

    Outside the table the end pieces go on.
    """

    type = "table"
    times: tuple[float, ...]
    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.times) != len(self.values) or len(self.times) < 2:
            raise MechanismError(
                f"table motion: {len(self.times)} times and {len(self.values)} values, expected as many of each, two or more"
            )
        if not all(map(math.isfinite, (*self.times, *self.values))):
            raise MechanismError("table motion: a time or value is not finite; give numbers")
        if any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            raise MechanismError("table motion: times do not increase; sort them and remove repeats")

    def at(self, t: Array) -> tuple[Array, Array, Array]:
        # slow to import, and rarely wanted
        from scipy.interpolate import CubicSpline  # pyright: ignore[reportMissingTypeStubs]

        spline = CubicSpline(self.times, self.values, bc_type="natural")
        return spline(t), spline(t, 1), spline(t, 2)


def _finite(who: str, **numbers: float) -> None:
    for name, value in numbers.items():
        if not math.isfinite(value):
            raise MechanismError(f"{who} motion: {name} is {value}; give a finite number")
