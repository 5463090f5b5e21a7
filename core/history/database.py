"""Connections to a history file, for writing and for reading without changing it, and messages on
its faults: the fault, the file and the remedy.
"""

from __future__ import annotations

import shlex
import sqlite3
import zlib
from collections.abc import Generator, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, sleep

import msgspec

from ..errors import KincheckError, shortened
from ..harness.execution import shorten_text

APPLICATION = 0x6B696E63
"""The application_id of these files ("kinc"): databases of other programs are refused."""

OUTCOME = """CASE WHEN outcome = 'pass' AND NOT errors GLOB '*"max_abs":[0-9]*' THEN 'unjudged' ELSE outcome END"""
"""The outcome of a row of `records`: older versions call a solved pair a pass although nothing was
compared.

No text in a JSON string looks like a deviation, since its quotation marks are escaped.
"""

MIGRATIONS = (
    """
    CREATE TABLE runs (
        id INTEGER PRIMARY KEY AUTOINCREMENT,
        started TEXT NOT NULL,         -- ISO 8601, UTC
        finished TEXT,                 -- null: running, or ended by force
        status TEXT NOT NULL CHECK (status IN ('running', 'finished', 'interrupted')),
        command TEXT NOT NULL,
        identity TEXT NOT NULL,        -- equal for runs of the same cases, engines, tolerance, limits and versions
        owner TEXT NOT NULL,           -- the process that writes it
        plan TEXT NOT NULL,            -- JSON: [[case, engine, mode], ...], the pairs in their order
        circumstances TEXT NOT NULL    -- JSON: as Results.run
    );
    CREATE TABLE records (
        run_id INTEGER NOT NULL REFERENCES runs (id),
        case_name TEXT NOT NULL,
        engine TEXT NOT NULL,
        mode TEXT NOT NULL,
        made TEXT NOT NULL,            -- ISO 8601, UTC
        outcome TEXT NOT NULL,
        message TEXT NOT NULL,
        validated INTEGER NOT NULL,
        truth TEXT NOT NULL,
        version TEXT,                  -- of the engine
        solved INTEGER,
        samples INTEGER,
        residual_max REAL,
        build_seconds REAL,            -- phases that were not reached are null
        first_seconds REAL,
        warm_seconds REAL,
        compare_seconds REAL,
        us_per_step REAL,
        errors TEXT NOT NULL,          -- JSON: as Record.errors
        record BLOB NOT NULL,          -- the whole record: zlib, JSON
        PRIMARY KEY (run_id, case_name, engine, mode)
    );
    CREATE INDEX records_of_a_pair ON records (case_name, engine, mode, run_id);
    CREATE TABLE documents (
        digest TEXT PRIMARY KEY,       -- SHA-256 of the text
        content BLOB NOT NULL          -- zlib, JSON
    );
    CREATE TABLE attachments (
        run_id INTEGER NOT NULL REFERENCES runs (id),
        kind TEXT NOT NULL,            -- the key of Results: references, scenes
        case_name TEXT NOT NULL,
        digest TEXT NOT NULL REFERENCES documents (digest),
        PRIMARY KEY (run_id, kind, case_name)
    );
    """,
    """
    ALTER TABLE records ADD COLUMN waited_seconds REAL;  -- as Seconds.waited; null in runs from before it was measured
    CREATE VIEW measured AS
    WITH facts AS MATERIALIZED (  -- once a run, not once a row: the text is long
        SELECT id, started, status,
            json_extract(circumstances, '$.kincheck') AS kincheck,
            json_extract(circumstances, '$.python') AS python,
            json_extract(circumstances, '$.numpy') AS numpy,
            json_extract(circumstances, '$.host') AS host,
            json_extract(circumstances, '$.processor') AS processor,
            json_extract(circumstances, '$.git.commit') AS git_commit,
            json_extract(circumstances, '$.git.branch') AS git_branch,
            json_extract(circumstances, '$.git.changed') AS git_changed,
            json_extract(circumstances, '$.calibration_seconds') AS calibration_seconds
        FROM runs
    ), motions (motion) AS (VALUES ('position'), ('velocity'), ('acceleration'))
    SELECT facts.id AS run, started, status, kincheck, python, numpy, host, processor, git_commit, git_branch, git_changed,
        calibration_seconds, case_name AS "case", engine, mode, version, outcome, message, truth, validated, solved, samples,
        residual_max, build_seconds, first_seconds, warm_seconds, waited_seconds, compare_seconds, us_per_step,
        error.key AS output, motion,
        json_extract(error.value, '$.' || motion || '.max_abs') AS max_abs,
        json_extract(error.value, '$.' || motion || '.rms') AS rms,
        json_extract(error.value, '$.' || motion || '.worst_step') AS worst_step,
        json_extract(error.value, '$.' || motion || '.tolerance') AS tolerance,
        json_extract(error.value, '$.' || motion || '.against') AS against,
        json_extract(error.value, '$.' || motion || '.within') AS within
    FROM records JOIN facts ON facts.id = records.run_id LEFT JOIN json_each(records.errors) AS error CROSS JOIN motions
    ORDER BY run, "case", engine, mode, output;
    """,
    """
    CREATE TABLE states (              -- of each pair after a run; see states.State
        run_id INTEGER NOT NULL REFERENCES runs (id),
        case_name TEXT NOT NULL,       -- empty, as engine and mode: a run without readable records
        engine TEXT NOT NULL,
        mode TEXT NOT NULL,
        options TEXT NOT NULL,         -- JSON: as Results.run, selection.options; empty if not told
        machine TEXT NOT NULL,         -- the processor
        loop REAL,                     -- seconds of the calibration loop
        begun INTEGER NOT NULL,        -- the first run of the series, or the last accepted one
        base_run INTEGER,              -- the baseline of the next run; null: none was good yet
        open TEXT NOT NULL,            -- JSON: [[kind, output, motion, since], ...], what is worse
        levels TEXT NOT NULL,          -- JSON: the least lasting error by output and motion
        PRIMARY KEY (run_id, case_name, engine, mode)
    );
    CREATE INDEX states_of_a_pair ON states (case_name, engine, mode, run_id);
    CREATE TABLE accepted (
        run_id INTEGER NOT NULL REFERENCES runs (id),
        case_name TEXT NOT NULL,
        engine TEXT NOT NULL,
        mode TEXT NOT NULL,
        who TEXT NOT NULL,
        made TEXT NOT NULL,            -- ISO 8601, UTC
        what TEXT NOT NULL,            -- JSON: as states.open at that time
        reason TEXT NOT NULL,
        PRIMARY KEY (run_id, case_name, engine, mode)
    );
    """,
)
"""One text for each version of the schema, which migrates the tables of the previous version.
Published texts never change.
"""


