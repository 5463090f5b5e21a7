"""Pairs of the last run of the same command that a run lacks: a case or an engine left out in
silence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..store import RunRow, Store
from .findings import Finding, Kind
from .run_selection import Subject, pairs_of


def missing(
    subject: Subject, store: Store | None, findings: Sequence[Finding]
) -> Iterator[Finding]:
    """Yield the missing pairs, whatever run is compared with: the last run may have more pairs than
    the last green one.

    A run of another command has another task and does not count.

    Args:
        findings: the findings on the subject so far.
    """
    last = _last(subject, store) if store else None
    if last is None:
        return
    known = pairs_of(subject) | {
        (each.case, each.engine, each.mode) for each in findings if each.kind is Kind.ABSENT
    }
    for case, engine, mode in last.plan:
        if (case, engine, mode) not in known:
            yield Finding(
                kind=Kind.ABSENT,
                case=case,
                engine=engine,
                mode=mode,
                message=f"in run {last.id}, by the same command",
            )


def _last(subject: Subject, store: Store) -> RunRow | None:
    """Return the last earlier finished run of the subject's command."""
    query = "SELECT id FROM runs WHERE command = ? AND (? IS NULL OR id < ?) ORDER BY id DESC"
    with store.explained("read"):
        numbers = store.connection.execute(
            query, (subject.facts.get("command"), subject.before, subject.before)
        ).fetchall()
    for (number,) in numbers:
        with store.sparing():  # a damaged run is skipped, and named at the end
            if (row := store.run(number)).status != "running":
                return row
    return None
