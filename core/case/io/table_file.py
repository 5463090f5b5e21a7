"""Writer of tables for other programs, chunk by chunk: CSV, Parquet if pyarrow is installed, or a
workbook if openpyxl is.
"""

from __future__ import annotations

import csv
import importlib
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any, TextIO

from ...errors import KincheckError
from ...extras import library
from .escape import cell

Rows = Sequence[Sequence[Any]]

SHEET_ROWS = 1_048_576
"""Most rows of a sheet of a workbook, its head included."""


class Kind(Enum):
    """Kind of the values of a column, by pyarrow's name; None is an empty cell."""

    TEXT = "string"
    INTEGER = "int64"
    NUMBER = "float64"
    TRUTH = "bool_"


def write_csv(path: Path, columns: Mapping[str, Kind], chunks: Iterable[Rows]) -> int:
    """Write a CSV file and return the number of rows; numbers keep all digits."""
    with path.open("w", newline="", encoding="utf-8") as file:
        return put_csv(file, columns, chunks)


def csv_text(columns: Mapping[str, Kind], chunks: Iterable[Rows], end: str = "\r\n") -> str:
    """Return a table as the text of a CSV file."""
    text = io.StringIO()
    put_csv(text, columns, chunks, end)
    return text.getvalue()


def put_csv(
    file: TextIO, columns: Mapping[str, Kind], chunks: Iterable[Rows], end: str = "\r\n"
) -> int:
    """Write the lines of a CSV file and return the number of rows."""
    truths = [k for k, kind in enumerate(columns.values()) if kind is Kind.TRUTH]
    count = 0
    writer = csv.writer(file, lineterminator=end)
    writer.writerow([cell(name) for name in columns])
    for rows in chunks:
        for row in rows:
            values = [cell(each) for each in row]
            for k in truths:
                values[k] = None if row[k] is None else ("false", "true")[row[k]]
            writer.writerow(values)
        count += len(rows)
    return count


def write_parquet(path: Path, columns: Mapping[str, Kind], chunks: Iterable[Rows]) -> int:
    """Write a Parquet file and return the number of rows, a row group a chunk.

    Raises:
        ImportError: pyarrow is not installed; see `no_parquet`.
    """
    arrow: Any = importlib.import_module("pyarrow")
    parquet: Any = importlib.import_module("pyarrow.parquet")
    schema = arrow.schema([(name, getattr(arrow, kind.value)()) for name, kind in columns.items()])
    count = 0
    with parquet.ParquetWriter(path, schema) as writer:
        for rows in filter(None, chunks):
            values = dict(zip(columns, map(list, zip(*rows, strict=True)), strict=True))
            for name, kind in columns.items():
                if kind is Kind.TRUTH:  # SQLite has 0 and 1
                    values[name] = [None if each is None else bool(each) for each in values[name]]
            writer.write_table(arrow.table(values, schema=schema))
            count += len(rows)
    return count


def write_workbook(path: Path, columns: Mapping[str, Kind], chunks: Iterable[Rows]) -> int:
    """Write a workbook (.xlsx) of one sheet and return the number of rows.

    Raises:
        ImportError: openpyxl is not installed; see `lack`.
        OSError: the rows are more than a sheet has room for.
    """
    openpyxl: Any = importlib.import_module("openpyxl")
    book = openpyxl.Workbook(write_only=True)
    sheet = book.create_sheet("curves")
    sheet.append([cell(name) for name in columns])
    count = 0
    for rows in chunks:
        count += len(rows)
        if count >= SHEET_ROWS:
            raise OSError(f"a sheet has room for {SHEET_ROWS:,} rows; write CSV or Parquet")
        for row in rows:
            sheet.append([cell(each) for each in row])
    book.save(path)
    return count


WRITERS: Mapping[str, Callable[[Path, Mapping[str, Kind], Iterable[Rows]], int]] = {
    "csv": write_csv,
    "parquet": write_parquet,
    "xlsx": write_workbook,
}
"""Writers by kind of file."""

_NEEDS = {
    "parquet": ("Parquet", ("pyarrow", "pyarrow.parquet")),
    "xlsx": ("a workbook", ("openpyxl",)),
}


def lack(kind: str, named: str, remedy: str) -> str:
    """Return a message if the library that a kind of file needs is missing, else an empty text."""
    what, modules = _NEEDS.get(kind, ("", ()))
    try:
        for name in modules:
            library(what, name, kind)
    except KincheckError as error:
        return f"{named}: {error}; {remedy}"
    return ""
