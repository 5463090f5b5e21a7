"""Steps: changes of level in the history of a pair, with the first run of the new level and the
other changes in that run.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from ...harness.record import Deviation, Outcome
from ...trajectory import QUANTITIES
from ..queries import IDLE, Entry, History, Pair, calibration, unit_of
from ..store import RunRow
from .circumstance_changes import changes
from .findings import Change, Step
from .segmentation import change_points
from .thresholds import DRIFT, DRIFT_FLOOR, TIME_FLOOR

OUTCOME, TIME = "outcome", "time"

LASTING = 3
"""Fewest runs of a level of times: one slow night is no level, and two may be a busy afternoon."""

PACE = 1.5
"""Smallest ratio of two levels of times. In 26 equal runs of 20 pairs on a busy machine, a quarter
of a minute each, the largest ratio of three or more successive runs to earlier ones was 1.44, and
nights differ more than minutes. For one run, see `thresholds`.
"""

_Series: TypeAlias = Sequence[tuple[Entry, float]]


@dataclass(frozen=True)
class _Found:
    """A change of level: indices of the values before and after it in the series, and the levels.

    Attributes:
        repaired: index of the first value of a later level that is as low as the level before; None
            without one.
    """

    earlier: range
    later: range
    before: float
    now: float
    repaired: int | None


def steps(history: History, *, standing: bool = False) -> list[Step]:
    """Return the steps of all pairs, the latest first.

    Args:
        standing: return only those of `lasting`.
    """
    found: list[Step] = []
    for pair, entries in history.pairs.items():
        found += _outcomes(pair, entries, history)
        found += _times(pair, entries, history)
        for motion in QUANTITIES:
            found += _errors(pair, entries, history, motion)
    found.sort(key=lambda step: -step.first)
    return lasting(found) if standing else found


def lasting(found: Sequence[Step]) -> list[Step]:
    """Return the last step for the worse of each series, unless a later run has repaired it."""
    last: dict[tuple[str | None, ...], Step] = {}
    for step in found:  # the latest first
        if step.worse and step.repaired is None:
            last.setdefault((step.case, step.engine, step.mode, step.quantity, step.output), step)
    return [*last.values()]


def _outcomes(pair: Pair, entries: Sequence[Entry], history: History) -> list[Step]:
    """Return the runs in which a pair began to fail, or to pass again. Runs without a verdict do
    not count.
    """
    able = [entry for entry in entries if entry.outcome not in (*IDLE, Outcome.UNJUDGED)]
    turns = [(a, b) for a, b in pairwise(able) if a.outcome.bad is not b.outcome.bad]
    repairs = [b.run if b.outcome.bad is False else None for _, b in turns[1:]] + [None]
    return [
        _step(pair, OUTCOME, None, a, b, history, worse=b.outcome.bad, repaired=repaired)
        for (a, b), repaired in zip(turns, repairs, strict=False)
    ]


def _times(pair: Pair, entries: Sequence[Entry], history: History) -> list[Step]:
    """Return the changes of the time, in calibration loops, over the runs with a calibration."""
    series: list[tuple[Entry, float]] = []
    for entry in entries:
        loop = calibration(history.runs[entry.run])
        if entry.seconds and loop:
            series.append((entry, math.log(entry.seconds / loop)))
    found: list[Step] = []
    for each in _levels(series, math.log(PACE), LASTING):
        loop = calibration(history.runs[series[each.later[0]][0].run]) or 1.0
        before, now = (math.exp(level) * loop for level in (each.before, each.now))
        if abs(now - before) > TIME_FLOOR:
            found.append(_levelled(pair, TIME, None, series, each, before, now, history))
    return found


def _errors(pair: Pair, entries: Sequence[Entry], history: History, motion: str) -> list[Step]:
    """Return the changes of outputs' errors; if several outputs change in a run, the largest."""
    largest: dict[tuple[int, bool, int | None], tuple[float, Step]] = {}
    for output in dict.fromkeys(output for entry in entries for output in entry.errors):
        errors = errors_of(entries, output, motion)
        series = [
            (entry, math.log(size))
            for (entry, _), size in zip(errors, above_floor(errors), strict=True)
        ]
        for each in _levels(series, math.log(DRIFT), 1):
            before, now = (
                float(np.median([errors[k][1].max_abs for k in part]))
                for part in (each.earlier, each.later)
            )
            step = _levelled(pair, motion, output, series, each, before, now, history)
            key, size = (step.first, step.worse, step.repaired), abs(each.now - each.before)
            if key not in largest or size > largest[key][0]:
                largest[key] = size, step
    return [step for _, step in sorted(largest.values(), key=lambda each: each[1].first)]


