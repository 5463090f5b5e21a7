"""Connections to a history file, for writing and for reading without changing it, and messages on
its faults: the fault, the file and the remedy.
"""

from __future__ import annotations

import shlex
import sqlite3
import zlib
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path

import msgspec

from ..errors import KincheckError, shortened
from ..harness.execution import bounded
from .schema import MIGRATIONS, check, migrate, write_ahead

# Longest wait for a file that another run holds [s]. A run holds it for a millisecond per record; a
# longer hold is a fault.
BUSY = 30.0

# Largest number of unreadable runs listed one by one; with more, the whole file is damaged.
MOST_LISTED = 5


class HistoryError(KincheckError):
    """A history file cannot be read or written; the message names the file and the remedy."""


class DamagedRunError(HistoryError):
    """One run of a history cannot be read; others may be readable."""

    def __init__(self, run: int, message: str) -> None:
        super().__init__(message)
        self.run = run


@contextmanager
def explained(path: Path, what: str, run: int | None = None) -> Generator[None]:
    """Raise faults of the database as a HistoryError that names the file, and the run if only this
    run is damaged.

    Args:
        what: participle of the action on the file.
        run: the run, if the action concerns only one.
    """
    try:
        yield
    except (
        sqlite3.Error,
        OSError,
        ValueError,
        TypeError,
        zlib.error,
        msgspec.MsgspecError,
    ) as error:
        if run is not None and _damaged(error):
            raise DamagedRunError(
                run,
                f"history {path}: run {run} cannot be {what} ({bounded(error)}); it may be damaged:"
                " restore a copy of the file, or remove the run: kincheck history --history"
                f" {shlex.quote(str(path))} --remove {run}",
            ) from error
        advice = (
            ""
            if isinstance(error, ValueError) and not isinstance(error, msgspec.MsgspecError)
            else _advice(str(error))
        )
        raise HistoryError(f"history {path}: cannot be {what}: {bounded(error)}{advice}") from error


def damage_lines(path: Path, passed_over: Mapping[int, str]) -> list[str]:
    """Return a line for each unreadable run, up to MOST_LISTED of them."""
    runs = sorted(passed_over, reverse=True)
    lines = [f"{passed_over[run]}; the other runs are used" for run in runs[:MOST_LISTED]]
    if left := runs[MOST_LISTED:]:
        lines.append(
            f"history {path}: {len(left)} more runs cannot be read:"
            f" {shortened([str(run) for run in left], 20)}"
        )
    return lines


def _damaged(error: Exception) -> bool:
    """Return whether the stored data are damaged, as opposed to a failed access."""
    return (
        not isinstance(error, OSError | sqlite3.OperationalError)
        or "decode" in str(error)
        or "malformed" in str(error)
    )


def _advice(message: str) -> str:
    known = {
        "full": "make room",
        "disk I/O": "check the disk: it may be full, or limit the size of files",
        "readonly": "give a file that can be written",
        "unable to open": "give a file in a folder that exists and can be written",
        "locked": f"another process holds it for more than {BUSY:g} s; end that process",
        "not a database": "give another file",
    }
    return "; " + next(
        (advice for part, advice in known.items() if part in message),
        "it may be damaged: restore a copy of it",
    )


def writable_connection(path: Path) -> sqlite3.Connection:
    """Return a connection for writing; create the tables, or migrate them.

    Raises:
        HistoryError: the file is not a history.
        sqlite3.Error: the file cannot be written.
    """
    connection = sqlite3.connect(path, timeout=BUSY, isolation_level=None)
    try:
        check(connection)  # before any change, in case the file belongs to another program
        write_ahead(connection, BUSY)
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
            timeout=BUSY,
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
        if not version:
            connection.close()
            raise HistoryError(
                f"history {path}: it is empty; `kincheck run --history FILE` stores runs in it"
            )
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
