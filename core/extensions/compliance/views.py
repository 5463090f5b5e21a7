"""The results of a compliance study as JSON, as a table, and as lines of the terminal."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from ...errors import number_of
from ...harness.record import Record, Results
from ...report.axis import ENDLESS, ZERO
from ...trajectory import Array
from ...unit_text import unit_text, with_unit
from .results import WHEEL_LOAD, ComplianceCurves, ComplianceResults
from .section import Load

MOST_SAID = 5
"""Failures that messages name."""
SCHEMA = "kincheck-compliance/1"
DEGREE = 180.0 / math.pi
SHOWN: Mapping[str, tuple[str, float]] = {
    "m": ("mm", 1e3),
    "rad": ("deg", DEGREE),
    "rad/m": ("deg/m", DEGREE),
    "m/m": ("mm/m", 1e3),
    "m/N": ("mm/kN", 1e6),
    "rad/N": ("deg/kN", 1e3 * DEGREE),
    "1/N": ("1/kN", 1e3),
    "m/(N m)": ("mm/(100 N m)", 1e5),
    "rad/(N m)": ("deg/(100 N m)", 1e2 * DEGREE),
    "1/(N m)": ("1/(100 N m)", 1e2),
    "N/m": ("N/mm", 1e-3),
    "N m/rad": ("N m/deg", 1.0 / DEGREE),
}
"""Unit and factor of tables and pages, by SI unit; files in JSON are in SI."""


def shown_unit(unit: str) -> tuple[str, float]:
    """Return unit and factor of tables and pages."""
    return SHOWN.get(unit, (unit, 1.0))


def digits(value: float, count: int = 6) -> str:
    """Return a number of the terminal or the summary; round-off is zero."""
    whole = 10.0**count <= abs(value) < ENDLESS
    return "0" if abs(value) < ZERO else f"{value:{'.0f' if whole else f'.{count}g'}}"


def as_data(results: ComplianceResults) -> dict[str, Any]:
    """Return the results as plain data in SI; null without an equilibrium."""
    return {
        "schema": SCHEMA,
        "case": results.case,
        "signs": results.signs,
        "summary": [asdict(each) for each in results.travel.summary()],
        **_data(results.travel),
        "loads": {str(name): _data(each) for name, each in results.loads.items()},
        "failures": results.failures,
        **({"agreement": agreement(results.checked)} if results.checked else {}),
    }


def agreement(checked: Results) -> list[dict[str, Any]]:
    """Return a row for each engine and case: its verdict, and the largest deviations from native of
    the wheels' centres [m] and of their loads [N]; None without any.
    """
    return [
        {
            "case": each.case,
            "engine": each.engine,
            "mode": each.mode,
            "outcome": each.outcome.shown,
            "message": each.message,
            "wheel_center": _largest(each, lambda name: "wheel_center_" in name),
            "wheel_load": _largest(each, lambda name: name.endswith("wheel_load")),
        }
        for each in checked.records
    ]


def _largest(record: Record, wanted: Callable[[str], bool]) -> float | None:
    every = [each.position for name, each in record.errors.items() if wanted(name)]
    return max((each.max_abs for each in every if each is not None), default=None)


def _data(curves: ComplianceCurves) -> dict[str, Any]:
    return {
        curves.axis: _rows_or_none(curves.at),
        "wheel_center": _rows_or_none(curves.wheel_center),
        "spin_axis": _rows_or_none(curves.spin_axis),
        "wheel_load": _rows_or_none(curves.wheel_load),
        "compliance": _rows_or_none(curves.compliance),
        "outputs": {
            name: {"unit": each.unit, "sense": each.sense, "position": _rows_or_none(each.values)}
            for name, each in curves.outputs.items()
        },
        "rigid": {name: _rows_or_none(values) for name, values in curves.rigid.items()},
        "not_computed": {**curves.not_computed},
        "notes": [*curves.notes],
    }


def _rows_or_none(values: Array) -> Any:
    found: Any = values.astype(object)
    found[~np.isfinite(values)] = None
    return found.tolist()


def unit_of_axis(curves: ComplianceCurves) -> tuple[str, float]:
    """Return unit and factor of the axis."""
    if curves.axis == "travel":
        return SHOWN["rad" if curves.turning else "m"]
    return ("N m" if curves.axis == Load.ALIGNING else "N"), 1.0


def table(results: ComplianceResults) -> str:
    """Return the curves as CSV: a row for each sample over travel, then over each load."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    first = results.travel
    center = [f"wheel_center_{axis} [mm]" for axis in "xyz"]
    names = {
        name: shown_unit(each.unit) for name, each in first.outputs.items() if name != WHEEL_LOAD
    }
    heads = [with_unit(name, unit) for name, (unit, _) in names.items()]
    heads += [with_unit(f"{name}.rigid", names[name][0]) for name in first.rigid]
    lost = (line for each in (first, *results.loads.values()) for line in each.lost)
    if said := "; ".join(filter(None, (results.signs, *dict.fromkeys(lost)))):
        text.write(f"# {said}\n")
    writer.writerow(["over", "value", "unit", *center, f"{WHEEL_LOAD} [N]", *heads])
    for curves in (first, *results.loads.values()):
        unit, factor = unit_of_axis(curves)
        columns: list[Sequence[float] | Array] = [
            *(1e3 * curves.wheel_center.T),
            curves.wheel_load,
            *(size * curves.outputs[name].values for name, (_, size) in names.items()),
            *(
                names[name][1] * curves.rigid[name] if curves.rigid else math.nan * curves.at
                for name in first.rigid
            ),
        ]
        for at, *row in zip(curves.at, *columns, strict=True):
            writer.writerow([curves.axis, repr(float(factor * at)), unit, *map(_cell, row)])
    return text.getvalue()


