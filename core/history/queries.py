"""Runs of the same selection, and the series of each (case, engine) pair over the runs of a
history, for trends, limits and steps.

`Results.run["selection"]`, the task of a run, holds the names of cases and engines as asked for
(none: all), and the options of solution and judgement. Places of files and limits of processes are
no part of it. Runs of older versions have none: their command line stands for it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import msgspec

from ..harness.record import Deviations, Outcome, Seconds
from .schema import OUTCOME
from .store import RunRow, Store

Facts = Mapping[str, Any]
"""Circumstances of a run, as `Results.run`."""


def same(a: Facts, b: Facts) -> bool:
    """Return whether two runs were asked for the same cases and engines with the same options."""
    if a.get("selection") and b.get("selection"):
        return a["selection"] == b["selection"]
    return a.get("command") == b.get("command")


def alike(a: Facts, b: Facts) -> bool:
    """Return whether two runs solve and judge alike, as far as both tell their options."""
    ours, theirs = a.get("selection"), b.get("selection")
    return not (ours and theirs) or ours["options"] == theirs["options"]


def series(rows: Iterable[RunRow]) -> list[list[RunRow]]:
    """Return the runs, given from the first to the last, as series of the same thing; of several,
    the one with the earliest run first.

    A run goes on with a series if it was asked for the same as its last run, or has all pairs of
    this run and solves and judges alike.
    """
    found: list[list[RunRow]] = []
    for row in rows:
        pairs, facts = {*row.plan}, row.circumstances
        going_on = [
            each
            for each in found
            if same(facts, each[-1].circumstances)
            or (alike(facts, each[-1].circumstances) and pairs.issuperset(each[-1].plan))
        ]
        for other in going_on[1:]:
            going_on[0].extend(other)
            found.remove(other)
        if not going_on:
            found.append([])
        (going_on or found[-1:])[0].append(row)
    return found


def standing(rows: Sequence[RunRow], good: Collection[int], within: int) -> RunRow | None:
    """Return the run for the state of a history: red until the same thing is green.

    It is the latest red run at the end of a series; without one, the latest run. The series with
    the first run of the history counts, and every other from its second run on: a run of something
    else, once, changes nothing.

    Args:
        rows: ended runs, the latest first.
        good: numbers of the green runs.
        within: number of latest runs in which a run counts.
    """
    every = series(reversed(rows))
    last = [each[-1] for k, each in enumerate(every) if k == 0 or len(each) > 1]
    recent = {row.id for row in rows[:within]}
    counted = sorted((row for row in last if row.id in recent), key=lambda row: -row.id)
    red = [row for row in counted if row.id not in good]
    return next(iter([*red, *counted, *rows]), None)


NIGHTS = 60
"""Number of runs in trends and steps: two months, whose points remain distinct in a figure."""

IDLE = Outcome.UNAVAILABLE, Outcome.UNSUPPORTED
"""Outcomes of a pair whose engine is missing or does not support the case: they have no results."""

Pair: TypeAlias = tuple[str, str, str]
"""Case, engine and mode."""


@dataclass(frozen=True)
class Entry:
    """One pair in one run.

    Attributes:
        errors: deviations by output.
        seconds: time of a warm solve without waiting for the processor [s]; None if it was not
            reached.
        us_per_step: see `Record`.
    """

    run: int
    outcome: Outcome
    version: str | None
    errors: Mapping[str, Deviations]
    seconds: float | None
    us_per_step: float | None


@dataclass(frozen=True)
class History:
    """Finished runs of a history and the entries of their pairs, the oldest first."""

    runs: Mapping[int, RunRow]
    pairs: Mapping[Pair, Sequence[Entry]]


NOTHING = History({}, {})
"""No history."""


def read(
    store: Store,
    *,
    before: int | None = None,
    last: int | None = None,
    cases: Sequence[str] = (),
    engines: Sequence[str] = (),
    like: Facts | None = None,
) -> History:
    """Return the runs and entries of a history.

    Args:
        before: only runs with smaller numbers.
        last: largest number of runs, the latest ones.
        cases, engines: only these; empty: all.
        like: circumstances of a run; only runs that solve and judge alike.

    Raises:
        HistoryError: the file cannot be read.
    """
    rows = [
        row
        for row in store.runs()
        if row.status != "running"
        and (before is None or row.id < before)
        and (like is None or alike(row.circumstances, like))
    ]
    if cases or engines:
        rows = [row for row in rows if any(_wanted(pair, cases, engines) for pair in row.plan)]
    runs = {row.id: row for row in reversed(rows[:last])}
    pairs: dict[Pair, list[Entry]] = {}
    for run in [*runs]:
        with store.sparing():
            for pair, entry in _entries(store, run):
                if _wanted(pair, cases, engines):
                    pairs.setdefault(pair, []).append(entry)
    return History({run: row for run, row in runs.items() if run not in store.passed_over}, pairs)


def readable(store: Store) -> list[RunRow]:
    """Return the runs whose facts and columns of records are readable, the latest first; skip the
    others.

    Raises:
        HistoryError: the file cannot be read.
    """
    rows = store.runs()
    for row in rows:
        with store.sparing():
            _entries(store, row.id)
    return [row for row in rows if row.id not in store.passed_over]


def _wanted(pair: Pair, cases: Sequence[str], engines: Sequence[str]) -> bool:
    return (not cases or pair[0] in cases) and (not engines or pair[1] in engines)


def _entries(store: Store, run: int) -> list[tuple[Pair, Entry]]:
    columns = (
        f"case_name, engine, mode, {OUTCOME}, version, errors, warm_seconds, waited_seconds,"
        " CASE WHEN us_per_step IS NOT NULL THEN samples END, message, truth"
    )
    found: list[tuple[Pair, Entry]] = []
    # unused texts are checked, too: no part of a damaged run counts
    with store.explained("read", run):
        # rowid gives the order in which the records were added
        for row in store.connection.execute(
            f"SELECT {columns} FROM records WHERE run_id = ? ORDER BY rowid", (run,)
        ):
            errors = msgspec.json.decode(row[5], type=dict[str, Deviations])
            own, samples = Seconds(warm=row[6], waited=row[7]).own, row[8]
            # runs of older versions keep a time per sample that includes waiting
            per_step = 1e6 * own / samples if own is not None and samples else None
            entry = Entry(run, Outcome(row[3]), row[4], errors, own, per_step)
            found.append(((row[0], row[1], row[2]), entry))
    return found


def green(store: Store, *, before: int | None = None) -> list[RunRow]:
    """Return the complete runs with at least one pass and no fault, the latest first.

    Raises:
        HistoryError: the file cannot be read.
    """
    good = faultless(store, store.runs())
    return [
        row for row in readable(store) if row.id in good and (before is None or row.id < before)
    ]


def faultless(store: Store, rows: Sequence[RunRow]) -> set[int]:
    """Return the numbers of the green runs, by their outcomes alone: their records are not read."""
    bad = ", ".join(f"'{outcome}'" for outcome in Outcome if outcome.bad)
    query = (
        f"SELECT run_id, count(*) FROM records GROUP BY run_id HAVING sum(outcome IN ({bad})) = 0"
        f" AND sum({OUTCOME} = 'pass') > 0"
    )
    with store.explained("read"):
        good: dict[int, int] = dict(store.connection.execute(query).fetchall())
    # a finished run lacks the pairs of unreadable cases: its status was 2
    return {
        row.id for row in rows if row.status == "finished" and good.get(row.id) == len(row.plan)
    }


def compared(store: Store, run: int) -> dict[Pair, set[tuple[str, str]]]:
    """Return the compared outputs and motions of a run's pairs whose engine was installed and able.

    Raises:
        HistoryError: the file cannot be read.
    """
    able = (
        (pair, entry.errors) for pair, entry in _entries(store, run) if entry.outcome not in IDLE
    )
    return {
        pair: {(output, motion) for output, each in errors.items() for motion, _ in each.items()}
        for pair, errors in able
    }


def calibration(run: RunRow | Mapping[str, Any]) -> float | None:
    """Return the seconds of the calibration loop in a run; None if it was not measured."""
    facts = run.circumstances if isinstance(run, RunRow) else run
    seconds = facts.get("calibration_seconds")
    return seconds if isinstance(seconds, float) and seconds > 0 else None


def unit_of(row: RunRow, case: str, output: str) -> str:
    """Return the unit of an output in a run; metres if the run names none."""
    outputs: Mapping[str, Mapping[str, Any]] = (
        row.circumstances.get("cases", {}).get(case, {}).get("outputs", {})
    )
    return outputs.get(output, {}).get("unit", "m")
