"""Curves of a run as a table for other programs: one row per output, engine (or reference) and
sample.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ..case.io.table_file import Kind, Rows, put_csv, write_csv, write_parquet
from ..harness.record import OutputSeries, Record, Results
from .axis import DRIVER_UNITS

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

MOST = 3_000_000
"""Largest size of the curves that a page offers as files [characters]; compressed, some 40 % of the
page.
"""

REFERENCE = "reference"
"""Engine in the rows of the reference; their mode is the kind of the reference."""


def write_curves_csv(results: Results, path: Path) -> int:
    """Write the curves of a run as CSV and return the number of rows."""
    return write_csv(path, COLUMNS, curves(results))


def write_curves_parquet(results: Results, path: Path) -> int:
    """Write the curves of a run as Parquet and return the number of rows."""
    return write_parquet(path, COLUMNS, curves(results))


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
    text = io.StringIO()
    put_csv(text, COLUMNS, curves(results, case))
    return text.getvalue()


def curves(results: Results, case: str | None = None) -> Iterator[Rows]:
    """Yield the rows of `COLUMNS`, a chunk for each output of each engine.

    Args:
        case: name of the only case; None for all.
    """
    written: set[str] = set()
    for record in results.records:
        if case not in (None, record.case) or not record.driver:
            continue
        if record.case not in written:
            written.add(record.case)
            for name, series in results.references.get(record.case, {}).items():
                yield _rows(results, record, REFERENCE, record.truth, name, series)
        for name, series in record.outputs.items():
            yield _rows(results, record, record.engine, record.mode, name, series)


def _rows(
    results: Results, record: Record, engine: str, mode: str, output: str, series: OutputSeries
) -> Rows:
    driver, values = next(iter(record.driver.items()))
    facts: Mapping[str, Any] = results.run.get("cases", {}).get(record.case, {}).get("driver", {})
    head = record.case, engine, mode, output, series.unit
    unit = DRIVER_UNITS.get(facts.get("type", ""))
    unknown = [None] * len(values)
    motions = (each or unknown for each in (series.position, series.velocity, series.acceleration))
    return [
        (*head, k, driver, unit, value, *motion)
        for k, (value, *motion) in enumerate(zip(values, *motions, strict=True))
    ]
