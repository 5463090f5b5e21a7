"""The axis of the sweep: a driver or time, with its values at the samples and its direction on the
page.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from rich.console import Console
from rich.text import Text

from ..case.case import PER_TRAVEL
from ..case.io.escape import visible
from ..errors import shortened
from ..harness.labels import DRIVER_UNITS, displayed, driver_unit, is_table
from ..harness.record import Facts, Outcome, Record, Results
from ..unit_text import value_text, with_unit
from . import terminal

# a figure's width in pixels; longer series are thinned, but keep their worst samples
SAMPLES = 500
# beside each figure
MOST_DRIVERS = 8

DISPLAY = {
    "m": ("mm", 1e3),
    "rad": ("°", 180 / math.pi),
    "s": ("s", 1.0),
    "rad/m": ("°/m", 180 / math.pi),
    "m/m": ("mm/m", 1e3),
}
"""Display unit and factor by the unit of results."""

# Directions in files are exact, or have the three digits of a table, which this tolerance allows.
ALONG = 1 - 1e-5


@dataclass(frozen=True)
class Moved:
    """A driver, or time, at the samples [SI], with the factor to display units."""

    name: str
    unit: str
    scale: float
    values: list[float]

    @classmethod
    def of(cls, name: str, driver: Facts, values: list[float]) -> Moved:
        """Return a driver in the display unit of its type, with its values."""
        unit, scale = DISPLAY.get(DRIVER_UNITS.get(driver.get("type", ""), ""), ("", 1.0))
        return cls(name.replace("_", " "), unit, scale, values)

    def at(self, step: int) -> str:
        """Return the value at a sample as text."""
        if step >= len(self.values):
            return ""
        value = f"{self.scale * self.values[step]:+.4g}".replace("-", "\N{MINUS SIGN}")
        return f"{self.name} {value_text(value, self.unit)}"


@dataclass(frozen=True)
class Axis(Moved):
    """The axis of the sweep: its kept samples and their values in display units.

    Attributes:
        title: title beside the figures of outputs, with the sense of the motion.
        kept: indices of the drawn samples.
        up: 1 for an axis drawn upwards, such as wheel travel, -1 for downwards, 0 for an axis to
            the right.
        further: the other moving drivers, with phrases on their motions.
    """

    title: str
    kept: list[int]
    up: int
    further: list[tuple[Moved, str]]

    def at(self, step: int) -> str:
        """Return the values of all drivers at a sample as text."""
        texts = [super().at(step), *(moved.at(step) for moved, _ in self.further)]
        return shortened([*filter(None, texts)], MOST_DRIVERS)

    @cached_property
    def besides(self) -> str:
        """Return a sentence on the drivers in `further`; empty without them."""
        named = [f"{moved.name} ({how})" if how else moved.name for moved, how in self.further]
        word = "Driven" if self.unit == "s" else "Also driven"
        return f"{word}: {shortened(named, MOST_DRIVERS)}." if named else ""

    @property
    def label(self) -> str:
        """Name and unit."""
        return with_unit(self.name, self.unit)

    @property
    def shown(self) -> list[float]:
        """The kept values in display units."""
        return [self.scale * self.values[k] for k in self.kept]


def driver_axis(facts: Facts, records: Sequence[Record], worst: Iterable[int]) -> Axis:
    """Return the axis of the sweep.

    Args:
        facts: facts of the case: its "driver" (name, type, point and direction), its "motions" by
            name; may be empty.
        records: the records of one case.
        worst: samples that thinning keeps.
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
    # Suspension engineers draw wheel travel upwards, so that left and right of the middle are
    # inwards and outwards. The axis of a point driven along the global z axis is therefore
    # vertical; the axis of any other driver (angle, rack travel, time) points to the right. For a
    # point driven along -z the axis is reversed: up on the page is up on the vehicle.
    up = _upwards(driver)
    title = with_unit(name, unit)
    if up and "wheel" in driver.get("point", "") and driver.get("relative", True):
        name = "wheel travel"
        title = f"rebound \N{LEFTWARDS ARROW}  {with_unit(name, unit)}  \N{RIGHTWARDS ARROW} jounce"
    return Axis(
        name, unit, swept.scale, values, title, _drawn_samples(len(values), worst), up, further
    )


