"""Pairs that the last run of the same command had, and a run has not: a case or an engine that went without a word."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..history.store import Store
from .findings import Finding, Kind
from .subject import Subject, pairs_of


def missing(subject: Subject, store: Store | None, told: Sequence[Finding]) -> Iterator[Finding]:
    """Yield the pairs, whatever the subject is compared with: the last run may have had more than the last green one.

    A run of another command was asked for something else, and says nothing.

    Args:
        told: what is said of the subject already.
    """
    earlier = [row for row in store.runs() if subject.before is None or row.id < subject.before] if store else []
    command = subject.facts.get("command")
    last = next((row for row in earlier if row.status != "running" and row.command == command), None)
    if last is None:
        return
    known = pairs_of(subject) | {(each.case, each.engine, each.mode) for each in told if each.kind is Kind.ABSENT}
    for case, engine, mode in last.plan:
        if (case, engine, mode) not in known:
            yield Finding(kind=Kind.ABSENT, case=case, engine=engine, mode=mode, message=f"in run {last.id}, by the same command")
