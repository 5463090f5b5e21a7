"""Faults of history files in words: the fault, the file and the remedy."""

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

# For another run to let go of the file [s]: it holds it for a millisecond a record. Longer, and
# something is wrong with it.
BUSY = 30.0

# Runs that cannot be read, told one by one: where there are more, the whole file is at fault.
MOST_LISTED = 5


class HistoryError(KincheckError):
    """A history file cannot be read or written; the message names the file and the remedy."""


class DamagedRunError(HistoryError):
    """One run of a history cannot be read; the others may be."""

    def __init__(self, run: int, message: str) -> None:
        super().__init__(message)
        self.run = run


@contextmanager
def explained(path: Path, what: str, run: int | None = None) -> Generator[None]:
    """Raise faults of the database as a HistoryError with the file, and with the run if one run is
    damaged.

    Args:
        what: the action on the file, as a participle.
        run: the only run concerned.
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
    """Return whether the stored data are at fault, and not the access to them."""
    return (
        not isinstance(error, OSError | sqlite3.OperationalError)
        or "decode" in str(error)
        or "malformed" in str(error)
    )


def _advice(message: str) -> str:
    known = {
        "full": "make room",
        "disk I/O": "look at the disk: it may be full, or over a limit on the size of files",
        "readonly": "give a file that can be written",
        "unable to open": "give a file in a folder that exists and can be written",
        "locked": f"another process holds it for longer than {BUSY:g} s; end that one",
        "not a database": "give another file",
    }
    return "; " + next(
        (advice for part, advice in known.items() if part in message),
        "it may be damaged: restore a copy of it",
    )
