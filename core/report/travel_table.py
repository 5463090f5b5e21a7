"""The numbers that suspension engineers read first: outputs of a hardpoint table at rebound, design
and jounce, and their gradients at design.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Console
from rich.text import Text

from ..case.case import PER_TRAVEL
from ..case.io.escape import visible
from ..harness.record import Outcome, Record, Results
from ..unit_text import unit_text, with_unit
from . import terminal
from .axis import DRIVER_UNITS, in_table_units

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
        if facts.get("units") and solved:
            _print(solved[0], facts, console)


def _print(record: Record, facts: Mapping[str, Any], console: Console) -> None:
    places = events(record, facts)
    heads = [">" + each.replace(", ", "\n") for each in places]
    table = terminal.columns(record.case, *heads, ">gradient at design", "")
    samples = list(places.values())
    for cells in _rows(record, facts, samples, samples[1]):
        table.add_row(*map(Text, cells))
    if table.row_count:
        console.print(table)


def events(record: Record, facts: Mapping[str, Any]) -> dict[str, int]:
    """Return the samples of rebound, design and jounce, or of the ends of another driver, by a head
    with their travel: "rebound, -80 mm".

    Args:
        facts: of the case, with the units of its table.
    """
    name, travel = next(iter(record.driver.items()))
    unit, scale = _shown(DRIVER_UNITS.get(facts["driver"].get("type", ""), ""), facts)
    low, high = (pick(range(len(travel)), key=travel.__getitem__) for pick in (min, max))
    design = min(range(len(travel)), key=lambda k: abs(travel[k]))
    ends = ("rebound", "jounce") if name.endswith("stroke") else ("least", "most")
    middle = "design" if abs(travel[design]) < ZERO else "nearest to design"
    places = {ends[0]: low, middle: design, ends[1]: high}
    return {f"{each}, {number(travel[k], scale)} {unit}": k for each, k in places.items()}


def _rows(
    record: Record, facts: Mapping[str, Any], samples: list[int], design: int
) -> Iterator[tuple[str, ...]]:
    for name, series in record.outputs.items():
        if name.removeprefix("left_").removeprefix("right_") not in NAMES or not series.position:
            continue
        unit, scale = _shown(series.unit, facts)
        cells = [number(series.position[k], scale) for k in samples]
        per = record.outputs.get(name + PER_TRAVEL)
        gradient, per_unit = "", ""
        if per is not None and per.position:
            per_unit, factor = _shown(per.unit, facts)
            gradient = number(per.position[design], factor)
        yield visible(with_unit(name, unit)), *cells, gradient, per_unit


def _shown(unit: str, facts: Mapping[str, Any]) -> tuple[str, float]:
    text, size = in_table_units(unit, facts)
    return unit_text(text).replace("deg", "\N{DEGREE SIGN}"), 1.0 / size


def number(value: float | None, scale: float = 1.0) -> str:
    """Return a number to four digits; what is zero within the tolerance of outputs as 0."""
    if value is None:
        return "–"
    shown = f"{scale * value:.4g}" if abs(scale * value) > ZERO else "0"
    return shown.replace("-", "\N{MINUS SIGN}")
