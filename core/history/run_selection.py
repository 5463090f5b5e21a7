"""Selection of the run of a report and of the run compared with: by number, by file, by a rule."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from os.path import exists  # a name too long for a file is no error here
from pathlib import Path
from typing import Any

from ..errors import KincheckError
from ..harness.record import Results
from ..harness.results_file import read_results
from .findings import RunName
from .queries import NIGHTS, alike, compared, faultless, most_compared, standing
from .store import Pair, RunRow, Store

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
        return _stored(store, row)
    rows = [row for row in store.runs() if row.status != "running"]
    row = standing(rows, faultless(store), NIGHTS)
    if row is None:
        raise KincheckError(
            f"history {store.path}: no run to report; `kincheck run --history {store.path}`"
            " records one"
        )
    later = [each.id for each in reversed(rows) if each.id > row.id]
    return replace(_stored(store, row), passed_by=later)


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
                return _stored(store, row, name.replace("-", " ")), ""
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
            f"report: {subject.name} cannot be compared with itself; give another --against"
        )
    return against, ""


def _in_file(file: Path, store: Store | None) -> Subject:
    if not exists(file):
        known = f"a number of the history, a results.json, {LAST_GREEN} or BRANCH{BASELINE}"
        raise KincheckError(f"report: there is no run {str(file)!r}; give {known}")
    results = read_results(file)
    rows, facts = store.runs() if store else [], results.run
    known = tuple(facts.get(key) for key in ("started", "host", "command"))
    same = [row.id for row in rows if (row.started, row.key["host"], row.command) == known]
    later = [row.id for row in rows if row.started > str(facts.get("started", "~"))]
    number = max(same, default=None)
    return Subject(str(file), number, results, number or min(later, default=math.inf))


def _stored(store: Store, row: RunRow, rule: str = "") -> Subject:
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

    def shared(row: RunRow) -> int:
        """Return the number of comparisons; outputs removed from a case do not count."""
        there = compared(store, row.id)
        count = 0
        for pair in subject.pairs & there.keys():
            still = outputs.get(pair)  # empty if the comparison is missing
            count += 1 + sum(not still or output in still for output, _ in there[pair])
        return count

    most = most_compared(store, subject.pairs)
    rows = [row for row in store.runs() if row.id in good and row.id < subject.before]
    return _best(store, rows, subject, most, shared)


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
    return _best(store, rows, subject, shared, lambda row: shared[row.id])


def _best(
    store: Store,
    rows: Sequence[RunRow],
    subject: Subject,
    most: Mapping[int, int],
    shared: Callable[[RunRow], int],
) -> RunRow | None:
    """Return the run that shares the most, the latest of several; None without any.

    Runs with the subject's options come first.

    Args:
        most: bounds of what each run shares; they spare reading most runs.
    """

    def key(row: RunRow, amount: int) -> tuple[bool, int, int]:
        return alike(row.key, subject.facts), amount, row.id

    best: tuple[tuple[bool, int, int], RunRow] | None = None
    sharing = [(key(row, most[row.id]), row) for row in rows if most.get(row.id)]
    for bound, row in sorted(sharing, key=lambda each: each[0], reverse=True):
        if best and bound < best[0]:
            break
        with store.sparing():
            amount = shared(row)
            if amount and (best is None or key(row, amount) > best[0]):
                best = key(row, amount), row
    return best and best[1]
