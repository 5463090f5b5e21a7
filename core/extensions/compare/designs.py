"""Designs of a suspension against each other: differences of their hardpoints and curves.

All numbers are in the units of the first design's table, and differences are from the first design.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from ...case.case import MARKER, PER_TRAVEL, Case
from ...case.units import LENGTHS
from ...dataset import Dataset, Variable
from ...harness.labels import notes as notes_of
from ...harness.labels import shorten_names
from ...harness.record import Facts, Results
from ...harness.table_units import in_table_units
from ...joints import Kind
from ...kinematics import kinds, places
from ...report.axis import ZERO, driver_axis, events, number
from ...report.curves import columns_of
from ...report.figures import Style, output_figure
from ...report.page_model import Plot
from ...report.sections import Diagram, Report, Section
from ...tabular import Tabular
from ...trajectory import Array
from ...unit_text import with_unit

SAME = 1e-9
"""Distance below which points are the same [m]: a table has no such digit, and conversions of units
round far below."""
FINEST = 6
"""Decimals of the smallest outputs."""
WITHOUT_LENGTH = (Kind.DIRECTION, Kind.DIRECTIONS, Kind.NUMBER)


@dataclass(frozen=True, eq=False, repr=False)
class Designs(Tabular):
    """The solved designs.

    Attributes:
        results: of the native engine, with the units of the first design.
        cases: of the designs; their names are their labels.
        facts: of the first design.
        drivers: values at the samples, by heads: stroke [mm].
        curves: outputs of each design, NaN where unknown, by its label.
        units: of the outputs, by name.
        other: outputs that are other quantities in some designs, such as the half track of the
            wheel's centre in a table without a radius: the quantities, by name.
        exceeded: a sentence on each difference larger than accepted.
    """

    results: Results
    cases: Sequence[Case]
    facts: Facts
    drivers: Mapping[str, Sequence[float | None]]
    curves: Mapping[str, Mapping[str, Array]]
    units: Mapping[str, str]
    other: Mapping[str, str]
    exceeded: Sequence[str] = ()

    def summary(self) -> str:
        """Return the designs and the number of differences beyond what is accepted in one line."""
        first, *others = self.curves
        beyond = f"; {len(self.exceeded)} beyond the tolerance" if self.exceeded else ""
        return f"{', '.join(others)} against {first}, {len(self.units)} outputs{beyond}"

    def dataset(self) -> Dataset:
        """Return the outputs by design and sample, in the units of the first design's table."""
        dims = ("design", "sample")
        coords = {"design": Variable("design", [*self.curves])}
        for head, values in self.drivers.items():
            name, _, unit = head.partition(" [")
            numbers = np.array([np.nan if x is None else x for x in values], dtype=np.float64)
            coords[name] = Variable("sample", numbers, unit.removesuffix("]"))
        missing = np.full(len(next(iter(self.drivers.values()))), np.nan)
        variables = {
            name: Variable(dims, [each.get(name, missing) for each in self.curves.values()], unit)
            for name, unit in self.units.items()
        }
        return Dataset(dims, coords, variables, [*coords][1])

    def at(self, sample: int) -> str:
        """Return the travel at a sample as text."""
        head, values = next(iter(self.drivers.items()))
        return f"{number(values[sample])} {head.partition(' [')[2].removesuffix(']')}".rstrip()

    def differences(self) -> Iterator[tuple[str, str, Array, int]]:
        """Yield the differences of each output of each design that shares it with the first one:
        output, design, values, and the sample of the largest.
        """
        (_, first), *others = self.curves.items()
        for name, values in first.items():
            for label, curves in others:
                apart = curves.get(name, np.nan) - values
                if np.isfinite(apart).any():
                    yield name, label, apart, int(np.nanargmax(np.abs(apart)))


