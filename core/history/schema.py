"""Tables of a history, and the migration of files of earlier versions.

`runs`: a row a run. `records`: a row a (case, engine, mode) of a run; trends and tables read the
columns, and `record` holds the whole record. `documents`: further texts of a run's case, such as
references, each text once for all runs. `measured`: a flat view for other programs and for export,
a row a case, engine, mode, output and motion of a run.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from time import monotonic, sleep

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
        raise ValueError("a database of another program; give another file")
    if version > len(MIGRATIONS):
        raise ValueError(
            f"its schema is version {version}, this kincheck knows {len(MIGRATIONS)}; update"
            " kincheck"
        )
    return version


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
