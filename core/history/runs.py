"""Selection of the run of a report and of the run compared with: by number, by file, by a rule."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from datetime import UTC, datetime
from os.path import exists
from pathlib import Path
from typing import Any

import numpy as np

from ..case.case import Case
from ..errors import KincheckError
from ..harness.engine import PATIENCE, Engine, versions
from ..harness.provenance import circumstances, conditions, plain, references
from ..harness.record import Facts, Record, Results
from ..harness.results_file import read_results
from ..harness.run import plan_pairs
from .judging import judge_runs
from .queries import (
    NIGHTS,
    choose_state_run,
    faultless,
    same_options,
)
from .store import HistoryError, RunRow, Store
from .subjects import Subject, last_good, with_states

LAST_GREEN = "last-green"
BASELINE = "-baseline"
IMPORT = 20.0
"""Least time for the version of an engine [s], however short the limit of a pair is: its process
imports a simulator beside those of all others.
"""


def find(name: str | None, store: Store | None) -> Subject:
    """Return the run of a number or of a results.json; for None, the run of the history's state,
    see `choose_state_run`.

    A killed run counts, too: judging the run before it would hide the fault.

    Raises:
        KincheckError: there is none, or it cannot be read.
    """
    if store is not None:
        judge_runs(store)
    if name is not None and not name.isdecimal():
        return _in_file(Path(name), store)
    if store is None:
        raise KincheckError(
            f"report: {'no run' if name is None else f'run {name}'} without a history. Give"
            " --history FILE, or a results.json."
        )
    if name is not None:
        row = store.run(int(name))
        if row.status == "running":
            raise KincheckError(
                f"report: run {row.id} is still running. Report it when it has ended."
            )
        return _stored_run(store, row)
    rows = [row for row in store.runs() if row.status != "running"]
    row = choose_state_run(rows, faultless(store, rows[:NIGHTS]), NIGHTS)
    if row is None:
        raise KincheckError(
            f"history {store.path}: no run to report. `kincheck run --history {store.path}`"
            " records one"
        )
    later = [each.id for each in reversed(rows) if each.id > row.id]
    return replace(_stored_run(store, row), passed_by=later)


def find_against(name: str, subject: Subject, store: Store | None) -> tuple[Subject | None, str]:
    """Return the run to compare with, or the reason why there is none. A named run must exist; a
    run by a rule may not exist yet.

    Raises:
        KincheckError: the named run does not exist, or is the subject itself.
    """
    if name == LAST_GREEN or (name.endswith(BASELINE) and not exists(name)):
        if store is None:
            return None, f"{name} needs a history, and none is given"
        if name == LAST_GREEN:
            found = last_good(subject, store)
            return (
                (found, "") if found.bases else (None, "no earlier green run of any of its pairs")
            )
        row = _baseline(store, name, subject)
        if row is not None:
            with store.sparing():
                return _stored_run(store, row, name.replace("-", " ")), ""
            return find_against(name, subject, store)  # the next best
        known = sorted({str(row.git["branch"]) for row in store.runs() if row.git.get("branch")})
        return None, (
            f"no earlier run of branch {name.removesuffix(BASELINE)!r}, without changes to its"
            " files, with any of its pairs. The history has"
            f" {'branches ' + ', '.join(known) if known else 'no branch'}"
        )
    against = find(name, store)
    if against.number is not None and against.number == subject.number:
        raise KincheckError(
            f"report: {subject.name} cannot be compared with itself. Give another --against."
        )
    return against, ""


def _in_file(file: Path, store: Store | None) -> Subject:
    if not exists(file):
        known = f"a number of the history, a results.json, {LAST_GREEN} or BRANCH{BASELINE}"
        raise KincheckError(f"report: there is no run {str(file)!r}. Give {known}.")
    results = read_results(file)
    rows, facts = store.runs() if store else [], results.run
    known = tuple(facts.get(key) for key in ("started", "host", "command"))
    same = [row.id for row in rows if (row.started, row.key["host"], row.command) == known]
    later = [row.id for row in rows if row.started > str(facts.get("started", "~"))]
    number = max(same, default=None)
    subject = Subject(str(file), number, results, number or min(later, default=math.inf))
    return with_states(subject, store) if store else subject


def _stored_run(store: Store, row: RunRow, rule: str = "") -> Subject:
    name = f"run {row.id}" + (f" ({rule})" if rule else "")
    if row.status != "finished":
        name += ", without an end" if row.status == "killed" else f", {row.status}"
    return with_states(Subject(name, row.id, store.results(row.id), row.id), store)


def _baseline(store: Store, name: str, subject: Subject) -> RunRow | None:
    """Return the finished run of a branch with the most pairs of the subject; runs with uncommitted
    edits are no baseline.
    """
    rows = [
        row
        for row in store.runs()
        if row.status == "finished"
        and row.id < subject.before
        and row.git.get("branch") == name.removesuffix(BASELINE)
        and not row.git.get("changed")
    ]
    shared = {row.id: len(subject.pairs.intersection(row.plan)) for row in rows}
    return max(
        (row for row in rows if shared[row.id]),
        key=lambda row: (same_options(row.key, subject.facts), shared[row.id], row.id),
        default=None,
    )


def digest(*things: Any) -> str:
    """Return the SHA-256 digest of data: dataclasses by class and fields, arrays by their bits.

    A pickle is unsuitable: it depends on which equal parts are one object. Objects of other types
    enter by their text; a text with a memory address makes every digest different.
    """
    whole = hashlib.sha256()
    for piece in _pieces(things):
        whole.update(piece)
    return whole.hexdigest()


def _pieces(thing: Any) -> Iterator[bytes]:
    if isinstance(thing, np.ndarray):
        values: Any = np.ascontiguousarray(thing)  # pyright: ignore
        yield f"array{values.shape}{values.dtype.str}".encode()
        yield values.tobytes()
    elif is_dataclass(thing) and not isinstance(thing, type):
        yield f"({type(thing).__qualname__}".encode()
        for field in fields(thing):
            yield f",{field.name}=".encode()
            yield from _pieces(getattr(thing, field.name))
        yield b")"
    elif isinstance(thing, Mapping):
        yield b"{"
        for key, value in thing.items():  # pyright: ignore
            yield from _pieces(key)
            yield from _pieces(value)
        yield b"}"
    elif isinstance(thing, Sequence) and not isinstance(thing, str | bytes):
        yield b"["
        for each in thing:  # pyright: ignore
            yield from _pieces(each)
        yield b"]"
    else:
        yield f"{type(thing).__name__}:{thing!r};".encode("utf-8", "surrogatepass")


@dataclass
class Keeping:
    """A run in a history.

    Attributes:
        run: its number.
        resumed: whether the run continues an earlier one.
        made: the records of the earlier run.
        facts: its circumstances, for `run`.
        problems: faults of the history; after the first, the run continues without a history.
    """

    store: Store
    run: int
    facts: Facts
    resumed: bool = False
    made: Sequence[Record] = ()
    problems: list[str] = field(default_factory=list[str])

    def add(self, record: Record) -> None:
        """Keep a record."""
        if self.problems:
            return
        try:
            self.store.add_record(self.run, record)
        except HistoryError as error:
            self.problems.append(
                f"{error}. The records before {record.case} {record.engine} are stored as run"
                f" {self.run}"
            )

    def end(self, results: Results, *, interrupted: bool) -> None:
        """End the run, complete or interrupted."""
        if not self.problems:
            try:
                self.store.finish(self.run, results, "interrupted" if interrupted else "finished")
            except HistoryError as error:
                self.problems.append(
                    f"{error}. All records are stored, but run {self.run} has no end. --resume"
                    " gives it one"
                )
            else:
                self._judge()
        self.store.close()

    def _judge(self) -> None:
        try:
            judge_runs(self.store)
        except HistoryError as error:
            self.problems.append(f"{error}. Run {self.run} is stored, and its report judges it")


def keep(
    path: Path,
    cases: Sequence[Case],
    engines: Sequence[Engine],
    *,
    tol: float,
    command: str,
    settings: Facts,
    resume: bool,
    unread: Sequence[str] = (),
    sources: Mapping[str, str] | None = None,
) -> Keeping:
    """Begin a run in a history, or continue the last one with the same cases, engines, tolerance,
    limits, versions, machine and files.

    Args:
        settings: further circumstances.
        resume: continue an unfinished run; begin a new one if there is none.
        unread: names of requested cases that cannot be read.
        sources: digests of the modules of joint types and engines of users, by name: other code
            makes another run.

    Raises:
        HistoryError: the file is damaged, or cannot be read or written.
    """
    started = datetime.now(UTC)
    facts = circumstances(cases, started=started, tol=tol, command=command) | plain(
        {**settings, **conditions()}
    )
    plan = plan_pairs(cases, engines, unread)
    # the place of the work and the number of workers change no record
    limits = [settings.get(name) for name in ("timeout", "memory_gb")]
    git: Facts = facts["git"] or {}
    state = [facts[name] for name in ("kincheck", "python", "numpy")] + [
        git.get(name) for name in ("commit", "changed", "edits")
    ]
    code = [*state, *(sources or {}).items()]
    # a version that comes late would be another one, and the run could not be resumed
    found = versions(engines, min(max(settings.get("timeout", PATIENCE), IMPORT), PATIENCE))
    versioned = [
        (each.name, each.mode, version) for each, version in zip(engines, found, strict=True)
    ]
    machine = [*(facts[name] for name in ("host", "processor")), *versioned]
    identity = digest(cases, plan, tol, limits, code, machine)
    store = Store(path)
    try:
        store.require_sound(NIGHTS)
        if resume:
            with store.sparing():
                earlier = store.resume_run(identity)
                if earlier is not None:
                    return Keeping(
                        store,
                        earlier.id,
                        earlier.circumstances,
                        resumed=True,
                        made=store.records(earlier.id),
                    )
        run = store.begin_run(identity, plan, facts, references(cases))
    except BaseException:
        store.close()
        raise
    return Keeping(store, run, facts)
