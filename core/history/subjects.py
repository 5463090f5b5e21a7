"""Subjects of a comparison: a run with the states of its pairs, and their baselines as one run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..harness.provenance import versions
from ..harness.record import Record, Results
from .findings import RunName
from .queries import entries_of
from .states import State, base_record, base_reference, state_before
from .store import Pair, Store


@dataclass(frozen=True)
class Subject:
    """A run to be compared.

    Attributes:
        number: number in the history; None for a run outside it.
        before: runs with smaller numbers are earlier; infinite if all runs are.
        passed_by: numbers of later runs of something else, which do not change the judgement.
        states: states of its pairs before it.
        bases: of a baseline, the run of each pair; empty for one run.
    """

    name: str
    number: int | None
    results: Results
    before: float
    passed_by: Sequence[int] = ()
    states: Mapping[Pair, State] = field(default_factory=dict[Pair, State])
    bases: Mapping[Pair, int] = field(default_factory=dict[Pair, int])

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


def with_states(subject: Subject, store: Store) -> Subject:
    """Return a run with the states of its pairs before it.

    Raises:
        HistoryError: the file cannot be read.
    """
    before = (
        (pair, state_before(store, pair, subject.before, subject.facts)) for pair in subject.pairs
    )
    return replace(subject, states={pair: state for pair, state in before if state is not None})


def last_good(subject: Subject, store: Store) -> Subject:
    """Return the baselines of all pairs of a run, each from its own run, as one.

    Its circumstances are those of the latest of these runs. Pairs without a baseline are left out.

    Raises:
        HistoryError: the file cannot be read.
    """
    facts = subject.facts
    records = dict[Pair, Record]()
    cases = dict[str, int]()
    bases = dict[Pair, int]()
    whole_runs = dict[int, bool]()
    for record in subject.results.records:
        state = subject.states.get(record.pair)
        while state is not None and (run := state.base) is not None:
            if run not in whole_runs:
                whole_runs[run] = _is_whole(store, run)
            with store.sparing():
                base = whole_runs[run] and base_record(store, run, record.pair, facts)
                if base:
                    records[record.pair], bases[record.pair] = base, run
                    cases[record.case] = max(run, cases.get(record.case, 0))
                    break
            state = state_before(store, record.pair, run, facts)  # the run is damaged
    first, latest = (each(bases.values(), default=0) for each in (min, max))
    name = (
        f"run {latest} (last green)"
        if first == latest
        else f"the last good run of each pair (runs {first} to {latest})"
    )
    known = {
        case: found
        for case, run in cases.items()
        if (found := base_reference(store, run, case, facts))
    }
    whole = Results(
        run=store.run(latest).circumstances | {"engines": versions([*records.values()])}
        if bases
        else {},
        records=[*records.values()],
        references=known,
    )
    return Subject(name, latest, whole, latest, bases=bases)


def _is_whole(store: Store, run: int) -> bool:
    """Return whether a run can be read."""
    with store.sparing():
        store.run(run)
        entries_of(store, run)
        return True
    return False