def migrate(connection: sqlite3.Connection) -> None:
    """Migrate the tables in one transaction. Other processes wait for it.

    Raises:
        ValueError: the file is another program's, or of a later version.
    """
    connection.execute("BEGIN IMMEDIATE")
    try:
        version = check(connection)
        for number, text in enumerate(MIGRATIONS[version:], version + 1):
            # not executescript, which would commit the statements before it
            for statement in _statements(text):
                connection.execute(statement)
            connection.execute(f"PRAGMA user_version = {number}")
        connection.execute(f"PRAGMA application_id = {APPLICATION}")
    except BaseException:
        connection.execute("ROLLBACK")
        raise
    connection.execute("COMMIT")


def check(connection: sqlite3.Connection) -> int:
    """Return the version of a file's tables, 0 if it is empty.

    Raises:
        ValueError: the file is another program's, or of a later version.
    """
    # in one statement: another process may be creating the tables, and no half of them must show
    tables, version, application = connection.execute(
        "SELECT (SELECT count(*) FROM sqlite_master), user_version, application_id FROM"
        " pragma_user_version, pragma_application_id"
    ).fetchone()
    if application != APPLICATION and (tables or version or application):
        raise ValueError("a database of another program. Give another file.")
    if version > len(MIGRATIONS):
        raise ValueError(
            f"its schema is version {version}, this kincheck knows {len(MIGRATIONS)}. Update"
            " kincheck."
        )
    return version


def require_sound(connection: sqlite3.Connection) -> None:
    """Refuse a file of damaged structure.

    Raises:
        ValueError: it is damaged.
    """
    (found,) = connection.execute("PRAGMA quick_check(1)").fetchone()
    if found != "ok":
        raise ValueError(f"it is damaged ({found.splitlines()[-1]}). Restore a copy")


