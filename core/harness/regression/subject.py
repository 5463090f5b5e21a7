"""The run that a report is about, and the one it is compared with: by number, by file, by a rule."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...errors import KincheckError
from ..history.series import NIGHTS, Pair, green, present
from ..history.store import RunRow, Store
from ..reading.results import read_results
from ..record import Results
from .findings import RunName

LAST_GREEN = "last-green"
BASELINE = "-baseline"


@dataclass(frozen=True)
class Subject:
    """A run to be compared.

    Attributes:
        number: in the history; None for one from a file.
    """

    name: str
    number: int | None
    results: Results

    @property
    def facts(self) -> dict[str, Any]:
        """The circumstances."""
        return self.results.run

    @property
    def label(self) -> RunName:
        """As a report has it."""
        git: dict[str, Any] = self.facts.get("git") or {}
        known = {key: str(self.facts.get(key, "unknown")) for key in ("started", "host")}
        return RunName(name=self.name, number=self.number, commit=git.get("commit"), **known)


def find(name: str | None, store: Store | None) -> Subject:
    """The run of that number, or in that results.json; None: the latest of the history that nobody is writing now.

    That may be one without an end, which was killed: to judge the one before it would be to say that all is well.

    Raises:
        KincheckError: there is none, or it cannot be read.
    """
    if name is not None and not name.isdecimal():
        return _in_file(Path(name))
    if store is None:
        raise KincheckError(
            f"report: {'no run' if name is None else f'run {name}'} without a history; give --history FILE, or a results.json"
        )
    if name is not None:
        return _kept(store, store.run(int(name)))
    row = next((row for row in store.runs() if not store.at_work(row.id)), None)
    if row is None:
        raise KincheckError(f"history {store.path}: no run to report; `kincheck run --history {store.path}` makes one")
    return _kept(store, row)


def find_against(name: str, subject: Subject, store: Store | None) -> tuple[Subject | None, str]:
    """The run to compare with, or why there is none. One that is named must be there; one by a rule need not yet.

    Raises:
        KincheckError: the one named is not there, or it is the subject itself.
    """
    if name == LAST_GREEN or (name.endswith(BASELINE) and not Path(name).exists()):
        if store is None:
            return None, f"{name} is found in a history, and there is none"
        branch = name.removesuffix(BASELINE)
        if name == LAST_GREEN:
            # with engines that were there: one that is gone since would be told of once, and never again
            row = _most_alike(green(store, before=subject.number)[:NIGHTS], subject, lambda row: present(store, row.id))
        else:
            row = _most_alike(_of_branch(store, branch, subject), subject, lambda row: {*row.plan})
        if row is not None:
            return _kept(store, row, name.replace("-", " ")), ""
        if name == LAST_GREEN:
            return None, "no earlier run in which nothing went wrong with any of its pairs"
        known = sorted({str(git["branch"]) for row in store.runs() if (git := row.circumstances.get("git")) and git.get("branch")})
        return None, (
            f"no earlier run of branch {branch!r}, without changes to its files, with any of its pairs; "
            f"the history has {'branches ' + ', '.join(known) if known else 'no branch'}"
        )
    against = find(name, store)
    if against.number is not None and against.number == subject.number:
        raise KincheckError(f"report: {subject.name} cannot be compared with itself; give another --against")
    return against, ""


def _in_file(file: Path) -> Subject:
    if not file.exists():
        known = f"a number of the history, a results.json, {LAST_GREEN} or BRANCH{BASELINE}"
        raise KincheckError(f"report: there is no run {str(file)!r}; give {known}")
    return Subject(str(file), None, read_results(file))


def _kept(store: Store, row: RunRow, rule: str = "") -> Subject:
    status = "" if row.status == "finished" else f", {'without an end' if row.status == 'running' else row.status}"
    return Subject(f"run {row.id}" + (f" ({rule})" if rule else "") + status, row.id, store.results(row.id))


def _of_branch(store: Store, branch: str, subject: Subject) -> list[RunRow]:
    """Finished runs of a branch, as it was committed: an edit under way is no baseline."""

    def fits(row: RunRow) -> bool:
        git: dict[str, Any] = row.circumstances.get("git") or {}
        earlier = subject.number is None or row.id < subject.number
        return row.status == "finished" and earlier and git.get("branch") == branch and not git.get("changed")

    return [row for row in store.runs() if fits(row)]


def _most_alike(rows: list[RunRow], subject: Subject, there: Callable[[RunRow], set[Pair]]) -> RunRow | None:
    """The run that has most of the subject's pairs, the latest of several; None where none has any."""
    pairs = {(record.case, record.engine, record.mode) for record in subject.results.records} | {*subject.results.missing}
    shared: Callable[[RunRow], int] = lambda row: len(pairs & there(row))  # noqa: E731
    best = max(rows, key=lambda row: (shared(row), row.id), default=None)
    return best if best is not None and shared(best) else None
