"""Selections: the task of a run, and the later runs with the same task.

`Results.run["selection"]` holds the names of cases and engines as asked for (none: all), and the
options of solution and judgement. Places of files and limits of processes are no part of it. Runs
of older versions have none: their command line stands for it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

from .store import RunRow

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