def designs_of(results: Results, cases: Sequence[Case]) -> Designs:
    """Return the designs of a run that have any value."""
    units = {"length": cases[0].length_unit, "angle": cases[0].angle_unit}
    every = {name: each | {"units": units} for name, each in results.run["cases"].items()}
    results = msgspec.structs.replace(results, run=results.run | {"cases": every})
    facts, other = every[cases[0].name], _defined_otherwise(every)
    curves: dict[str, dict[str, Array]] = {}
    names: dict[str, str] = {}
    for record in results.records:
        for name, series in record.outputs.items():
            if name.removesuffix(PER_TRAVEL) not in other and series.position:
                names[name], size = in_table_units(series.unit, facts)
                values = np.array(series.position, dtype=np.float64) / size
                curves.setdefault(record.case, {})[name] = values
    drivers = columns_of(facts, results.records[0], {})
    return Designs(results, cases, facts, drivers, curves, names, other)


def _defined_otherwise(facts: Facts) -> dict[str, str]:
    found: dict[str, dict[str, str]] = {}
    for case, about in facts.items():
        for name, each in about["outputs"].items():
            what = filter(None, (each.get("type") or each.get("point"), each.get("at")))
            found.setdefault(name, {})[case] = " at ".join(what)
    return {
        name: "; ".join(f"{case}: {what}" for case, what in each.items())
        for name, each in found.items()
        if len({*each.values()}) > 1
    }


def side_by_side(designs: Designs) -> dict[str, Sequence[float | None]]:
    """Return a column of each output and design, and of each difference, behind the drivers."""
    (first, *_), found = designs.curves, dict(designs.drivers)
    apart = {(name, label): values for name, label, values, _ in designs.differences()}
    for name, unit in designs.units.items():
        for label, curves in designs.curves.items():
            columns = {label: curves.get(name), f"{label} - {first}": apart.get((name, label))}
            for title, values in columns.items():
                if values is not None:
                    head = with_unit(f"{name} {title}", unit)
                    found[head] = [x if np.isfinite(x) else None for x in values.tolist()]
    return found


def with_comparison(designs: Designs, beyond: Sequence[str]) -> Results:
    """Return the results with what the comparison says among their circumstances: the largest
    difference of each output, in the units of the first design, and the points that differ.
    """
    differences = [
        {
            "output": name,
            "design": label,
            "unit": designs.units[name],
            "largest": float(apart[k]),
            "sample": k,
            "at": designs.at(k),
        }
        for name, label, apart, k in designs.differences()
    ]
    points = _of_points(designs.cases)
    comparison = {
        "exceeded": [*beyond],
        "differences": differences,
        "defined_otherwise": {**designs.other},
        "points": [dict(zip(points.columns, row, strict=True)) for row in points.rows],
        "remarks": [*points.verdict],
    }
    return msgspec.structs.replace(
        designs.results, run=designs.results.run | {"comparison": comparison}
    )


def exceeded(designs: Designs, accepted: Mapping[str, float]) -> list[str]:
    """Return a sentence on each difference that is larger than accepted, by output."""
    return [
        f"{name} of {label} differs by {_signed_number(apart[k])} {designs.units[name]} at"
        f" {designs.at(k)}, more than {number(accepted[name])} {designs.units[name]}."
        for name, label, apart, k in designs.differences()
        if name in accepted and not abs(apart[k]) <= accepted[name]
    ]


def comparison(designs: Designs, beyond: Sequence[str]) -> Report:
    """Return the comparison as tables and diagrams.

    Args:
        beyond: sentences on differences beyond what the user accepts.
    """
    first, *others = (case.name for case in designs.cases)
    signs = dict.fromkeys(case.signs for case in designs.cases if case.signs)
    sections = [_of_outputs(designs, beyond), _of_points(designs.cases), _of_curves(designs)]
    name = f"{', '.join(others)} against {first}"
    return Report("compare", name, [*signs], sections, verdict=_verdict(designs, beyond))


def _verdict(designs: Designs, beyond: Sequence[str]) -> str:
    """Return the first difference beyond what the user accepts, or of the first output that
    differs.
    """
    if beyond:
        return " ".join(
            [beyond[0], f"{len(beyond) - 1} more differ too much."] if beyond[1:] else beyond
        )
    for name, label, apart, k in designs.differences():
        if abs(apart[k]) >= ZERO:
            largest = f"{_signed_number(apart[k])} {designs.units[name]}".rstrip()
            return f"{name} of {label} differs by at most {largest}, at {designs.at(k)}."
    return "no output differs."


