"""States: how each pair (case, engine, mode) of a history does, after each of its runs.

A pair is good, or worse since a run until it is good again or accepted. Its baseline is the last
run that was no worse than its own baseline, or the accepted run. So a baseline is never worse.

Runs with other options of solution or judgement have other states. A case with a new name goes on
with the states of its `formerly` names.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence, Set
from typing import Any

import msgspec

from ..harness.record import (
    Deviations,
    Facts,
    Outcome,
    OutputSeries,
    Record,
    Seconds,
    update_outcome,
)
from .findings import Accepted, Finding, Kind
from .queries import calibration, former_names, present_names
from .store import Pair, RunRow, Store

RECENT = 20
"""Number of latest runs that give the spread of times on the machine."""

LATEST = 2**62
"""A number above those of all runs."""


class Open(msgspec.Struct, frozen=True, array_like=True):
    """What is worse, and since which run."""

    kind: Kind
    output: str | None
    motion: str | None
    since: int


class Level(msgspec.Struct, frozen=True, array_like=True):
    """The least error that two successive runs met, from which a slow drift is measured.

    One run alone may meet zero by chance.

    Attributes:
        run: the run of this error.
        last: the error of the last run.
    """

    run: int
    error: float
    last: float
    tolerance: float
    against: str


class Time(msgspec.Struct, frozen=True):
    """A warm solve [s] and the calibration loop [s] of its run."""

    seconds: float
    loop: float | None
    slower: bool


Levels = dict[str, dict[str, Level]]


class State(msgspec.Struct, frozen=True, kw_only=True):
    """The state of a pair after a run.

    Attributes:
        begun: the first run of the series, or the last accepted one.
        base: the baseline of the next run; None if none was good yet.
        times: of earlier runs on the machine of the next run, the oldest first.
    """

    run: int
    begun: int
    base: int | None
    open: tuple[Open, ...] = ()
    levels: Levels = {}
    times: tuple[Time, ...] = ()

    def since(self, finding: Finding) -> int | None:
        """Return the first run of a finding; None if it is new."""
        about = (finding.kind, finding.output, finding.motion)
        found = (each.since for each in self.open if (each.kind, each.output, each.motion) == about)
        return next(found, None)


def options_of(facts: Facts) -> str:
    """Return the options of solution and judgement of a run as a text; empty if it has none."""
    selection = facts.get("selection")
    return msgspec.json.encode(selection["options"], order="sorted").decode() if selection else ""


def state_before(store: Store, pair: Pair, run: float, facts: Facts) -> State | None:
    """Return the last state of a pair before a run, with the times on the run's machine.

    Args:
        facts: circumstances of the run.

    Raises:
        HistoryError: the file cannot be read.
    """
    case, engine, mode = pair
    names = former_names(facts, case)
    options, before = options_of(facts), int(min(run, LATEST))
    where = (
        f"states.case_name IN ({', '.join('?' * len(names))}) AND states.engine = ? AND"
        " states.mode = ? AND states.run_id < ? AND (options = ? OR '' IN (options, ?))"
    )
    values = (*names, engine, mode, before, options, options)
    query = (
        f"SELECT run_id, begun, base_run, open, levels FROM states WHERE {where} ORDER BY run_id"
        " DESC LIMIT 1"
    )
    timed = (
        "SELECT warm_seconds, waited_seconds, loop, open FROM states JOIN records USING (run_id,"
        f" case_name, engine, mode) WHERE {where} AND run_id >= ? AND machine = ? AND warm_seconds"
        f" IS NOT NULL ORDER BY run_id DESC LIMIT {RECENT}"
    )
    with store.explained("read"):
        row = store.connection.execute(query, values).fetchone()
        if row is None:
            return None
        number, begun, base, worse, levels = row
        machine = str(facts.get("processor"))
        times = [
            Time(own, loop, f'"{Kind.SLOWER}"' in text)
            for warm, waited, loop, text in store.connection.execute(
                timed, (*values, begun, machine)
            )
            if (own := Seconds(warm=warm, waited=waited).own)
        ]
        return State(
            run=number,
            begun=begun,
            base=base,
            open=msgspec.json.decode(worse, type=tuple[Open, ...]),
            levels=msgspec.json.decode(levels, type=Levels),
            times=tuple(reversed(times)),
        )


def vanished(
    store: Store, last: RunRow | None, facts: Facts, pairs: Set[Pair]
) -> dict[Pair, State]:
    """Return the states of pairs that are worse in a run and not in a later one: they are worse
    until they are good again or accepted.

    Args:
        last: the last run of the same selection.
        facts, pairs: circumstances and pairs of the later run.

    Raises:
        HistoryError: the file cannot be read.
    """
    present = present_names(facts)
    query = (
        "SELECT case_name, engine, mode, begun, base_run, open, levels FROM states WHERE run_id = ?"
        " AND open != '[]'"
    )
    found: dict[Pair, State] = {}
    with store.explained("read"):
        rows = store.connection.execute(query, (last.id,)).fetchall() if last else ()
        for name, engine, mode, begun, base, worse, levels in rows:
            if (present.get(name, name), engine, mode) not in pairs:
                found[name, engine, mode] = State(
                    run=last.id if last else 0,
                    begun=begun,
                    base=base,
                    open=msgspec.json.decode(worse, type=tuple[Open, ...]),
                    levels=msgspec.json.decode(levels, type=Levels),
                )
    return found


def base_record(store: Store, run: int, pair: Pair, facts: Facts) -> Record | None:
    """Return the record of a pair in an earlier run under its present name; None if it was removed.

    Raises:
        HistoryError: the file cannot be read.
    """
    for name in former_names(facts, pair[0]):
        query = "SELECT record FROM records WHERE (run_id, case_name, engine, mode) = (?, ?, ?, ?)"
        with store.explained("read", run):
            row = store.connection.execute(query, (run, name, *pair[1:])).fetchone()
            if row is not None:
                record = msgspec.json.decode(zlib.decompress(row[0]), type=Record)
                return msgspec.structs.replace(update_outcome(record), case=pair[0])
    return None


def base_reference(store: Store, run: int, case: str, facts: Facts) -> dict[str, OutputSeries]:
    """Return the reference values of a case in an earlier run; empty without any.

    Raises:
        HistoryError: the file cannot be read.
    """
    query = (
        "SELECT content FROM attachments JOIN documents USING (digest) WHERE (run_id, kind,"
        " case_name) = (?, 'references', ?)"
    )
    for name in former_names(facts, case):
        with store.explained("read", run):
            row = store.connection.execute(query, (run, name)).fetchone()
            if row is not None:
                return msgspec.json.decode(zlib.decompress(row[0]), type=dict[str, OutputSeries])
    return {}


def next_state(
    record: Record, run: int, last: State | None, worse: Sequence[Finding], *, accepted: bool
) -> State:
    """Return the state of a pair after a run.

    Args:
        worse: the regressions of the record against the baseline of the last state.
        accepted: whether a person has accepted the run.
    """
    if last is None or accepted:
        levels = _next_levels(record.errors, run, {})
        good = accepted or not worse
        return State(
            run=run,
            begun=run,
            base=run if good else None,
            open=() if good else tuple(_opened(worse, run, None)),
            levels=levels,
        )
    opened = dict.fromkeys(_opened(worse, run, last))
    if worse and record.outcome is not Outcome.PASS:  # it may hide what was worse before
        found = {(each.kind, each.output, each.motion) for each in opened}
        opened |= dict.fromkeys(
            each for each in last.open if (each.kind, each.output, each.motion) not in found
        )
    return State(
        run=run,
        begun=last.begun,
        base=last.base if opened else run,
        open=tuple(opened),
        levels=_next_levels(record.errors, run, last.levels),
    )


def _opened(worse: Sequence[Finding], run: int, last: State | None) -> list[Open]:
    return [
        Open(each.kind, each.output, each.motion, (last and last.since(each)) or run)
        for each in worse
    ]


def _next_levels(errors: dict[str, Deviations], run: int, before: Levels) -> Levels:
    found: Levels = {output: dict(each) for output, each in before.items()}
    for output, deviations in errors.items():
        for motion, now in deviations.items():
            if not now.within:
                continue
            old = found.setdefault(output, {}).get(motion)
            level = Level(run, now.max_abs, now.max_abs, now.tolerance, now.against)
            if old is not None and (old.tolerance, old.against) == (now.tolerance, now.against):
                met = max(old.last, now.max_abs)
                first = (old.run, old.error) if old.error <= met else (run, met)
                level = Level(*first, now.max_abs, now.tolerance, now.against)
            found[output][motion] = level
    return found


def put_state(store: Store, pair: Pair, state: State, facts: Facts) -> None:
    """Store a state; `store` has an open transaction."""
    row = (state.run, *pair, options_of(facts), str(facts.get("processor")), calibration(facts))
    row += (state.begun, state.base, _json(state.open), _json(state.levels))
    places = ", ".join("?" * len(row))
    store.connection.execute(f"INSERT OR REPLACE INTO states VALUES ({places})", row)


def accepted_in(store: Store, run: int) -> dict[Pair, Accepted]:
    """Return what was accepted in a run.

    Raises:
        HistoryError: the file cannot be read.
    """
    query = "SELECT case_name, engine, mode, who, made, what, reason FROM accepted WHERE run_id = ?"
    with store.explained("read"):
        return {
            (case, engine, mode): Accepted(
                case=case,
                engine=engine,
                mode=mode,
                run=run,
                who=who,
                made=made,
                what=[each.kind for each in msgspec.json.decode(what, type=list[Open])],
                reason=reason,
            )
            for case, engine, mode, who, made, what, reason in store.connection.execute(
                query, (run,)
            )
        }


def _json(value: Any) -> str:
    return msgspec.json.encode(value).decode()
