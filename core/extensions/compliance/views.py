"""The results of a compliance study as JSON, as a table, and as a page."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import number_of
from ...harness.record import Record, Results
from ...report.axis import ZERO
from ...report.figures import Figure, Style
from ...report.page_model import ROUND_OFF, Plot
from ...report.report import headline
from ...report.sections import Diagram, Report, Section
from ...report.sections import page as render
from ...trajectory import Array
from ...unit_text import with_unit
from .rates import Curve
from .section import Load
from .study import MOST_SAID, WHEEL_LOAD, ComplianceCurves, ComplianceResults

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


def _shown(unit: str) -> tuple[str, float]:
    """Return unit and factor of tables and pages."""
    return SHOWN.get(unit, (unit, 1.0))


def as_data(results: ComplianceResults) -> dict[str, Any]:
    """Return the results as plain data in SI; null without an equilibrium."""
    return {
        "schema": SCHEMA,
        "case": results.case,
        "signs": results.signs,
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
    names = {name: _shown(each.unit) for name, each in first.outputs.items() if name != WHEEL_LOAD}
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
    rest = f"{number_of(more, 'further sample')} without equilibrium; " if more > 0 else ""
    return [*every[:MOST_SAID], f"{rest}give less travel or load, or stiffer springs and bushings"]


def lines(results: ComplianceResults) -> Iterator[str]:
    """Yield the slopes and rates at the sample nearest to design, and the ends of each curve."""
    yield f"{results.case}: {results.signs}"
    every = (results.travel, *results.loads.values())
    for curves in every:
        yield from _lines(curves)
    yield from dict.fromkeys(line for curves in every for line in curves.lost)


def _lines(curves: ComplianceCurves) -> Iterator[str]:
    """Yield the lines of curves over travel or over a load."""
    unit, factor = unit_of_axis(curves)
    k = _near_design(curves)
    if not math.isfinite(curves.wheel_load[k]):
        yield f"no equilibrium at any of {len(curves.at)} samples of {curves.axis}"
        return
    load = float(curves.wheel_load[k])
    load = 0.0 if abs(load) < ZERO else load
    yield f"at {curves.axis} {factor * curves.at[k]:.6g} {unit}, wheel load {load:.6g} N"
    for name, each in curves.outputs.items():
        shown, size = _shown(each.unit)
        if not np.isfinite(each.values).any():
            yield f"  {with_unit(name, shown)}  –"
            continue
        shown_values = size * each.values
        shown_values[abs(shown_values) < ZERO] = 0.0
        low, high, value = np.nanmin(shown_values), np.nanmax(shown_values), shown_values[k]
        yield f"  {with_unit(name, shown)}  {value:.6g}  (from {low:.6g} to {high:.6g})"


def page(results: ComplianceResults) -> str:
    """Return the page."""
    return render(report(results))


def report(results: ComplianceResults) -> Report:
    """Return the curves over travel with the rigid ones beside, then over each load."""
    every = (results.travel, *results.loads.values())
    sections = [_section(number, curves) for number, curves in enumerate(every)]
    if results.checked is not None:
        sections.append(_agreement(results.checked))
    k = _near_design(results.travel)
    matrix = list[list[str]]()
    if math.isfinite(results.travel.wheel_load[k]):
        compliance = results.travel.compliance[k]
        zero = ROUND_OFF * np.abs(compliance).max()
        known = np.where(np.abs(compliance) > zero, compliance, 0.0)
        matrix = [[f"{x:.4g}" for x in row] for row in known.tolist()]
    note = (
        "Rows: displacement [m] and turn [rad] at the contact; columns: force [N] and torque [N m]"
        " there; global axes, six for each wheel."
    )
    sections.append(Section("Compliance at design", [], [note], [], 0, matrix))
    facts = (
        results.signs,
        "equilibria with springs, bushings and weight",
        "the height of the wheel's centre is held",
        "point at a figure to read its values",
    )
    lost = sum(int((~np.isfinite(each.wheel_load)).sum()) for each in every)
    count = sum(len(each.at) for each in every)
    said = (
        f"{lost} of {count} samples have no equilibrium"
        if lost
        else (f"all {count} samples have an equilibrium")
    )
    if results.checked is not None:
        agreed = headline(results.checked)
        said += f"; {agreed[0].lower()}{agreed[1:]}"
    name = f"Kinematics and compliance of {results.case}"
    return Report("kc", name, facts, sections, verdict=f"{said}.")


def _section(number: int, curves: ComplianceCurves) -> Section:
    """Return the diagrams over travel or over a load."""
    soft, rigid = Style.number(0, "with bushings"), Style.number(1, "rigid joints")
    styles = [soft, rigid] if curves.rigid else [soft]
    unit, factor = unit_of_axis(curves)
    x, diagrams = _drawn(factor * curves.at), list[Diagram]()
    for name, each in {WHEEL_LOAD: Curve(curves.wheel_load, "N"), **curves.outputs}.items():
        shown, size = _shown(each.unit)
        data = [soft.curve(x, _drawn(size * each.values))]
        if name in curves.rigid:
            data.append(rigid.curve(x, _drawn(size * curves.rigid[name])))
        figure: Figure = {
            "data": data,
            "layout": {
                "xaxis": {"title": {"text": with_unit(curves.axis, unit)}, "zeroline": True},
                "yaxis": {"title": {"text": with_unit(name, shown)}},
                "hovermode": "x unified",
            },
        }
        plot = Plot(f"curve-{number}-{len(diagrams)}", f"{name} over {curves.axis}", "")
        diagrams.append(Diagram(plot, figure, styles))
    title = f"Over {curves.axis}"
    return Section(title, curves.failures, [*curves.notes, *curves.lost], [], 0, [], diagrams)


def _agreement(checked: Results) -> Section:
    rows = [
        [x if isinstance(x, str) else "–" if x is None else f"{x:.1e}" for x in row.values()]
        for row in agreement(checked)
    ]
    columns = ["case", "engine", "mode", "outcome", "message", "wheel centre [m]", "wheel load [N]"]
    note = "The same equilibria by each engine; largest deviations from the native engine."
    return Section("Agreement of engines", [], [note], columns, 5, rows)


def _drawn(values: Array) -> list[float | None]:
    return [float(f"{x:.10g}") if math.isfinite(x) else None for x in values.tolist()]


def _near_design(curves: ComplianceCurves) -> int:
    """Return the sample nearest to design, of those with an equilibrium if there are any."""
    reached = np.isfinite(curves.wheel_load)
    return int(np.argmin(np.where(reached, np.abs(curves.at), np.inf)))
