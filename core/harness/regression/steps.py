"""Steps: where a level changed in the history of a pair, the first run that has the new one, and what else changed there."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from ...trajectory import QUANTITIES
from ..case import Array
from ..history.series import Entry, History, Pair, calibration, unit_of
from ..history.store import RunRow
from ..record import Deviation
from .compare import changes
from .findings import Change, Step
from .limits import DRIFT, DRIFT_FLOOR, TIME_FLOOR

OUTCOME, TIME = "outcome", "time"

LASTING = 3
"""Runs that make a level of times: one slow night is none, and two may be one busy afternoon."""

PACE = 1.5
"""Ratio of levels of times, at least. In 26 equal runs of 20 pairs, a quarter of a minute each, on a busy machine, the largest
ratio of three or more successive runs to those before was 1.44; nights have less in common than minutes. One run: see `limits`."""

SURE = 6.0
"""Distance of two levels in standard errors of a median. In 24 such runs whose times were not freed of waiting, where any level is
chance, the largest was 4.4."""

_Series: TypeAlias = Sequence[tuple[Entry, float]]


@dataclass(frozen=True)
class _Found:
    """A change of level: indices into the series of the values before it and of those after it, and the levels."""

    earlier: range
    later: range
    before: float
    now: float


def steps(history: History, *, standing: bool = False) -> list[Step]:
    """The steps of all pairs, the latest first.

    Args:
        standing: only the last step of a series, and only for the worse: what still holds today.
    """
    found: list[Step] = []
    for pair, entries in history.pairs.items():
        by_quantity: list[list[Step]] = [_outcomes(pair, entries, history), _times(pair, entries, history)]
        by_quantity += [_errors(pair, entries, history, motion) for motion in QUANTITIES]
        for each in by_quantity:
            found += [step for step in each[-1:] if step.worse] if standing else each
    return sorted(found, key=lambda step: -step.first)


def change_points(values: Array, *, least: float, lasting: int) -> list[int]:
    """Indices at which the level of a series changes.

    The series is halved where that brings it closest to the medians of its parts, as long as these are far enough apart: by
    `least`, and by `SURE` standard errors. Medians and distances, not means and squares: one outlier is not a level.

    Args:
        values: shape (n,).
        least: distance of two levels that matters.
        lasting: how many values make a level.
    """
    if len(values) < 2 * lasting or np.ptp(values) < least:
        return []
    places = range(lasting, len(values) - lasting + 1)
    place = min(places, key=lambda k: _spread(values[:k]) + _spread(values[k:]))
    left, right = values[:place], values[place:]
    distance = _distance(*sorted((left, right), key=len))
    if distance < least or distance < SURE * _noise(left, right) * math.sqrt(1 / len(left) + 1 / len(right)):
        return []
    before = change_points(left, least=least, lasting=lasting)
    return [*before, place, *(place + each for each in change_points(right, least=least, lasting=lasting))]


def _spread(values: Array) -> float:
    return float(np.abs(values - np.median(values)).sum())


def _distance(shorter: Array, longer: Array) -> float:
    """How far three quarters of the shorter part are, at least, beyond the middle of the longer: of three values, all."""
    apart = shorter - np.median(longer)
    return float(np.quantile(apart * np.sign(np.median(apart)), 0.25, method="lower"))


def _noise(left: Array, right: Array) -> float:
    """Standard error of a median, of one value: from differences of successive ones, of which a further step is only one."""
    differences = np.abs(np.concatenate([np.diff(left), np.diff(right)]))
    # normal: median |difference| = 0.674 * sqrt 2 standard deviations; a median's standard error is sqrt(pi / 2) of a mean's
    return float(np.median(differences)) / 0.954 * 1.253 if differences.size else 0.0


def _outcomes(pair: Pair, entries: Sequence[Entry], history: History) -> list[Step]:
    """Where a pair that was not bad became bad, or the reverse."""
    return [
        _step(pair, OUTCOME, None, a, b, history, worse=b.outcome.bad)
        for a, b in pairwise(entries)
        if a.outcome.bad is not b.outcome.bad
    ]


def _times(pair: Pair, entries: Sequence[Entry], history: History) -> list[Step]:
    """Where the time in calibration loops has changed; runs without a calibration have no place in it."""
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
    """Where the error of an output has changed; of several outputs that changed in the same run, the one that did most."""
    largest: dict[tuple[int, bool], tuple[float, Step]] = {}
    for output in dict.fromkeys(output for entry in entries for output in entry.errors):
        errors = errors_of(entries, output, motion)
        series = [(entry, math.log(size)) for (entry, _), size in zip(errors, above_floor(errors), strict=True)]
        for each in _levels(series, math.log(DRIFT), 1):
            before, now = (float(np.median([errors[k][1].max_abs for k in part])) for part in (each.earlier, each.later))
            step = _levelled(pair, motion, output, series, each, before, now, history)
            key, size = (step.first, step.worse), abs(each.now - each.before)
            if key not in largest or size > largest[key][0]:
                largest[key] = size, step
    return [step for _, step in sorted(largest.values(), key=lambda each: each[1].first)]


def errors_of(entries: Sequence[Entry], output: str, motion: str) -> list[tuple[Entry, Deviation]]:
    """The errors of an output where they were found, but for those of nothing that is held to nothing."""
    found = [(entry, getattr(entry.errors.get(output), motion, None)) for entry in entries]
    return [(entry, each) for entry, each in found if each is not None and max(each.max_abs, each.tolerance) > 0.0]


def above_floor(errors: Sequence[tuple[Entry, Deviation]]) -> list[float]:
    """Sizes of errors, none below one floor for all: there one is like another, whatever the tolerance was then."""
    floor = DRIFT_FLOOR * min((each.tolerance for _, each in errors if each.tolerance > 0.0), default=0.0)
    return [max(each.max_abs, floor) for _, each in errors]


def _levels(series: _Series, least: float, lasting: int) -> Iterator[_Found]:
    values = np.array([value for _, value in series])
    places = change_points(values, least=least, lasting=lasting)
    for before, place, after in zip([0, *places], places, [*places[1:], len(values)], strict=False):
        levels = float(np.median(values[before:place])), float(np.median(values[place:after]))
        yield _Found(range(before, place), range(place, after), *levels)


def _levelled(
    pair: Pair, quantity: str, output: str | None, series: _Series, found: _Found, before: float, now: float, history: History
) -> Step:
    a, b = series[found.earlier[-1]][0], series[found.later[0]][0]
    return _step(pair, quantity, output, a, b, history, worse=now > before, before=before, now=now)


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
        changes=_between(engine, a, b, history),
    )


def _between(engine: str, a: Entry, b: Entry, history: History) -> list[Change]:
    """What else is not the same in two runs: the engine by what its own records say."""
    versions = [Change(what=engine, before=a.version, now=b.version)] if a.version != b.version else []
    rest = changes(history.runs[b.run].circumstances | {"engines": {}}, history.runs[a.run].circumstances | {"engines": {}})
    return versions + rest
