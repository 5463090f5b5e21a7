"""Runs of the same selection, and the series of each (case, engine) pair over the runs of a
history, for trends, limits and steps.

`Results.run["selection"]`, the task of a run, holds the names of cases and engines as asked for
(none: all), and the options of solution and judgement. Places of files and limits of processes are
no part of it. Runs of older versions have none: their command line stands for it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path, PurePath
from typing import Any

import msgspec

from ..case.io.atomic_files import write
from ..case.io.table_file import WRITERS, Kind, lack
from ..errors import KincheckError
from ..harness.record import Deviations, Facts, Outcome, Seconds
from .database import OUTCOME
from .store import Pair, RunRow, Store


def same_task(a: Facts, b: Facts) -> bool:
    """Return whether two runs were asked for the same cases and engines with the same options."""
    if a.get("selection") and b.get("selection"):
        return a["selection"] == b["selection"]
    return a.get("command") == b.get("command")


def _of_its_files(later: Facts, earlier: Facts) -> bool:
    """Return whether a run was asked for all case files of an earlier one, as far as both tell:
    another file may have a case of the same name.

    Of two paths one may be the end of the other, as seen from another folder.
    """
    if not (later.get("selection") and earlier.get("selection")):
        return True
    paths = [PurePath(name).parts for name in later["selection"]["cases"]]
    files = (PurePath(name) for name in earlier["selection"]["cases"])
    return all(
        any(path[-len(file.parts) :] == file.parts[-len(path) :] for path in paths)
        for file in files
        if file.suffix or len(file.parts) > 1  # otherwise a built-in name
    )


def same_options(a: Facts, b: Facts) -> bool:
    """Return whether two runs solve and judge alike, as far as both tell their options."""
    ours, theirs = a.get("selection"), b.get("selection")
    return not (ours and theirs) or ours["options"] == theirs["options"]


def series(rows: Iterable[RunRow]) -> list[list[RunRow]]:
    """Return the runs, given from the first to the last, as series of the same thing; of several,
    the one with the earliest run first.

    A run goes on with a series if it was asked for the same as its last run, or has all pairs and
    case files of this run and solves and judges alike.
    """
    found: list[list[RunRow]] = []
    for row in rows:
        going_on = [
            each
            for each in found
            if same_task(row.key, each[-1].key)
            or (
                same_options(row.key, each[-1].key)
                and {*row.plan}.issuperset(each[-1].plan)
                and _of_its_files(row.key, each[-1].key)
            )
        ]
        for other in going_on[1:]:
            going_on[0].extend(other)
            found.remove(other)
        if not going_on:
            found.append([])
        (going_on or found[-1:])[0].append(row)
    return found


def choose_state_run(rows: Sequence[RunRow], good: Collection[int], within: int) -> RunRow | None:
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
    last = {each[-1].id for k, each in enumerate(every) if k == 0 or len(each) > 1}
    counted = [row for row in rows[:within] if row.id in last]
    red = [row for row in counted if row.id not in good]
    return next(iter([*red, *counted, *rows]), None)


NIGHTS = 60
"""Number of runs in trends and steps: two months, whose points remain distinct in a figure."""

IDLE = Outcome.UNAVAILABLE, Outcome.UNSUPPORTED
"""Outcomes of a pair whose engine is missing or does not support the case: they have no results."""


@dataclass(frozen=True)
class Entry:
    """One pair in one run.

    Attributes:
        errors: deviations by output.
        seconds: time of a warm solve without waiting for the processor [s]; None if it was not
            reached.
        us_per_step: see `Record`.
        case: its name in that run.
    """

    run: int
    outcome: Outcome
    version: str | None
    errors: Mapping[str, Deviations]
    seconds: float | None
    us_per_step: float | None
    case: str


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
    before: float = math.inf,
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

    if like is not None:
        present = present_names(like)
    else:
        latest = next(iter(store.runs()), None)
        present = present_names(latest.circumstances if latest else {})

    def wanted(pair: Pair) -> bool:
        name = present.get(pair[0], pair[0])
        return (not cases or name in cases) and (not engines or pair[1] in engines)

    rows = (
        row
        for row in store.runs()
        if row.status != "running"
        and row.id < before
        and (like is None or same_options(row.key, like))
        and (any(map(wanted, row.plan)) or not (cases or engines))
    )
    runs = {row.id: row for row in reversed([*islice(rows, last)])}
    pairs: dict[Pair, list[Entry]] = {}
    for run in runs:
        with store.sparing():
            for pair, entry in entries_of(store, run):
                if wanted(pair):
                    case, engine, mode = pair
                    pairs.setdefault((present.get(case, case), engine, mode), []).append(entry)
    return History({run: row for run, row in runs.items() if run not in store.passed_over}, pairs)


def entries_of(store: Store, run: int) -> list[tuple[Pair, Entry]]:
    """Return the pairs of a run, in the order in which their records were added.

    Raises:
        HistoryError: the file cannot be read.
    """
    columns = (
        f"case_name, engine, mode, {OUTCOME}, version, errors, warm_seconds, waited_seconds,"
        " CASE WHEN us_per_step IS NOT NULL THEN samples END, message, truth"
    )
    query = f"SELECT {columns} FROM records WHERE run_id = ? ORDER BY rowid"
    found: list[tuple[Pair, Entry]] = []
    # unused texts are checked, too: no part of a damaged run counts
    with store.explained("read", run):
        for *pair, outcome, version, text, warm, waited, samples, _, _ in store.connection.execute(
            query, (run,)
        ):
            errors = msgspec.json.decode(text, type=dict[str, Deviations])
            own = Seconds(warm=warm, waited=waited).own
            # runs of older versions keep a time per sample that includes waiting
            per_step = 1e6 * own / samples if own is not None and samples else None
            entry = Entry(run, Outcome(outcome), version, errors, own, per_step, pair[0])
            found.append(((*pair,), entry))
    return found


def faultless(store: Store, rows: Sequence[RunRow]) -> set[int]:
    """Return the numbers of the green ones of the latest runs, complete and with at least one pass
    and no fault, by their outcomes alone: their records are not read.

    Raises:
        HistoryError: the file cannot be read.
    """
    query = (
        "SELECT run_id, count(*) FROM records WHERE run_id >= ? GROUP BY run_id HAVING"
        f" sum(outcome IN ({_BAD})) = 0"
        f" AND sum({OUTCOME} = 'pass') > 0"
    )
    with store.explained("read"):
        first = min((row.id for row in rows), default=0)
        good: dict[int, int] = dict(store.connection.execute(query, (first,)).fetchall())
    # a finished run lacks the pairs of unreadable cases: its status was 2
    return {
        row.id for row in rows if row.status == "finished" and good.get(row.id) == len(row.plan)
    }


def former_names(facts: Facts, case: str) -> tuple[str, ...]:
    """Return the name of a case and its former names, as its file has them; a name that another
    case of the run has now is left out.
    """
    cases: dict[str, Any] = facts.get("cases") or {}
    former: Sequence[str] = cases.get(case, {}).get("formerly", ())
    return (case, *(name for name in former if name not in cases))


def present_names(facts: Facts) -> dict[str, str]:
    """Return the present name of a case by each of its former names."""
    cases: dict[str, Any] = facts.get("cases") or {}
    return {name: case for case in cases for name in former_names(facts, case)[1:]}


def calibration(facts: Facts) -> float | None:
    """Return the seconds of the calibration loop in a run; None if it was not measured."""
    seconds = facts.get("calibration_seconds")
    return seconds if isinstance(seconds, float) and seconds > 0 else None


def unit_of(row: RunRow, case: str, output: str) -> str:
    """Return the unit of an output in a run; metres if the run names none."""
    outputs: Mapping[str, Mapping[str, Any]] = (
        row.circumstances.get("cases", {}).get(case, {}).get("outputs", {})
    )
    return outputs.get(output, {}).get("unit", "m")


_BAD = ", ".join(f"'{outcome}'" for outcome in Outcome if outcome.bad)


INTEGERS = ("run", "solved", "samples", "worst_step")
TRUTHS = ("git_changed", "validated", "within")
PHASES = ("calibration", "build", "first", "warm", "waited", "compare")
NUMBERS = (
    *(f"{phase}_seconds" for phase in PHASES),
    *("us_per_step", "residual_max", "max_abs", "rms", "tolerance"),
)
"""Columns of the view `measured` that are not text. Missing values are null, in CSV empty."""

KINDS = (
    dict.fromkeys(INTEGERS, Kind.INTEGER)
    | dict.fromkeys(NUMBERS, Kind.NUMBER)
    | dict.fromkeys(TRUTHS, Kind.TRUTH)
)

SUFFIXES = (".parquet", ".csv")

ROWS = 10_000  # rows at a time: a few megabytes, and row groups of a usual size


def export(
    store: Store, path: Path, *, cases: Sequence[str] = (), engines: Sequence[str] = ()
) -> int:
    """Write a Parquet or CSV file, by its suffix, and return the number of rows.

    Args:
        cases, engines: only these; empty: all.

    Raises:
        HistoryError: the history cannot be read.
        KincheckError: the file cannot be written, it has another suffix, or pyarrow is not
            installed.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise KincheckError(
            f"--export {path}: ends in {path.suffix or 'nothing'!r}. Give a file that ends in"
            f" {' or '.join(SUFFIXES)}."
        )
    kind = suffix.removeprefix(".")
    if missing := lack(kind, f"--export {path}", "or give a .csv"):
        raise KincheckError(missing)

    def put(part: Path) -> int:
        chunks = _rows(store, cases, engines)
        (names,) = next(chunks)
        columns = {name: KINDS.get(name, Kind.TEXT) for name in names}
        return WRITERS[kind](part, columns, chunks)

    return write("--export", path, put)