def write_ahead(connection: sqlite3.Connection, patience: float) -> None:
    """Turn on write-ahead logging, so that readers and a writer do not wait for each other.

    If several processes request it in a new file at once, SQLite fails some of them instead of
    making them wait. This function then tries again.
    """
    end = monotonic() + patience
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL")
        except sqlite3.OperationalError:
            if monotonic() > end:
                raise
            sleep(0.01)
        else:
            return


def _statements(text: str) -> Iterator[str]:
    begun = ""
    # a semicolon in a string or a comment does not end the statement
    for part in text.split(";")[:-1]:
        begun += f"{part};"
        if sqlite3.complete_statement(begun):
            yield begun
            begun = ""


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
        if run is not None and _is_damaged(error):
            raise DamagedRunError(
                run,
                f"history {path}: run {run} cannot be {what} ({shorten_text(error)}). It may be damaged:"
                " restore a copy of the file, or remove the run: kincheck history --history"
                f" {shlex.quote(str(path))} --remove {run}",
            ) from error
        own = isinstance(error, ValueError) and not isinstance(error, msgspec.MsgspecError)
        advice = "" if own else _advice(str(error))
        raise HistoryError(
            f"history {path}: cannot be {what}: {shorten_text(error)}{advice}"
        ) from error


def damage_lines(path: Path, passed_over: Mapping[int, str]) -> list[str]:
    """Return a line for each unreadable run, up to MOST_LISTED of them."""
    runs = sorted(passed_over, reverse=True)
    lines = [f"{passed_over[run]}. The other runs are used" for run in runs[:MOST_LISTED]]
    if left := runs[MOST_LISTED:]:
        lines.append(
            f"history {path}: {len(left)} more runs cannot be read:"
            f" {shortened([str(run) for run in left], 20)}"
        )
    return lines


def _is_damaged(error: Exception) -> bool:
    """Return whether the stored data are damaged, as opposed to a failed access."""
    return (
        not isinstance(error, OSError | sqlite3.OperationalError)
        or "decode" in str(error)
        or "malformed" in str(error)
    )


def _advice(message: str) -> str:
    known = {
        "full": "Make room",
        "disk I/O": "Check the disk: it may be full, or limit the size of files",
        "readonly": "Give a file that can be written",
        "unable to open": "Give a file in a folder that exists and can be written",
        "locked": f"Another process holds it for more than {BUSY:g} s. End that process",
        "not a database": "Give another file",
    }
    return ". " + next(
        (advice for part, advice in known.items() if part in message),
        "It may be damaged: restore a copy of it",
    )


def writable_connection(path: Path) -> sqlite3.Connection:
    """Return a connection for writing; create the tables, or migrate them.

    Raises:
        HistoryError: the file is not a history.
        sqlite3.Error: the file cannot be written.
    """
    connection = sqlite3.connect(path, timeout=BUSY, isolation_level=None)
    try:
        version = check(connection)  # before any change: it may be another program's, or damaged
        if 0 < version < len(MIGRATIONS):
            require_sound(connection)
        write_ahead(connection, BUSY)
        connection.execute("PRAGMA synchronous = FULL")  # a commit survives a power failure, too
        connection.execute("PRAGMA foreign_keys = ON")
        if version < len(MIGRATIONS):
            migrate(connection)
    except BaseException:
        connection.close()
        raise
    return connection


def readable_connection(path: Path) -> sqlite3.Connection:
    """Return a connection for reading; migrate a file of an older version first.

    Nothing is written with it, but it is no read-only connection, which would leave the journal
    beside the file when it is closed.

    Raises:
        HistoryError: the file is missing, is not a history, or is incomplete without its journal.
        sqlite3.Error: the file cannot be read.
    """
    if not path.is_file():
        raise HistoryError(
            f"history {path}: there is no such file. `kincheck run --history FILE` creates one"
        )
    # In a read-only folder the file has no journal beside it, so no process writes it.
    for how in ("mode=rw", "mode=ro&immutable=1"):
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
            if how != "mode=rw":
                raise
            _require_whole(path)
            continue
        except BaseException:
            connection.close()
            raise
        if not version:
            connection.close()
            raise HistoryError(
                f"history {path}: it is empty. `kincheck run --history FILE` stores runs in it"
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
            " read-only, so they cannot be merged. Copy both files to a"
            " writable folder."
        )