def _of_outputs(designs: Designs, beyond: Sequence[str]) -> Section:
    curves, (first, *_) = designs.curves, designs.curves
    heads = events(designs.results.records[0], designs.facts)
    samples, design = [*heads.values()], [*heads.values()][1]
    largest: dict[str, dict[str, tuple[float, int]]] = {}
    for name, label, apart, k in designs.differences():
        largest.setdefault(name, {})[label] = float(apart[k]), k

    def numbers(label: str, name: str, places: Sequence[int]) -> list[float]:
        """Return the values at samples, each with its change from the first design."""
        own, base = (curves[each].get(name) for each in (label, first))
        found = list[float]()
        for k in places:
            value = np.nan if own is None else float(own[k])
            change = np.nan if base is None or label == first else value - float(base[k])
            found += [value, change]
        return found

    sloped = any(each.endswith(PER_TRAVEL) for own in curves.values() for each in own)
    rows: list[list[str]] = []
    cells: list[list[str]] = []
    verdict = [*beyond]
    for name, found in largest.items():
        slope = name + PER_TRAVEL
        if "." in name or all(abs(each) < ZERO for each, _ in found.values()):
            continue
        labels = (first, *found)
        values = [numbers(each, name, samples) for each in labels]
        slopes = [numbers(each, slope, [design] * sloped) for each in labels]
        for label, *texts in zip(labels, _fixed(values), _fixed(slopes), strict=True):
            most, k = found.get(label, (0.0, 0))
            at = ["", ""] if label == first else [_signed_number(most, 2), designs.at(k)]
            title = with_unit(name, designs.units[name]) if label == first else ""
            rows.append([title, label])
            cells.append([each for group in texts for each in group] + at)
    columns = [*map(_aligned, zip(*cells, strict=True))]
    rows = [row + [each[k] for each in columns] for k, row in enumerate(rows)]
    titles = [row[0].partition(" [")[0] for row in rows]
    if equal := [name for name in largest if "." not in name and name not in titles]:
        verdict.append(f"No difference: {', '.join(equal)}.")
    for label, own in curves.items():
        if lone := [name for name in own if not all(name in each for each in curves.values())]:
            verdict.append(f"Not in every design, but in {label}: {shorten_names(lone)}.")
    verdict += [
        f"Not compared, because defined otherwise: {name} ({what})."
        for name, what in designs.other.items()
        if "." not in name
    ]
    changes = [title for head in heads for title in (head, "change")]
    ends = [*["slope, per m", "change"] * sloped, "largest", "at"]
    columns = ["output", "design", *changes, *ends]
    said = f"Changes are from {first}." + " Slopes are at design, per m of travel." * sloped
    notes = [said] * bool(rows)
    notes += [f"Note: {case}: {note}." for case, note in notes_of(designs.results.run)]
    return Section("Outputs", verdict, notes, columns, 2, rows)


def _fixed(rows: Sequence[Sequence[float]]) -> list[list[str]]:
    """Return rows of pairs of a value and its change, all with the decimals that give the largest
    value four digits; round-off and what has no such digit is 0.
    """
    size = max((abs(x) for row in rows for x in row[::2] if np.isfinite(x)), default=0.0)
    decimals = max(0, 3 - int(np.floor(np.log10(size)))) if size > ZERO else 3
    decimals = min(decimals, FINEST)

    def text(value: float, sign: str) -> str:
        if not np.isfinite(value):
            return ""
        if abs(value) <= max(ZERO, 0.5 * 0.1**decimals):
            return "0"
        return f"{value:{sign}.{decimals}f}".replace("-", "\N{MINUS SIGN}")

    return [[text(x, "+" if k % 2 else "") for k, x in enumerate(row)] for row in rows]


