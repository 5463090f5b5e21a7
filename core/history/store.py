"""Store: access to a history file.

    with Store(path) as store:                      # Store(path, writable=False) to read only
        run = store.begin_run(...)                  # its number
        store.add_record(run, record)               # on disk when this returns
        store.finish(run, results)
        for each in store.runs(): ...               # RunRow, the latest first
        results = store.results(run)                # as `kincheck run --json` writes them

Other queries are SQL on `store.connection`; `schema` describes the tables.
"""

from __future__ import annotations

import hashlib
import os
import platform
import sqlite3
import zlib
from collections.abc import Generator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, Self, TypeAlias

import msgspec

from ..harness.provenance import missing_pairs, readable, versions
from ..harness.record import Record, Results, Seconds, update_outcome
from .database import (
    DamagedRunError,
    HistoryError,
    damage_lines,
    explained,
    readable_connection,
    require_sound,
    writable_connection,
)

Status: TypeAlias = Literal["running", "finished", "interrupted", "killed"]
"""The file marks a run as running until it ends; without its process, the run was killed."""
Pair: TypeAlias = tuple[str, str, str]
"""Case, engine and mode."""
Plan: TypeAlias = Sequence[Pair]

# Level of compression: the best level makes a record of 73 kB 3 % smaller, and takes 6 ms instead
# of 1.
QUICK = 1

KEPT = 100
"""Number of latest runs whose circumstances stay in memory, as reports read them."""

FIELDS = ("engine", "mode", "message", "validated", "version", "solved", "samples")
NUMBERS = ("residual_max", "us_per_step")
"""Columns of `records` that are fields of a record."""

# Long texts as bytes: a damaged one then spoils only its own run.
_ROW = (
    "SELECT id, started, finished, status, command, CAST(plan AS BLOB), CAST(circumstances AS"
    " BLOB), owner FROM runs"
)


class _Key(msgspec.Struct, frozen=True):
    """The circumstances that tell which task a run had, and where."""

    selection: dict[str, Any] | None = None
    command: Any = None
    git: dict[str, Any] | None = None
    host: Any = None


@dataclass(frozen=True)
class RunRow:
    """A row of the table `runs`.

    Attributes:
        key: those circumstances by which runs are chosen.
        text: all circumstances, as JSON; None for earlier runs than the latest `KEPT`.
        store: the file, which has them: those of thousands of runs are a hundred MB.
    """

    id: int
    started: str
    finished: str | None
    status: Status
    command: str
    plan: Plan
    key: dict[str, Any]
    text: bytes | None
    store: Store

    @cached_property
    def circumstances(self) -> dict[str, Any]:
        """The circumstances of the run, as `Results.run`."""
        return msgspec.json.decode(self.text or self.store.run(self.id).text or b"")

    @property
    def git(self) -> dict[str, Any]:
        """The state of the files of the run; empty without a repository."""
        return self.key["git"] or {}


