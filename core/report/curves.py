"""Curves of a run as a table for other programs. Curves of hardpoint tables are wide, a row per
sample and a column per output in the table's units, as people read them. All others are long, a row
per output, engine (or reference) and sample, because their outputs and samples differ.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from ..case.io.table_file import WRITERS, Kind, Rows, csv_text
from ..harness.record import Facts, OutputSeries, Record, Results
from ..harness.table_units import DRIVER_UNITS, in_table_units, is_table

COLUMNS: Mapping[str, Kind] = {
    "case": Kind.TEXT,
    "engine": Kind.TEXT,
    "mode": Kind.TEXT,
    "output": Kind.TEXT,
    "unit": Kind.TEXT,
    "sample": Kind.INTEGER,
    "driver": Kind.TEXT,
    "driver_unit": Kind.TEXT,
    "driver_value": Kind.NUMBER,
    "position": Kind.NUMBER,
    "velocity": Kind.NUMBER,
    "acceleration": Kind.NUMBER,
}
"""Columns, in SI units; velocities and accelerations are per second. A missing number is an empty
cell.
"""

COUNTED: Mapping[str, Kind] = {"counts_from": Kind.TEXT, "driver_counts_from": Kind.TEXT}
"""Further columns of a run with a model whose zero is not its start: what the angle or displacement
of a joint in the row, and the driver's value, count from, "model" or "design".
"""

MOST = 3_000_000
"""Largest size of the curves that a page offers as files [characters]; compressed, some 40 % of the
page.
"""

REFERENCE = "reference"
"""Engine in the rows of the reference; their mode is the kind of the reference."""


def write_curves(results: Results, path: Path, kind: str, *, long: bool) -> int:
    """Write the curves of a run as a file of a kind of `WRITERS` and return the number of rows.

    Args:
        long: whether curves of hardpoint tables are long too.
    """
    columns, rows = (None if long else wide(results)) or (long_columns(results), curves(results))
    return WRITERS[kind](path, columns, rows)


def long_columns(results: Results) -> Mapping[str, Kind]:
    """Return the columns of long curves."""
    return {**COLUMNS, **COUNTED} if _counts_otherwise(results) else COLUMNS


def _counts_otherwise(results: Results) -> bool:
    return any(
        each.get("at_design")
        for facts in results.run.get("cases", {}).values()
        for each in facts.get("outputs", {}).values()
    )


def wide(results: Results) -> tuple[Mapping[str, Kind], Iterator[Rows]] | None:
    """Return columns and rows of a run of hardpoint tables, in the units of the tables; None if a
    case is none, or another unit stands in a column.

    The columns are the drivers and the outputs, behind the names of cases and engines where there
    are several. Rates of change per metre of travel stay per metre.
    """
    facts: Facts = results.run.get("cases", {})
    if not facts or not all(map(is_table, facts.values())):
        return None
    tables = list[tuple[str, str, dict[str, list[float | None]]]]()
    known = set[str]()
    for record in results.records:
        if not record.driver:
            continue
        about = facts.get(record.case, {})
        if record.case not in known:
            known.add(record.case)
            if reference := results.references.get(record.case):
                tables.append((record.case, REFERENCE, columns_of(about, record, reference)))
        tables.append((record.case, record.engine, columns_of(about, record, record.outputs)))
    several = {"case": {case for case, *_ in tables}, "engine": {name for _, name, _ in tables}}
    labels = [name for name, among in several.items() if len(among) > 1]
    heads = dict.fromkeys(head for *_, columns in tables for head in columns)
    if len({head.split(" [")[0] for head in heads}) < len(heads):
        return None
    rows = (_wide_rows(labels, heads, *table) for table in tables)
    return dict.fromkeys(labels, Kind.TEXT) | dict.fromkeys(heads, Kind.NUMBER), rows


def columns_of(
    about: Facts, record: Record, outputs: Mapping[str, OutputSeries]
) -> dict[str, list[float | None]]:
    """Return the values of drivers and outputs in the units of the table, by their heads.

    Args:
        about: facts of the case, with these units.
    """
    drivers = {about["driver"]["name"]: about["driver"], **about["motions"]}
    found = dict[str, list[float | None]]()

    def add(name: str, unit: str, values: Sequence[float | None]) -> None:
        text, size = in_table_units(unit, about)
        head = name if text in ("", "1") else f"{name} [{text}]"
        found[head] = [None if each is None else each / size for each in values]

    for name, values in record.driver.items():
        add(name, DRIVER_UNITS.get(drivers.get(name, {}).get("type", ""), ""), values)
    for name, series in outputs.items():
        add(name, series.unit, series.position or [None] * len(next(iter(record.driver.values()))))
    return found


def _wide_rows(
    labels: Sequence[str],
    heads: Iterable[str],
    case: str,
    engine: str,
    columns: Mapping[str, Sequence[float | None]],
) -> Rows:
    count = len(next(iter(columns.values())))
    names = [{"case": case, "engine": engine}[label] for label in labels]
    empty = [None] * count
    values = zip(*(columns.get(head, empty) for head in heads), strict=True)
    return [(*names, *row) for row in values]


def downloads(results: Results, cases: Mapping[str, str]) -> dict[str, str]:
    """Return the curves of as many cases as a page has room for, as CSV.

    Args:
        cases: names by any key.
    """
    found: dict[str, str] = {}
    room = MOST
    for key, case in cases.items():
        text = csv_of(results, case) if room > 0 else ""
        room -= len(text)
        if text and room > 0:
            found[key] = text
    return found


def csv_of(results: Results, case: str) -> str:
    """Return the curves of a case as the text of a CSV file."""
    return csv_text(long_columns(results), curves(results, case))


def curves(results: Results, case: str | None = None) -> Iterator[Rows]:
    """Yield the rows of `COLUMNS`, a chunk for each output of each engine.

    Args:
        case: name of the only case; None for all.
    """
    written, otherwise = set[str](), _counts_otherwise(results)
    for record in results.records:
        if case not in (None, record.case) or not record.driver:
            continue
        about: Facts = results.run.get("cases", {}).get(record.case, {})
        if record.case not in written:
            written.add(record.case)
            for name, series in results.references.get(record.case, {}).items():
                yield _rows(about, record, (REFERENCE, record.truth), name, series, otherwise)
        for name, series in record.outputs.items():
            yield _rows(about, record, (record.engine, record.mode), name, series, otherwise)


def _rows(
    about: Facts,
    record: Record,
    who: tuple[str, str],
    output: str,
    series: OutputSeries,
    otherwise: bool,
) -> Rows:
    driver, values = next(iter(record.driver.items()))
    facts: Facts = about.get("driver", {})
    head = record.case, *who, output, series.unit
    unit = DRIVER_UNITS.get(facts.get("type", ""))
    unknown = [None] * len(values)
    motions = (each or unknown for each in (series.position, series.velocity, series.acceleration))
    counted: list[str] = []
    if otherwise:
        zeros = about.get("outputs", {}).get(output, {}).get("at_design"), facts.get("design")
        counted = ["" if zero is None else "model" if zero else "design" for zero in zeros]
    return [
        (*head, k, driver, unit, value, *motion, *counted)
        for k, (value, *motion) in enumerate(zip(values, *motions, strict=True))
    ]
