"""Selection of the run of a report and of the run compared with: by number, by file, by a rule."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
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
from .findings import RunName
from .queries import (
    NIGHTS,
    choose_state_run,
    compared_quantities,
    faultless,
    most_compared,
    same_options,
)
from .store import HistoryError, Pair, RunRow, Store

LAST_GREEN = "last-green"
BASELINE = "-baseline"


@dataclass(frozen=True)
class Subject:
    """A run to be compared.

    Attributes:
        number: number in the history; None for a run outside it.
        before: runs with smaller numbers are earlier; infinite if all runs are.
        passed_by: numbers of later runs of something else, which do not change the judgement.
    """

    name: str
    number: int | None
    results: Results
    before: float
    passed_by: Sequence[int] = ()

    @property
    def facts(self) -> dict[str, Any]:
        """The circumstances of the run."""
        return self.results.run

    @property
    def pairs(self) -> set[Pair]:
        """The planned pairs of the run."""
        return {record.pair for record in self.results.records} | {*self.results.missing}

    @property
    def label(self) -> RunName:
        """The run's name in a report."""
        git: dict[str, Any] = self.facts.get("git") or {}
        known = {key: str(self.facts.get(key, "unknown")) for key in ("started", "host")}
        return RunName(name=self.name, number=self.number, commit=git.get("commit"), **known)


def find(name: str | None, store: Store | None) -> Subject:
    """Return the run of a number or of a results.json; for None, the run of the history's state,
    see `choose_state_run`.

    A killed run counts, too: judging the run before it would hide the fault.

    Raises:
        KincheckError: there is none, or it cannot be read.
    """
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
    row = choose_state_run(rows, faultless(store), NIGHTS)
    if row is None:
        raise KincheckError(
            f"history {store.path}: no run to report; `kincheck run --history {store.path}`"
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
        row = _last_green(store, subject) if name == LAST_GREEN else _baseline(store, name, subject)
        if row is not None:
            with store.sparing():
                return _stored_run(store, row, name.replace("-", " ")), ""
            return find_against(name, subject, store)  # the next best
        if name == LAST_GREEN:
            return None, "no earlier green run has any of its pairs"
        known = sorted({str(row.git["branch"]) for row in store.runs() if row.git.get("branch")})
        return None, (
            f"no earlier run of branch {name.removesuffix(BASELINE)!r}, without changes to its"
            " files, with any of its pairs; the history has"
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
    return Subject(str(file), number, results, number or min(later, default=math.inf))


def _stored_run(store: Store, row: RunRow, rule: str = "") -> Subject:
    name = f"run {row.id}" + (f" ({rule})" if rule else "")
    if row.status != "finished":
        name += ", without an end" if row.status == "killed" else f", {row.status}"
    return Subject(name, row.id, store.results(row.id), row.id)


def _last_green(store: Store, subject: Subject) -> RunRow | None:
    """Return the green run with the most comparisons of the subject's plan.

    The subject's own comparisons are no measure: a lost one would be reported once, and never
    again.
    """
    outputs = {record.pair: {*record.errors} for record in subject.results.records}
    good = faultless(store)

    def shared_count(row: RunRow) -> int:
        """Return the number of comparisons; outputs removed from a case do not count."""
        there = compared_quantities(store, row.id)
        count = 0
        for pair in subject.pairs & there.keys():
            still = outputs.get(pair)  # empty if the comparison is missing
            count += 1 + sum(not still or output in still for output, _ in there[pair])
        return count

    most = most_compared(store, subject.pairs)
    rows = [row for row in store.runs() if row.id in good and row.id < subject.before]
    return _best(store, rows, subject, most, shared_count)


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
    shared_count = {row.id: len(subject.pairs.intersection(row.plan)) for row in rows}
    return _best(store, rows, subject, shared_count, lambda row: shared_count[row.id])


def _best(
    store: Store,
    rows: Sequence[RunRow],
    subject: Subject,
    most: Mapping[int, int],
    shared_count: Callable[[RunRow], int],
) -> RunRow | None:
    """Return the run that shares the most, the latest of several; None without any.

    Runs with the subject's options come first.

    Args:
        most: bounds of what each run shares; they spare reading most runs.
    """

    def key(row: RunRow, amount: int) -> tuple[bool, int, int]:
        return same_options(row.key, subject.facts), amount, row.id

    best: tuple[tuple[bool, int, int], RunRow] | None = None
    sharing = [(key(row, most[row.id]), row) for row in rows if most.get(row.id)]
    for bound, row in sorted(sharing, key=lambda each: each[0], reverse=True):
        if best and bound < best[0]:
            break
        with store.sparing():
            amount = shared_count(row)
            if amount and (best is None or key(row, amount) > best[0]):
                best = key(row, amount), row
    return best and best[1]


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
                f"{error}; the records before {record.case} {record.engine} are stored as run"
                f" {self.run}"
            )

    def end(self, results: Results, *, interrupted: bool) -> None:
        """End the run, complete or interrupted."""
        if not self.problems:
            try:
                self.store.finish(self.run, results, "interrupted" if interrupted else "finished")
            except HistoryError as error:
                self.problems.append(
                    f"{error}; all records are stored, but run {self.run} has no end; --resume"
                    " gives it one"
                )
        self.store.close()


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
    found = versions(engines, min(settings.get("timeout", PATIENCE), PATIENCE))
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