class Store:
    """A history file. Every method raises HistoryError if the file cannot be read or written."""

    def __init__(self, path: Path, *, writable: bool = True) -> None:
        self.path, self.writable = path, writable
        self.passed_over: dict[int, str] = {}  # reasons of unreadable runs
        self._runs: list[RunRow] | None = None
        with self.explained("opened"):
            self.connection = writable_connection(path) if writable else readable_connection(path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        # commits are on disk; the clean-up can fail on a full disk
        with suppress(sqlite3.Error):
            self.connection.close()

    def require_sound(self, latest: int) -> None:
        """Refuse a file whose structure is damaged, before anything is written into it. Runs with
        damaged records are passed over.

        Args:
            latest: number of runs whose records are checked, as a report reads them; 0 for none.
        """
        with self.explained("written"):
            require_sound(self.connection)
        for row in self.runs()[:latest] if latest else ():
            with self.sparing(), self.explained("read", row.id):
                query = "SELECT record FROM records WHERE run_id = ?"
                for (record,) in self.connection.execute(query, (row.id,)):
                    zlib.decompress(record)

    def begin_run(
        self,
        identity: str,
        plan: Plan,
        circumstances: dict[str, Any],
        references: Mapping[str, Any] | None = None,
    ) -> int:
        """Begin a run and return its number.

        Args:
            identity: digest by which a later process resumes the run; equal for runs with equal
                records.
            plan: case, engine and mode of the pairs, in the order of the results.
            circumstances: as `Results.run`, with the start time and the command.
            references: as `Results.references`, for readers of an unfinished run.
        """
        with self.transaction():
            row = {name: circumstances[name] for name in ("started", "command")}
            row |= {"status": "running", "identity": identity, "owner": owner()}
            row |= {"plan": _json(plan), "circumstances": _json(circumstances)}
            run = self._insert("INTO runs", row)
            self._attach(run, "references", references or {})
        return run

    def resume_run(self, identity: str) -> RunRow | None:
        """Return the last run of an identity if it is unfinished and no other process writes it.

        From then on, this process owns it.
        """
        with self.transaction():
            query = (
                "SELECT id, owner FROM runs WHERE identity = ? AND status != 'finished' ORDER BY id"
                " DESC"
            )
            for run, other in self.connection.execute(query, (identity,)).fetchall():
                if other == owner() or not alive(other):
                    change = (
                        "UPDATE runs SET status = 'running', finished = NULL, owner = ? WHERE"
                        " id = ?"
                    )
                    self.connection.execute(change, (owner(), run))
                    return self.run(run)
        return None

    def add_record(self, run: int, record: Record) -> None:
        """Store a record. A second record of a pair is ignored."""
        row = {name: getattr(record, name) for name in (*FIELDS, *NUMBERS)}
        row |= {"run_id": run, "case_name": record.case, "made": now()}
        row |= {"outcome": str(record.outcome), "truth": str(record.truth)}
        seconds = msgspec.structs.asdict(record.seconds or Seconds())
        row |= {f"{phase}_seconds": time for phase, time in seconds.items()}
        row |= {"errors": _json(record.errors)}
        row |= {"record": zlib.compress(msgspec.json.encode(record), QUICK)}
        with self.transaction():
            self._insert("OR IGNORE INTO records", row)

    def _insert(self, where: str, row: Mapping[str, Any]) -> int:
        places = ", ".join("?" * len(row))
        text = f"INSERT {where} ({', '.join(row)}) VALUES ({places})"
        return self.connection.execute(text, [*row.values()]).lastrowid or 0

    def finish(self, run: int, results: Results | None = None, status: Status = "finished") -> None:
        """End the run, and store the other parts of the results, such as references."""
        with self.transaction():
            for kind in ("references", "scenes", "suspects") if results is not None else ():
                self._attach(run, kind, getattr(results, kind))
            self.connection.execute(
                "UPDATE runs SET status = ?, finished = ? WHERE id = ?", (status, now(), run)
            )

    def remove(self, run: int) -> None:
        """Remove a run with its records and with texts that no other run uses."""
        with self.transaction():
            self.connection.execute("DELETE FROM states WHERE run_id >= ?", (run,))
            for table in ("accepted", "attachments", "records"):
                self.connection.execute(f"DELETE FROM {table} WHERE run_id = ?", (run,))
            query = "DELETE FROM runs WHERE id = ?"
            removed = self.connection.execute(query, (run,)).rowcount
            self.connection.execute(
                "DELETE FROM documents WHERE digest NOT IN (SELECT digest FROM attachments)"
            )
        if not removed:
            raise HistoryError(f"history {self.path}: there is no run {run}")

    def runs(self) -> list[RunRow]:
        """Return all readable runs, the latest first. They are read once until this store changes
        them.
        """
        if self._runs is None:
            self._runs = self._read_runs()
        return [row for row in self._runs if row.id not in self.passed_over]

    def _read_runs(self) -> list[RunRow]:
        plans: dict[bytes, Plan] = {}
        found: list[RunRow] = []
        try:
            for row in self.connection.execute(f"{_ROW} ORDER BY id DESC"):
                with self.sparing(), self.explained("read", row[0]):
                    found.append(self._row(row, plans, kept=len(found) < KEPT))
            return found
        except sqlite3.Error:  # a damaged run, which would hide all others
            with self.explained("read"):
                query = "SELECT id FROM runs ORDER BY id DESC"
                numbers = self.connection.execute(query).fetchall()
            found.clear()
            for (number,) in numbers:
                with self.sparing():
                    found.append(self.run(number))
            return found

    @contextmanager
    def sparing(self) -> Generator[None]:
        """Skip an unreadable run."""
        try:
            yield
        except DamagedRunError as error:
            self.passed_over.setdefault(error.run, str(error))

    @property
    def damage(self) -> list[str]:
        """Return a line for each skipped run."""
        return damage_lines(self.path, self.passed_over)

    def run(self, run: int) -> RunRow:
        """Return the run of a number.

        Raises:
            HistoryError: there is none.
        """
        with self.explained("read", run):
            row = self.connection.execute(f"{_ROW} WHERE id = ?", (run,)).fetchone()
            if row is not None:
                return self._row(row, {})
        raise HistoryError(f"history {self.path}: there is no run {run}")

    def _row(self, row: Sequence[Any], plans: dict[bytes, Plan], *, kept: bool = True) -> RunRow:
        """Return a row of `_ROW`.

        Args:
            plans: those read so far, by their texts; most runs of a history have the same.
            kept: whether the circumstances stay in memory.
        """
        number, started, finished, status, command, plan, text, process = row
        if plan not in plans:
            plans[plan] = msgspec.json.decode(plan, type=list[Pair])
        key = msgspec.structs.asdict(msgspec.json.decode(text, type=_Key))
        killed = status == "running" and not alive(process)
        status = "killed" if killed else status
        about = started, finished, status, command, plans[plan], key
        return RunRow(number, *about, text if kept else None, self)

    def records(self, run: int) -> list[Record]:
        """Return the records of a run, in the order of its plan."""
        place = {pair: k for k, pair in enumerate(self.run(run).plan)}
        with self.explained("read", run):
            rows = self.connection.execute(
                "SELECT record FROM records WHERE run_id = ?", (run,)
            ).fetchall()
            records = [
                update_outcome(msgspec.json.decode(zlib.decompress(blob), type=Record))
                for (blob,) in rows
            ]
        return sorted(records, key=lambda each: place.get(each.pair, len(place)))

    def results(self, run: int) -> Results:
        """Return the results of a run as the command wrote them.

        For an unfinished run, `run["missing"]` lists the missing pairs.
        """
        row, records = self.run(run), self.records(run)
        attached: dict[str, dict[str, Any]] = {}
        with self.explained("read", run):
            query = (
                "SELECT kind, case_name, content FROM attachments JOIN documents USING (digest)"
                " WHERE run_id = ?"
            )
            for kind, case, content in self.connection.execute(query, (run,)):
                attached.setdefault(kind, {})[case] = msgspec.json.decode(zlib.decompress(content))
            facts = row.circumstances | {
                "engines": versions(records),
                **missing_pairs(row.plan, records),
            }
            whole: dict[str, Any] = {"run": facts, "records": [], **attached}
            return msgspec.structs.replace(msgspec.convert(whole, type=Results), records=records)

    def _attach(self, run: int, kind: str, documents: Mapping[str, Any]) -> None:
        for case, document in documents.items():
            text = msgspec.json.encode(document)
            digest = hashlib.sha256(text).hexdigest()
            self.connection.execute(
                # a text that is damaged in the file is whole again, for all its runs
                "INSERT INTO documents VALUES (?, ?) ON CONFLICT (digest) DO UPDATE SET content ="
                " excluded.content WHERE content IS NOT excluded.content",
                (digest, zlib.compress(text)),
            )
            self.connection.execute(
                "INSERT OR REPLACE INTO attachments VALUES (?, ?, ?, ?)", (run, kind, case, digest)
            )

    @contextmanager
    def transaction(self) -> Generator[None]:
        """Do all changes of a block, or none."""
        self._runs = None
        with self.explained("written"):
            self.connection.execute("BEGIN IMMEDIATE" if self.writable else "BEGIN")
            try:
                yield
                self.connection.execute("COMMIT")
            except BaseException:
                # after some failures SQLite has already ended the transaction
                if self.connection.in_transaction:
                    self.connection.execute("ROLLBACK")
                raise

    def explained(self, what: str, run: int | None = None) -> AbstractContextManager[None]:
        """Raise faults of the database as a HistoryError; see `faults`."""
        return explained(self.path, what, run)


def _json(value: Any) -> str:
    return msgspec.json.encode(value).decode()


def now() -> str:
    """Return the current time in the format of the history."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def owner() -> str:
    """Return host, process id and start of this process; systems reuse process ids."""
    return f"{readable(platform.node())}|{os.getpid()}|{_begun(os.getpid())}"


def alive(owner: str) -> bool:
    """Return whether a process still runs. A process of another host counts as ended."""
    host, number, begun = owner.rsplit("|", 2)
    if host != readable(platform.node()):
        return False
    try:
        os.kill(int(number), 0)  # signal 0 only tests the process
    except ProcessLookupError:
        return False
    except OSError:  # the process is another user's, or the system cannot tell
        pass
    return _begun(int(number)) == begun


def _begun(number: int) -> str:
    """Return the clock ticks from the start of the system to the start of the process.

    Empty without /proc, and for an ended process whose exit status nobody has read.
    """
    try:
        # the second field is the program's name in brackets, which may hold any character
        state, *fields = (
            Path(f"/proc/{number}/stat").read_text("utf-8", "replace").rpartition(")")[2].split()
        )
        return "" if state in "ZX" else fields[18]
    except (OSError, ValueError, IndexError):
        return ""
