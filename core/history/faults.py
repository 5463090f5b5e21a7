"""Messages on faults of history files: the fault, the file and the remedy."""

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
