"""A history as one table for other programs, Parquet or CSV: one row per case, engine, mode, output
and motion of a run.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ..case.io.atomic_files import write
from ..case.io.table_file import WRITERS, Kind, lack
from ..errors import KincheckError
from .queries import entries_of
from .store import Store

INTEGERS = ("run", "solved", "samples", "worst_step")
TRUTHS = ("git_changed", "validated", "within")
PHASES = ("calibration", "build", "first", "warm", "waited", "compare")
NUMBERS = (
    *(f"{phase}_seconds" for phase in PHASES),
    *("us_per_step", "residual_max", "max_abs", "rms", "tolerance"),
)
"""Columns of the view `measured` that are not text. Missing values are null, in CSV empty."""

KINDS = (
    dict.fromkeys(INTEGERS, Kind.INTEGER)
    | dict.fromkeys(NUMBERS, Kind.NUMBER)
    | dict.fromkeys(TRUTHS, Kind.TRUTH)
)

SUFFIXES = (".parquet", ".csv")

ROWS = 10_000  # rows at a time: a few megabytes, and row groups of a usual size


def export(
    store: Store, path: Path, *, cases: Sequence[str] = (), engines: Sequence[str] = ()
) -> int:
    """Write a Parquet or CSV file, by its suffix, and return the number of rows.

    Args:
        cases, engines: only these; empty: all.

    Raises:
        HistoryError: the history cannot be read.
        KincheckError: the file cannot be written, it has another suffix, or pyarrow is not
            installed.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise KincheckError(
            f"--export {path}: ends in {path.suffix or 'nothing'!r}; give a file that ends in"
            f" {' or '.join(SUFFIXES)}"
        )
    kind = suffix.removeprefix(".")
    if missing := lack(kind, f"--export {path}", "or give a .csv"):
        raise KincheckError(missing)

    def put(part: Path) -> int:
        chunks = _rows(store, cases, engines)
        (names,) = next(chunks)
        columns = {name: KINDS.get(name, Kind.TEXT) for name in names}
        return WRITERS[kind](part, columns, chunks)

    return write("--export", path, put)


def _rows(
    store: Store, cases: Sequence[str], engines: Sequence[str]
) -> Iterator[list[tuple[Any, ...]]]:
    """Yield the names of the columns, then the rows in batches."""
    chosen = [(column, names) for column, names in (("case", cases), ("engine", engines)) if names]
    where = (
        " AND ".join(f'"{column}" IN ({", ".join("?" * len(names))})' for column, names in chosen)
        or "true"
    )
    for row in store.runs():
        with store.sparing():  # a damaged text would end the query
            entries_of(store, row.id)
    now = {row.id: row.status for row in store.runs()}
    with store.explained("read"):
        if store.passed_over:
            _leave_out(store)
        values = [name for _, wanted in chosen for name in wanted]
        cursor = store.connection.execute(f"SELECT * FROM measured WHERE {where}", values)
        names = tuple(name for name, *_ in cursor.description)
        yield [names]
        run, status = (names.index(name) for name in ("run", "status"))
        while rows := cursor.fetchmany(ROWS):
            yield [(*row[:status], now[row[run]], *row[status + 1 :]) for row in rows]


def _leave_out(store: Store) -> None:
    """Exclude unreadable runs from the view."""
    query = "SELECT sql FROM sqlite_master WHERE name = 'measured'"
    (view,) = store.connection.execute(query).fetchone()
    listed = ", ".join(map(str, store.passed_over))
    spared = view.replace("FROM runs", f"FROM runs WHERE id NOT IN ({listed})", 1)
    store.connection.execute(spared.replace("CREATE VIEW", "CREATE TEMP VIEW", 1))