def _upwards(driver: Facts) -> int:
    """Return 1 if the driver moves a point along the global z axis, -1 if against it, else 0."""
    if driver.get("type") != "point_coordinate":
        return 0
    direction = driver.get("direction", (0.0, 0.0, 0.0))
    cosine = direction[2] / (math.hypot(*direction) or 1.0)
    return int(math.copysign(1, cosine)) if abs(cosine) >= ALONG else 0


def _drawn_samples(count: int, worst: Iterable[int]) -> list[int]:
    if count <= SAMPLES:
        return list(range(count))
    even = (round(k * (count - 1) / (SAMPLES - 1)) for k in range(SAMPLES))
    return sorted({*even, *(step for step in worst if step < count)})


NAMES = (
    "toe",
    "camber",
    "caster",
    "roll_center_height",
    "half_track_change",
    "track",
    "roll_angle",
    "axle_roll_center_height",
    "ackermann",
    "ackermann_angles",
    "turning_circle",
    "steering_ratio",
)
"""Outputs of the table, of a wheel or an axle."""

ZERO = 1e-9
"""Largest number that is printed as zero: the tolerance of outputs in the table's units."""

SOLVED = (Outcome.PASS, Outcome.FAIL, Outcome.UNJUDGED)


def print_travel(results: Results, console: Console) -> None:
    """Print the table of each case of hardpoints, as the first engine that solved it has it."""
    for case, facts in results.run.get("cases", {}).items():
        solved = [
            record
            for record in results.records
            if record.case == case and record.outcome in SOLVED and record.driver
        ]
        if is_table(facts) and solved:
            _print(solved[0], facts, console)


def _print(record: Record, facts: Facts, console: Console) -> None:
    places = events(record, facts)
    heads = [">" + each.replace(", ", "\n") for each in places]
    table = terminal.columns(record.case, *heads, ">gradient at design", "")
    samples = list(places.values())
    for cells in _rows(record, facts, samples, samples[1]):
        table.add_row(*map(Text, cells))
    if table.row_count:
        console.print(table)


def events(record: Record, facts: Facts) -> dict[str, int]:
    """Return the samples of rebound, design and jounce, or of the ends of another driver, by a head
    with their travel: "rebound, -80 mm".

    Args:
        facts: of the case, with the units of its table.
    """
    name, travel = next(iter(record.driver.items()))
    unit, scale = displayed(driver_unit(facts), facts)
    low, high = (pick(range(len(travel)), key=travel.__getitem__) for pick in (min, max))
    design = min(range(len(travel)), key=lambda k: abs(travel[k]))
    ends = ("rebound", "jounce") if name.endswith("stroke") else ("least", "most")
    middle = "design" if abs(travel[design]) < ZERO else "nearest to design"
    places = {ends[0]: low, middle: design, ends[1]: high}
    return {f"{each}, {number(travel[k], scale)} {unit}": k for each, k in places.items()}


def _rows(
    record: Record, facts: Facts, samples: list[int], design: int
) -> Iterator[tuple[str, ...]]:
    for name, series in record.outputs.items():
        if name.removeprefix("left_").removeprefix("right_") not in NAMES or not series.position:
            continue
        unit, scale = displayed(series.unit, facts)
        cells = [number(series.position[k], scale) for k in samples]
        per = record.outputs.get(name + PER_TRAVEL)
        gradient, per_unit = "", ""
        if per is not None and per.position:
            per_unit, factor = displayed(per.unit, facts)
            gradient = number(per.position[design], factor)
        yield visible(with_unit(name, unit)), *cells, gradient, per_unit


def number(value: float | None, scale: float = 1.0) -> str:
    """Return a number to four digits; what is zero within the tolerance of outputs as 0."""
    if value is None:
        return "–"
    shown = f"{scale * value:.4g}" if abs(scale * value) > ZERO else "0"
    return shown.replace("-", "\N{MINUS SIGN}")
