"""Connections to a history file: for writing, and for reading without changing it."""

from __future__ import annotations

import sqlite3
from pathlib import Path

from . import faults
from .faults import HistoryError
from .schema import MIGRATIONS, check, migrate, write_ahead


def writable_connection(path: Path) -> sqlite3.Connection:
    """Return a connection for writing; create the tables, or migrate them.

    Raises:
        HistoryError: the file is not a history.
        sqlite3.Error: the file cannot be written.
    """
    connection = sqlite3.connect(path, timeout=faults.BUSY, isolation_level=None)
    try:
        check(connection)  # before any change, in case the file belongs to another program
        write_ahead(connection, faults.BUSY)
        connection.execute("PRAGMA synchronous = FULL")  # a commit survives a power failure, too
        connection.execute("PRAGMA foreign_keys = ON")
        migrate(connection)
    except BaseException:
        connection.close()
        raise
    return connection


def readable_connection(path: Path) -> sqlite3.Connection:
    """Return a connection for reading; migrate a file of an older version first.

    Raises:
        HistoryError: the file is missing, is not a history, or is incomplete without its journal.
        sqlite3.Error: the file cannot be read.
    """
    if not path.is_file():
        raise HistoryError(
            f"history {path}: there is no such file; `kincheck run --history FILE` creates one"
        )
    # In a read-only folder the file has no journal beside it, so no process writes it.
    for how in ("mode=ro", "mode=ro&immutable=1"):
        connection = sqlite3.connect(
            f"{path.absolute().as_uri()}?{how}",
            uri=True,
            timeout=faults.BUSY,
            isolation_level=None,
        )
        try:
            version = check(connection)
        except sqlite3.OperationalError:
            connection.close()
            if how != "mode=ro":
                raise
            _require_whole(path)
            continue
        except BaseException:
            connection.close()
            raise
        if version < len(MIGRATIONS):
            connection.close()
            return writable_connection(path)
        return connection
    raise AssertionError("the second way either connects or raises")


def _require_whole(path: Path) -> None:
    """Raise HistoryError if the latest records are only in the journal beside the file.

    Reading them needs a writable folder.
    """
    beside = path.with_name(f"{path.name}-wal")
    if beside.is_file() and beside.stat().st_size:
        raise HistoryError(
            f"history {path}: its latest records are still in {beside.name}, and the folder is"
            " read-only, so they cannot be merged; copy both files to a"
            " writable folder"
        )
