"""Selection of the run of a report and of the run compared with: by number, by file, by a rule."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from os.path import exists  # a name too long for a file is no error here
from pathlib import Path
from typing import Any

from ..errors import KincheckError
from ..harness.record import Results
from ..harness.results_file import read_results
from .findings import RunName
from .queries import NIGHTS, Pair, alike, compared, faultless, green, standing
from .store import RunRow, Store

LAST_GREEN = "last-green"
BASELINE = "-baseline"


@dataclass(frozen=True)
class Subject:
    """A run to be compared.

    Attributes:
        number: number in the history; None for a run outside it.
        before: runs with smaller numbers are earlier; None if all runs are.
        passed_by: numbers of later runs of something else, which do not change the judgement.
    """

    name: str
    number: int | None
    results: Results
    before: int | None
    passed_by: Sequence[int] = ()

    @property
    def facts(self) -> dict[str, Any]:
        """The circumstances of the run."""
        return self.results.run

    @property
    def label(self) -> RunName:
        """The run's name in a report."""
        git: dict[str, Any] = self.facts.get("git") or {}
        known = {key: str(self.facts.get(key, "unknown")) for key in ("started", "host")}
        return RunName(name=self.name, number=self.number, commit=git.get("commit"), **known)


def find(name: str | None, store: Store | None) -> Subject:
    """Return the run of a number or of a results.json; for None, the run of the history's state,
    see `standing`.

    A killed run counts, too: judging the run before it would hide the fault.

    Raises:
        KincheckError: there is none, or it cannot be read.
    """
    if name is not None and not name.isdecimal():
        return _in_file(Path(name), store)
    if store is None:
        raise KincheckError(
            f"report: {'no run' if name is None else f'run {name}'} without a history; give"
            " --history FILE, or a results.json"
        )
    if name is not None:
        row = store.run(int(name))
        if row.status == "running":
            raise KincheckError(
                f"report: run {row.id} is still running; report it when it has ended"
            )
        return _kept(store, row)
    rows = [row for row in store.runs() if row.status != "running"]
    row = standing(rows, faultless(store, rows), NIGHTS)
    if row is None:
        raise KincheckError(
            f"history {store.path}: no run to report; `kincheck run --history {store.path}`"
            " records one"
        )
    later = [each.id for each in reversed(rows) if each.id > row.id]
    return replace(_kept(store, row), passed_by=later)


def find_against(name: str, subject: Subject, store: Store | None) -> tuple[Subject | None, str]:
    """Return the run to compare with, or the reason why there is none. A named run must exist; a
    run by a rule may not exist yet.

    Raises:
        KincheckError: the named run does not exist, or is the subject itself.
    """
    if name == LAST_GREEN or (name.endswith(BASELINE) and not exists(name)):
        if store is None:
            return None, f"{name} needs a history, and none is given"
        branch = name.removesuffix(BASELINE)
        if name == LAST_GREEN:
            # otherwise a lost comparison would be reported once, and never again
            row = _most(
                green(store, before=subject.before),
                subject,
                lambda row: _compared(store, row, subject),
            )
        else:
            row = _most(
                _of_branch(store, branch, subject),
                subject,
                lambda row: len(pairs_of(subject) & {*row.plan}),
            )
        if row is not None:
            with store.sparing():
                return _kept(store, row, name.replace("-", " ")), ""
            return find_against(name, subject, store)  # the next best
        if name == LAST_GREEN:
            return None, "no earlier green run has any of its pairs"
        known = sorted(
            {
                str(git["branch"])
                for row in store.runs()
                if (git := row.circumstances.get("git")) and git.get("branch")
            }
        )
        return (
            None,
            (
                f"no earlier run of branch {branch!r}, without changes to its files, with any of"
                " its pairs; the history has"
                f" {'branches ' + ', '.join(known) if known else 'no branch'}"
            ),
        )
    against = find(name, store)
    if against.number is not None and against.number == subject.number:
        raise KincheckError(
            f"report: {subject.name} cannot be compared with itself; give another --against"
        )
    return against, ""


def _in_file(file: Path, store: Store | None) -> Subject:
    if not exists(file):
        known = f"a number of the history, a results.json, {LAST_GREEN} or BRANCH{BASELINE}"
        raise KincheckError(f"report: there is no run {str(file)!r}; give {known}")
    results = read_results(file)
    rows, facts = store.runs() if store else [], results.run
    same = [
        row.id
        for row in rows
        if all(
            row.circumstances.get(key) == facts.get(key) for key in ("started", "host", "command")
        )
    ]
    later = [row.id for row in rows if row.started > str(facts.get("started", "~"))]
    return Subject(
        str(file), max(same, default=None), results, max(same, default=min(later, default=None))
    )


def _kept(store: Store, row: RunRow, rule: str = "") -> Subject:
    status = (
        ""
        if row.status == "finished"
        else f", {'without an end' if row.status == 'killed' else row.status}"
    )
    return Subject(
        f"run {row.id}" + (f" ({rule})" if rule else "") + status,
        row.id,
        store.results(row.id),
        row.id,
    )


def _of_branch(store: Store, branch: str, subject: Subject) -> list[RunRow]:
    """Return the finished runs of a branch; runs with uncommitted edits are no baseline."""

    def fits(row: RunRow) -> bool:
        git: dict[str, Any] = row.circumstances.get("git") or {}
        earlier = subject.before is None or row.id < subject.before
        return (
            row.status == "finished"
            and earlier
            and git.get("branch") == branch
            and not git.get("changed")
        )

    return [row for row in store.runs() if fits(row)]


def pairs_of(subject: Subject) -> set[Pair]:
    """Return the planned pairs of a run."""
    return {(record.case, record.engine, record.mode) for record in subject.results.records} | {
        *subject.results.missing
    }


def _compared(store: Store, row: RunRow, subject: Subject) -> int:
    """Return the number of the subject's planned comparisons that a run has; outputs removed from a
    case do not count.
    """
    outputs = {
        (record.case, record.engine, record.mode): {*record.errors}
        for record in subject.results.records
    }
    there = compared(store, row.id)
    shared = 0
    for pair in pairs_of(subject) & there.keys():
        still = outputs.get(pair)  # empty if the comparison is missing
        shared += 1 + sum(not still or output in still for output, _ in there[pair])
    return shared


def _most(rows: list[RunRow], subject: Subject, shared: Callable[[RunRow], int]) -> RunRow | None:
    """Return the run with the most shared comparisons, the latest of several; None without any.

    Runs with the subject's options come first.
    """
    amounts = {row.id: shared(row) for row in rows}
    return max(
        (row for row in rows if amounts[row.id]),
        key=lambda row: (alike(row.circumstances, subject.facts), amounts[row.id], row.id),
        default=None,
    )