def errors_of(entries: Sequence[Entry], output: str, motion: str) -> list[tuple[Entry, Deviation]]:
    """Return the known errors of an output, without zero errors with a zero tolerance."""
    found = [(entry, getattr(entry.errors.get(output), motion, None)) for entry in entries]
    return [
        (entry, each)
        for entry, each in found
        if each is not None and max(each.max_abs, each.tolerance) > 0.0
    ]


def above_floor(errors: Sequence[tuple[Entry, Deviation]]) -> list[float]:
    """Return the sizes of errors, raised to a common floor: smaller errors do not differ, whatever
    their tolerance.
    """
    floor = DRIFT_FLOOR * min(
        (each.tolerance for _, each in errors if each.tolerance > 0.0), default=0.0
    )
    return [max(each.max_abs, floor) for _, each in errors]


def _levels(series: _Series, least: float, lasting: int) -> Iterator[_Found]:
    values = np.array([value for _, value in series])
    places = change_points(values, least=least, lasting=lasting)
    if not places:
        return
    parts = [range(*each) for each in pairwise([0, *places, len(values)])]
    levels = [float(np.median(values[part.start : part.stop])) for part in parts]
    for k, ((earlier, later), (before, now)) in enumerate(
        zip(pairwise(parts), pairwise(levels), strict=True), 2
    ):
        rest = zip(parts[k:], levels[k:], strict=True)
        repaired = next((part.start for part, level in rest if now > before > level - least), None)
        yield _Found(earlier, later, before, now, repaired)


def _levelled(
    pair: Pair,
    quantity: str,
    output: str | None,
    series: _Series,
    found: _Found,
    before: float,
    now: float,
    history: History,
) -> Step:
    a, b = series[found.earlier[-1]][0], series[found.later[0]][0]
    repaired = None if found.repaired is None else series[found.repaired][0].run
    return _step(
        pair,
        quantity,
        output,
        a,
        b,
        history,
        worse=now > before,
        before=before,
        now=now,
        repaired=repaired,
    )


def _step(
    pair: Pair,
    quantity: str,
    output: str | None,
    a: Entry,
    b: Entry,
    history: History,
    *,
    worse: bool,
    before: float | None = None,
    now: float | None = None,
    repaired: int | None = None,
) -> Step:
    case, engine, mode = pair
    run: RunRow = history.runs[b.run]
    return Step(
        case=case,
        engine=engine,
        mode=mode,
        quantity=quantity,
        output=output,
        unit="" if output is None else unit_of(run, case, output),
        first=b.run,
        started=run.started,
        last=a.run,
        before=before,
        now=now,
        worse=worse,
        repaired=repaired,
        changes=_between(engine, a, b, history),
    )


def _between(engine: str, a: Entry, b: Entry, history: History) -> list[Change]:
    """Return the other differences between two runs; versions of the engine come from its own
    records.
    """
    versions = (
        [Change(what=engine, before=a.version, now=b.version)] if a.version != b.version else []
    )
    rest = changes(
        history.runs[b.run].circumstances | {"engines": {}},
        history.runs[a.run].circumstances | {"engines": {}},
    )
    return versions + rest