def _aligned(cells: Sequence[str]) -> list[str]:
    """Return the cells of a column with spaces of the width of a point and of digits at their ends,
    so that they stand under each other at the decimal.
    """
    numbers = [bool(re.fullmatch(r"[+\u2212]?\d+(\.\d*)?", each)) for each in cells]
    ends = [len(each.partition(".")[2]) for each in cells]
    longest = max((n for n, number in zip(ends, numbers, strict=True) if number), default=0)
    return [
        each + "\N{PUNCTUATION SPACE}" * ("." not in each) + "\N{FIGURE SPACE}" * (longest - n)
        if number and longest
        else each
        for each, n, number in zip(cells, ends, numbers, strict=True)
    ]


def _signed_number(value: float, digits: int = 4) -> str:
    return f"{'+' if value > ZERO else ''}{number(float(f'{value:.{digits}g}'))}"


def _of_points(cases: Sequence[Case]) -> Section:
    first, *others = cases
    unit, of_places = LENGTHS[first.length_unit], kinds(first.mechanism)
    verdict: list[str] = []
    rows: list[list[str]] = []
    for other in others:
        listed = bool(first.hardpoints and other.hardpoints)
        axes = first.hardpoints[0].axes if listed else [(0, 1.0), (1, 1.0), (2, 1.0)]
        old, new = (_points(each, axes, listed=listed) for each in (first, other))
        moved = False
        for key, (name, before) in old.items():
            called, after = new.get(key, (name, before))
            if np.abs(after - before).max() < SAME:
                continue
            size = 1.0 if of_places.get(key) in WITHOUT_LENGTH else unit.size
            numbers = (_point_text(each / size) for each in (before, after, after - before))
            title = name if called == name else f"{name} ({called})"
            rows.append([title, other.name, *numbers])
            moved = True
        if not moved:
            pair = f"{first.name} and {other.name}"
            verdict.append(f"No point that both have differs between {pair}.")
        for label, mine, its in ((first.name, old, new), (other.name, new, old)):
            if lone := [name for key, (name, _) in mine.items() if key not in its]:
                verdict.append(f"Only in {label}: {shorten_names(lone)}.")
    heads = [f"{each} [{unit.name}]" for each in (first.name, "its", "moved by")]
    return Section("Hardpoints", verdict, [], ["point", "design", *heads], 2, rows)


def _points(
    case: Case, axes: Sequence[tuple[int, float]], *, listed: bool
) -> dict[str, tuple[str, Array]]:
    """Return names and positions along these axes [m] of the hardpoints, by their first role; of
    the places of the mechanism, by name, if not both designs are of tables.
    """
    if listed:
        return {
            each.roles[0]: (each.name, np.array([sign * each.position[k] for k, sign in axes]))
            for each in case.hardpoints
        }
    every = places(case.mechanism).items()
    return {name: (name, np.array(value)) for name, value in every if MARKER not in name}


def _point_text(numbers: Array) -> str:
    """Return numbers as a table has them: what differs by rounding only is no change."""
    return ", ".join(f"{0.0 + round(x, 9):.9g}" for x in numbers.tolist())


def _of_curves(designs: Designs) -> Section:
    records = [each for each in designs.results.records if each.case in designs.curves]
    axis = driver_axis(designs.facts, records[:1], [])
    styles = [Style.number(k, record.case) for k, record in enumerate(records)]
    diagrams: list[Diagram] = []
    for name in sorted(designs.units, key=lambda each: "." in each):
        pairs = zip(styles, records, strict=True)
        curves = [(style, each.outputs[name]) for style, each in pairs if name in each.outputs]
        figure = output_figure(name, axis, curves, None, None)
        for trace in figure["data"]:
            trace |= {way: axis.shown for way in ("x", "y") if trace[way] == "driver"}
        title = f"{name} against {axis.name}, all designs"
        plot = Plot(f"curve-{len(diagrams)}", title, curves[0][1].sense or "")
        diagrams.append(Diagram(plot, figure, styles))
    return Section("Curves", [], [], [], 0, [], diagrams)