def _rows(
    store: Store, cases: Sequence[str], engines: Sequence[str]
) -> Iterator[list[tuple[Any, ...]]]:
    """Yield the names of the columns, then the rows in batches."""
    chosen = [(column, names) for column, names in (("case", cases), ("engine", engines)) if names]
    where = (
        " AND ".join(f'"{column}" IN ({", ".join("?" * len(names))})' for column, names in chosen)
        or "true"
    )
    for row in store.runs():
        with store.sparing():  # a damaged text would end the query
            entries_of(store, row.id)
    now = {row.id: row.status for row in store.runs()}
    with store.explained("read"):
        if store.passed_over:  # the view without unreadable runs
            query = "SELECT sql FROM sqlite_master WHERE name = 'measured'"
            (view,) = store.connection.execute(query).fetchone()
            listed = ", ".join(map(str, store.passed_over))
            spared = view.replace("FROM runs", f"FROM runs WHERE id NOT IN ({listed})", 1)
            store.connection.execute(spared.replace("CREATE VIEW", "CREATE TEMP VIEW", 1))
        values = [name for _, wanted in chosen for name in wanted]
        cursor = store.connection.execute(f"SELECT * FROM measured WHERE {where}", values)
        names = tuple(name for name, *_ in cursor.description)
        yield [names]
        run, status = (names.index(name) for name in ("run", "status"))
        while rows := cursor.fetchmany(ROWS):
            yield [(*row[:status], now[row[run]], *row[status + 1 :]) for row in rows]
