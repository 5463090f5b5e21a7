"""What goes wrong with a history file, in words: what, where, and what to do."""

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
MOST_TOLD = 5


class HistoryError(KincheckError):
    """A history file cannot be read or written; the message names it and says what to do."""


class DamagedRunError(HistoryError):
    """One run of a history cannot be read; the others may be."""

    def __init__(self, run: int, message: str) -> None:
        super().__init__(message)
        self.run = run


@contextmanager
def explained(path: Path, what: str, run: int | None = None) -> Generator[None]:
    """What goes wrong meanwhile is a HistoryError that names the file, and the run if it is one run
    that is damaged.

    Args:
        what: was to be done with the file, a participle.
        run: what is read belongs to it alone.
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


def told(path: Path, passed_over: Mapping[int, str]) -> list[str]:
    """Return what is said of runs that cannot be read: a line for each, up to MOST_TOLD of them."""
    runs = sorted(passed_over, reverse=True)
    lines = [f"{passed_over[run]}; the other runs are used" for run in runs[:MOST_TOLD]]
    if left := runs[MOST_TOLD:]:
        lines.append(
            f"history {path}: {len(left)} more runs cannot be read:"
            f" {shortened([str(run) for run in left], 20)}"
        )
    return lines


def _damaged(error: Exception) -> bool:
    """Whether what is stored is at fault, and not the way to it."""
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
