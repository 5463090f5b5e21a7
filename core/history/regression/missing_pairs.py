"""Missing pairs of the last run of the same selection: a case or an engine left out in
silence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ..selection import same
from ..store import RunRow, Store
from .findings import Finding, Kind
from .run_selection import Subject, pairs_of


def missing(
    subject: Subject, store: Store | None, findings: Sequence[Finding]
) -> Iterator[Finding]:
    """Yield the missing pairs, whatever run is compared with: the last run may have more pairs than
    the last green one.

    A run of another selection has another task and does not count.

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
    """Return the last earlier run of the subject's selection."""
    return next(
        (
            row
            for row in store.runs()
            if row.status != "running"
            and (subject.before is None or row.id < subject.before)
            and same(row.circumstances, subject.facts)
        ),
        None,
    )
