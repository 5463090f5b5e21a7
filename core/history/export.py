"""A history as one table for other programs: Parquet or CSV, a row a case, engine, mode, output and
motion of a run.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ..case.io.atomic_files import write
from ..case.io.escape import cell
from ..errors import KincheckError
from ..extras import library
from .queries import readable
from .store import Store

INTEGERS = ("run", "solved", "samples", "worst_step")
TRUTHS = ("git_changed", "validated", "within")
NUMBERS = (
    *(
        "calibration_seconds",
        "build_seconds",
        "first_seconds",
        "warm_seconds",
        "waited_seconds",
        "compare_seconds",
    ),
    *("us_per_step", "residual_max", "max_abs", "rms", "tolerance"),
)
"""Columns of the view `measured` that are no text. What was not computed is null, in CSV empty."""

SUFFIXES = (".parquet", ".csv")

ROWS = 10_000  # at a time: a few megabytes, and row groups of a size that readers like


def export(
    store: Store, path: Path, *, cases: Sequence[str] = (), engines: Sequence[str] = ()
) -> int:
    """Write a file, Parquet or CSV by its end; gives the number of rows.

    Args:
        cases, engines: only these; empty: all.

    Raises:
        HistoryError: the history cannot be read.
        KincheckError: the file cannot be written, its end says neither, or pyarrow is not
            installed.
    """
    kind = {".parquet": _parquet, ".csv": _csv}.get(path.suffix.lower())
    if kind is None:
        raise KincheckError(
            f"--export {path}: ends in {path.suffix or 'nothing'!r}; give a file that ends in"
            f" {' or '.join(SUFFIXES)}"
        )
    return write("--export", path, lambda part: kind(part, _rows(store, cases, engines)))


def _rows(
    store: Store, cases: Sequence[str], engines: Sequence[str]
) -> Iterator[list[tuple[Any, ...]]]:
    """The names of the columns, then the rows, so many at a time."""
    chosen = [(column, names) for column, names in (("case", cases), ("engine", engines)) if names]
    where = (
        " AND ".join(f'"{column}" IN ({", ".join("?" * len(names))})' for column, names in chosen)
        or "true"
    )
    now = {row.id: row.status for row in readable(store)}
    with store.explained("read"):
        _leave_out(store)
        values = [name for _, wanted in chosen for name in wanted]
        cursor = store.connection.execute(f"SELECT * FROM measured WHERE {where}", values)
        names = tuple(name for name, *_ in cursor.description)
        yield [names]
        run, status = (names.index(name) for name in ("run", "status"))
        while rows := cursor.fetchmany(ROWS):
            yield [(*row[:status], now[row[run]], *row[status + 1 :]) for row in rows]


def _leave_out(store: Store) -> None:
    """Leave unreadable runs out of the view: their texts would end the query."""
    if store.passed_over:
        (view,) = store.connection.execute(
            "SELECT sql FROM sqlite_master WHERE name = 'measured'"
        ).fetchone()
        listed = ", ".join(str(run) for run in store.passed_over)
        spared = view.replace("CREATE VIEW", "CREATE TEMP VIEW", 1).replace(
            "FROM runs", f"FROM runs WHERE id NOT IN ({listed})", 1
        )
        store.connection.execute(spared)


def _csv(path: Path, chunks: Iterator[list[tuple[Any, ...]]]) -> int:
    (columns,) = next(chunks)
    truths = [columns.index(name) for name in TRUTHS]
    count = 0
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        for rows in chunks:
            for row in rows:
                values = [cell(each) for each in row]
                for k in truths:
                    values[k] = None if row[k] is None else ("false", "true")[row[k]]
                writer.writerow(values)
            count += len(rows)
    return count


def _parquet(path: Path, chunks: Iterator[list[tuple[Any, ...]]]) -> int:
    arrow, parquet = (
        library(f"--export {path}", name, "parquet") for name in ("pyarrow", "pyarrow.parquet")
    )
    kinds = (
        dict.fromkeys(INTEGERS, arrow.int64())
        | dict.fromkeys(NUMBERS, arrow.float64())
        | dict.fromkeys(TRUTHS, arrow.bool_())
    )
    (columns,) = next(chunks)
    schema = arrow.schema([(name, kinds.get(name, arrow.string())) for name in columns])
    count = 0
    with parquet.ParquetWriter(path, schema) as writer:
        for rows in chunks:
            values = {
                name: [*each] for name, each in zip(columns, zip(*rows, strict=True), strict=True)
            }
            for name in TRUTHS:  # SQLite has 0 and 1
                values[name] = [None if each is None else bool(each) for each in values[name]]
            writer.write_table(arrow.table(values, schema=schema))
            count += len(rows)
    return count
