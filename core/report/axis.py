"""The axis of the sweep: a driver or time, its values at the samples, and its direction on the
page.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..harness.record import Record
from ..unit_text import value_text, with_unit

# a figure is that many pixels wide; longer series are thinned, the worst samples always kept
SAMPLES = 500

DISPLAY = {
    "m": ("mm", 1e3),
    "rad": ("°", 180 / math.pi),
    "s": ("s", 1.0),
    "rad/m": ("°/m", 180 / math.pi),
}
"""Units of results, and what they are shown in: the unit and the factor."""

DRIVER_UNITS = {
    "point_coordinate": "m",
    "joint_displacement": "m",
    "joint_angle": "rad",
    "time": "s",
}
"""SI unit of the values of a driver, by its type."""
# Directions in files are exact, or the three digits of a table: this allows for those.
ALONG = 1 - 1e-5


@dataclass(frozen=True)
class Moved:
    """A driver, or time, at the samples in SI, with the factor to display units."""

    name: str
    unit: str
    scale: float
    values: list[float]

    @classmethod
    def of(cls, name: str, driver: Mapping[str, Any], values: list[float]) -> Moved:
        """Return a driver in the display unit of its type, with its values."""
        unit, scale = DISPLAY.get(DRIVER_UNITS.get(driver.get("type", ""), ""), ("", 1.0))
        return cls(name.replace("_", " "), unit, scale, values)

    def at(self, step: int) -> str:
        """The value at a sample, in words."""
        if step >= len(self.values):
            return ""
        value = f"{self.scale * self.values[step]:+.4g}".replace("-", "\N{MINUS SIGN}")
        return f"{self.name} {value_text(value, self.unit)}"


@dataclass(frozen=True)
class Axis(Moved):
    """The axis of the sweep: its kept samples and their values in display units.

    Attributes:
        title: as written beside the outputs' figures, with the sense of the motion.
        kept: indices of the samples drawn.
        up: 1 for an axis drawn upwards against the outputs, as wheel travel is, -1 for downwards, 0
            for an axis to the right.
        further: the other moving drivers and their motions, in words.
    """

    title: str
    kept: list[int]
    up: int
    further: list[tuple[Moved, str]]

    def at(self, step: int) -> str:
        """The values of all drivers at a sample, in words."""
        return ", ".join(
            filter(None, (super().at(step), *(moved.at(step) for moved, _ in self.further)))
        )

    @property
    def besides(self) -> str:
        """Return a sentence on the drivers in `further`; empty without any."""
        named = [f"{moved.name} ({how})" if how else moved.name for moved, how in self.further]
        return (
            f"{'Driven' if self.unit == 's' else 'Also driven'}: {', '.join(named)}."
            if named
            else ""
        )

    @property
    def label(self) -> str:
        """Name and unit."""
        return with_unit(self.name, self.unit)

    @property
    def shown(self) -> list[float]:
        """The kept values in display units."""
        return [self.scale * self.values[k] for k in self.kept]


def driver_axis(facts: Mapping[str, Any], records: Sequence[Record], worst: Iterable[int]) -> Axis:
    """Return the axis of the sweep.

    Args:
        facts: of the case: its "driver" (name, type, point and direction), its "motions" by name;
            may be empty.
        records: the records of one case.
        worst: samples kept by thinning.
    """
    series = next((record.driver for record in records if record.driver), dict[str, list[float]]())
    driver, motions = facts.get("driver", {}), facts.get("motions", {})
    key = driver.get("name") or next(iter(series), "driver")
    swept = Moved.of(key, driver, series.get(key, []))
    further = [
        (
            Moved.of(name, motions.get(name, {}), values),
            motions.get(name, {}).get("motion", {}).get("type", ""),
        )
        for name, values in series.items()
        if name != key
    ]
    name, unit, values = swept.name, swept.unit, swept.values
    # Suspension engineers read curves against wheel travel with the travel upwards, as the wheel
    # goes, so that left and right of the middle are in and out. So it is drawn wherever a point is
    # driven along the global z axis; every other driver, angles, rack travel and time, lies to the
    # right. Driven along -z, the axis runs backwards: up on paper is up on the vehicle.
    up = _upwards(driver)
    title = with_unit(name, unit)
    if up and "wheel" in driver.get("point", "") and driver.get("relative", True):
        name = "wheel travel"
        title = f"rebound \N{LEFTWARDS ARROW}  {with_unit(name, unit)}  \N{RIGHTWARDS ARROW} jounce"
    return Axis(name, unit, swept.scale, values, title, _kept(len(values), worst), up, further)


def _upwards(driver: Mapping[str, Any]) -> int:
    """Return 1 if the driver moves a point along the global z axis, -1 if against it, else 0."""
    if driver.get("type") != "point_coordinate":
        return 0
    direction = driver.get("direction", (0.0, 0.0, 0.0))
    cosine = direction[2] / (math.hypot(*direction) or 1.0)
    return int(math.copysign(1, cosine)) if abs(cosine) >= ALONG else 0


def _kept(count: int, worst: Iterable[int]) -> list[int]:
    if count <= SAMPLES:
        return list(range(count))
    even = (round(k * (count - 1) / (SAMPLES - 1)) for k in range(SAMPLES))
    return sorted({*even, *(step for step in worst if step < count)})