def _cell(value: float) -> str:
    return repr(float(value)) if math.isfinite(value) else ""


def failures(results: ComplianceResults) -> list[str]:
    """Return the first samples without equilibrium, the number of further ones, and a remedy."""
    every = results.failures
    if not every:
        return []
    more = len(every) - MOST_SAID
    rest = f"{number_of(more, 'further sample')} without equilibrium. " if more > 0 else ""
    return [*every[:MOST_SAID], f"{rest}Give less travel or load, or stiffer springs and bushings"]


def lines(results: ComplianceResults) -> Iterator[str]:
    """Yield the numbers that engineers quote, and all slopes and rates at the sample nearest to
    design with the ends of each curve.
    """
    yield f"{results.case}: {results.signs}"
    travel = results.travel
    known = [each for each in travel.summary() if each.name not in travel.not_computed]
    wide = max((len(each.label) for each in known), default=0)
    for each in known:
        shown, size = shown_unit(each.unit)
        number = "" if each.value is None else digits(size * each.value, 4)
        yield f"  {each.label:{wide}}  {number:>8} {unit_text(shown):16}  {each.says}".rstrip()
    every = (results.travel, *results.loads.values())
    for curves in every:
        yield from _lines(curves)
    yield from dict.fromkeys(line for curves in every for line in curves.lost)


def _lines(curves: ComplianceCurves) -> Iterator[str]:
    """Yield the lines of curves over travel or over a load."""
    unit, factor = unit_of_axis(curves)
    k = curves.near_design
    if not curves.reached.any():
        yield f"no equilibrium at any of {len(curves.at)} samples of {curves.axis}"
        return
    load = float(curves.wheel_load[k])
    said = f", wheel load {digits(load)} N" if math.isfinite(load) else ""
    yield f"at {curves.axis} {digits(factor * float(curves.at[k]))} {unit}{said}"
    for name, each in curves.outputs.items():
        shown, size = shown_unit(each.unit)
        if not np.isfinite(each.values).any():
            yield f"  {with_unit(name, shown)}  –"
            continue
        ends = np.nanmin(each.values), np.nanmax(each.values), each.values[k]
        low, high, value = (digits(size * float(x)) for x in ends)
        yield f"  {with_unit(name, shown)}  {value}  (from {low} to {high})"
