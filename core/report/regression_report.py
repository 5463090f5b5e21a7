"""Regression report: changes since another run, from both runs and the history around them."""

from __future__ import annotations

import msgspec

from ..harness.record import Outcome
from ..history.queries import NIGHTS, NOTHING, History, read
from ..history.regression.change_points import OUTCOME, TIME, lasting, steps
from ..history.regression.circumstance_changes import changes, same_machine
from ..history.regression.compare import compare, unmade
from ..history.regression.findings import Finding, Kind, Regressions, Step
from ..history.regression.loose_tolerances import loose
from ..history.regression.missing_pairs import missing
from ..history.regression.run_selection import Subject
from ..history.regression.slow_drift import crept
from ..history.regression.solution_changes import differing
from ..history.regression.thresholds import slowest
from ..history.store import Store

RECENT = 20
"""Number of latest runs that give the spread of times on the machine."""


def regressions(
    subject: Subject,
    against: Subject | None,
    reason: str,
    store: Store | None,
    *,
    missing_is_failure: bool = False,
) -> Regressions:
    """Return all changes.

    Args:
        reason: the reason why there is no run to compare with.
        missing_is_failure: whether a pair of an earlier run, missing in this one, is a regression.

    Raises:
        HistoryError: the history cannot be read.
    """
    around = _around(subject, store)
    limit = slowest(_alike(subject, around, before=subject.before))
    every = steps(around)
    standing, over = lasting(every), [each for each in every if each.worse and each.repaired]
    found = unmade(subject)
    if against is not None:
        then = (
            NOTHING
            if against.number is None
            else _alike(subject, around, before=against.number + 1)
        )
        found += compare(subject, against, then, limit)
        found += differing(subject, against)
        found += crept(subject, around, found)
    found += missing(subject, store, found)
    records = subject.results.records
    return Regressions(
        run=subject.label,
        against=against.label if against else None,
        reason=reason,
        pairs=len(records),
        failing=[
            (record.case, record.engine, record.mode) for record in records if record.outcome.bad
        ],
        unjudged=[
            (record.case, record.engine, record.mode)
            for record in records
            if record.outcome is Outcome.UNJUDGED
        ],
        unread=[*subject.results.unread],
        passed_by=[*subject.passed_by],
        time_limit=limit,
        missing_is_failure=missing_is_failure,
        findings=[_since(finding, standing) for finding in found],
        changes=changes(subject.facts, against.facts) if against else [],
        steps=standing + over,
        loose=loose(around, subject.facts.get("cases", {})),
    )


def _around(subject: Subject, store: Store | None) -> History:
    """Return the runs up to the subject that solve and judge as it, including the subject if the
    history has it.
    """
    if store is None:
        return NOTHING
    cases = list(dict.fromkeys(record.case for record in subject.results.records))
    before = subject.before if subject.number is None else subject.number + 1
    return read(store, before=before, last=NIGHTS, cases=cases, like=subject.facts)


def _alike(subject: Subject, around: History, *, before: int | None) -> History:
    """Return the latest runs before a number on the subject's machine."""
    runs = {
        number: row
        for number, row in around.runs.items()
        if (before is None or number < before) and same_machine(row.circumstances, subject.facts)
    }
    runs = dict([*runs.items()][-RECENT:])
    pairs = {
        pair: [entry for entry in entries if entry.run in runs]
        for pair, entries in around.pairs.items()
    }
    return History(runs, pairs)


def _since(finding: Finding, standing: list[Step]) -> Finding:
    """Return the finding with its first run, if a step gives one."""
    quantity = {Kind.SLOWER: TIME, Kind.FAILURE: OUTCOME, Kind.DRIFTED: finding.motion}.get(
        finding.kind
    )
    about = (
        finding.case,
        finding.engine,
        finding.mode,
        quantity,
        finding.output if finding.kind is Kind.DRIFTED else None,
    )
    for step in standing:
        if (step.case, step.engine, step.mode, step.quantity, step.output) == about:
            return msgspec.structs.replace(finding, since=step.first)
    return finding
