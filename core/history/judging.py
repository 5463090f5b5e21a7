"""Judging of each run of a history when it ends: the states of its pairs, and their acceptance."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from getpass import getuser

from ..errors import KincheckError, unknown
from ..harness.provenance import readable
from ..harness.record import Facts, Results
from .comparison import compare, time_limit
from .findings import Accepted, Finding
from .queries import NOTHING
from .states import State, accepted_in, next_state, put_state
from .steps import with_crept
from .store import HistoryError, Pair, Store, alive, now
from .subjects import Subject, last_good, with_states

CAUGHT_UP = 120
"""Largest number of runs judged at once, the latest ones: four months. A history from before states
were stored has more.
"""


def judge_runs(store: Store) -> None:
    """Store the states of all ended runs without any, in their order. If a run ended late, all
    later runs are judged again.

    The states are the only thing that a store writes although it is open for reading; for a file
    that is damaged or cannot be written, they are kept in a temporary table.

    Raises:
        HistoryError: the file cannot be read or written.
    """
    unjudged = _unjudged(store)
    if not unjudged:
        return
    if not store.writable:
        with suppress(HistoryError):
            store.require_sound(0)
            with Store(store.path) as other:
                judge_runs(other)
                store.passed_over |= other.passed_over
        unjudged = _unjudged(store)
        if not unjudged:
            return
    with store.transaction():
        if not store.writable:
            store.connection.execute("CREATE TEMP TABLE states AS SELECT * FROM main.states")
            store.connection.execute(
                "CREATE INDEX temp.states_of_a_pair ON states (case_name, engine, mode, run_id)"
            )
        store.connection.execute("DELETE FROM states WHERE run_id > ?", (unjudged[0],))
        unjudged = _unjudged(store)
        for run in unjudged[:-CAUGHT_UP]:
            put_state(store, NO_PAIR, State(run=run, begun=run, base=None), {})
    for run in unjudged[-CAUGHT_UP:]:
        facts, found = {}, dict[Pair, State]()
        with store.sparing():
            facts = store.run(run).circumstances
            found = _judge(store, run, facts)
        with store.transaction():
            for pair, state in (found or {NO_PAIR: State(run=run, begun=run, base=None)}).items():
                put_state(store, pair, state, facts)


NO_PAIR = ("", "", "")
"""Of the state of a run without readable records, which is not judged a second time."""


def _unjudged(store: Store) -> list[int]:
    """Return the ended runs without states, the earliest first."""
    query = "SELECT id, status, owner FROM runs WHERE id NOT IN (SELECT run_id FROM states)"
    with store.explained("read"):
        rows = store.connection.execute(f"{query} ORDER BY id").fetchall()
    return [run for run, status, owner in rows if status != "running" or not alive(owner)]


def _judge(store: Store, run: int, facts: Facts) -> dict[Pair, State]:
    """Return the states of a run's pairs after it."""
    records = store.records(run)
    subject = with_states(Subject("", run, Results(run={**facts}, records=records), run), store)
    base = last_good(subject, store)
    found = with_crept(subject, compare(subject, base, NOTHING, time_limit(subject)))
    worse: dict[Pair, list[Finding]] = {}
    for finding in found:
        if finding.kind.regression:
            worse.setdefault(finding.pair, []).append(finding)
    accepted = accepted_in(store, run)
    return {
        record.pair: next_state(
            record,
            run,
            subject.states.get(record.pair),
            worse.get(record.pair, ()),
            accepted=record.pair in accepted,
        )
        for record in records
    }


def accept(store: Store, names: Sequence[str], reason: str) -> list[Accepted]:
    """Accept what is worse in the last runs of pairs: these runs become their baselines.

    Args:
        names: CASE:ENGINE each; every mode of the engine that is worse is accepted.

    Raises:
        KincheckError: there is no such pair, or it is not worse.
        HistoryError: the file cannot be read or written.
    """
    judge_runs(store)
    found = [row for name in names for row in _worse(store, name)]
    with store.transaction():
        for run, *pair, what in found:
            store.connection.execute(
                "INSERT OR REPLACE INTO accepted VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
                (run, *pair, _user(), now(), what, reason),
            )
        if found:
            first = min(run for run, *_ in found)
            store.connection.execute("DELETE FROM states WHERE run_id >= ?", (first,))
    judge_runs(store)
    return [accepted_in(store, run)[case, engine, mode] for run, case, engine, mode, _ in found]


def _worse(store: Store, name: str) -> list[tuple[int, str, str, str, str]]:
    """Return run, case, engine, mode and what is worse of the pairs of a name."""
    case, _, engine = name.rpartition(":")
    query = (
        "SELECT max(run_id), case_name, engine, mode, open FROM states WHERE case_name = ? AND"
        " engine = ? GROUP BY mode, options"
    )
    with store.explained("read"):
        rows = store.connection.execute(query, (case, engine)).fetchall()
        if not rows:
            pairs = "SELECT DISTINCT case_name || ':' || engine FROM states WHERE engine != ''"
            known = sorted(pair for (pair,) in store.connection.execute(pairs))
            raise KincheckError(f"--accept {name}: {unknown('CASE:ENGINE', name, known)}")
    worse = [row for row in rows if row[-1] != "[]"]
    if not worse:
        last = max(run for run, *_ in rows)
        raise KincheckError(
            f"--accept {name}: it is no worse than its baseline in its last run, {last}. There is"
            " nothing to accept."
        )
    return worse


def _user() -> str:
    """Return the name of the user; "unknown" if the system has none."""
    try:
        return readable(getuser())
    except (KeyError, OSError):
        return "unknown"
