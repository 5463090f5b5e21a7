"""Steps: changes of level in the history of a pair, with the first run of the new level and the
other changes in that run; and errors that grow slowly.

The levels of a series come from its exact segmentation into parts of constant level, with L1 cost.
`ruptures` also segments exactly, but cannot require each change to be significant, and has no
wheels after Python 3.13.

Differences are significant above ratios, and above floors below which a ratio means nothing. Errors
repeat exactly on one machine (25 runs of 5 cases in 4 engines, 20 pairs: not a bit differed).
Another processor or linear algebra library sums in another order, and changes errors of pure
round-off by a small factor. Times do not repeat: see `TIME_RATIO`.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any, TypeAlias

import numpy as np

from ..case.case import Array
from ..harness.labels import displayed, motion_unit, number, shown_change
from ..harness.record import Deviation, Facts, Outcome, Record
from ..trajectory import QUANTITIES
from ..unit_text import motion_word
from .findings import Change, Finding, Kind, Step, changes
from .queries import IDLE, Entry, History, calibration, unit_of
from .store import Pair
from .subjects import Subject

DRIFT = 10.0
"""Ratio of errors: a decimal digit. Another order of summation changes round-off by a factor of 3
in measurements.
"""

DRIFT_FLOOR = 1e-6
"""Fraction of the tolerance below which errors do not matter. At the usual 1e-9 m this is 1e-15 m,
a few units in the last place of a metre.
"""

RESIDUAL = 1e3
"""Ratio of residuals: three digits. Newton's last step may gain or lose two if a sample barely
meets its tolerance.
"""

RESIDUAL_FLOOR = 2.0**-52
"""Floor of residuals, the last place of a metre or of one: a smaller residual is indistinguishable
from zero. So growth from 1e-17 to 1e-14 is insignificant, and growth from 5e-16 to 1e-8 is a
constraint that is met less well.
"""

UNJUDGED = 1e-6
"""Fraction of the largest value: unjudged values that differ by more belong to another motion.
Round-off is a millionth of this.
"""

SAME_SAMPLE = 1e-12
"""Fraction of a driver's largest value: thousands of units in its last place, and less than any
useful step of a sweep.
"""

TIME_RATIO = 1.75
"""Smallest ratio of times. In 25 equal runs of 20 pairs on two processors with five busy processes,
with times that exclude waiting, 99.9 % of all 6000 ratios of two runs are below 1.75, and the
largest ratio to the median of the runs is 1.71.
"""

TIME_FLOOR = 5e-5
"""Smallest difference of warm solves [s]. In the same runs the fastest pairs, 0.05 to 0.3 ms per
solve, are up to 0.04 ms late.
"""

ENOUGH = 5
"""Fewest runs that give the spread of times; with fewer, `TIME` is the limit."""

WIDE = 3.0
"""Exponent in the limit of times: the ratio of successive runs that 9 in 10 do not exceed, to this
power. With normal logarithms that ratio lies at 1.64 standard deviations, and the limit at five,
which is exceeded once in a million; a busy machine has heavier tails.
"""

HEADROOM = 10.0
"""Factor of a tolerance on the largest error seen: the next simulator or processor may be a digit
worse.
"""

LOOSE = 1e3
"""Fraction of a tolerance below which all errors of a loose one stay: a thousandth, since a digit
or two of headroom is normal.
"""

SEEN = 10
"""Fewest runs before a tolerance is called loose: a week and a half of nights."""


def has_drifted(before: float, now: float, tolerance: float) -> bool:
    """Return whether an error has grown by more than floor and round-off explain."""
    return now > max(DRIFT_FLOOR * tolerance, DRIFT * before)


def slowest(series: Iterable[Sequence[float]], runs: int) -> float:
    """Return the largest ratio of times that is not slower, by the spread of all pairs from run to
    run.

    The spread is that of ratios of successive runs, so a true change of speed counts once; about a
    median it would count in every later run.

    Args:
        series: times of each pair in the order of the runs.
        runs: number of these runs.
    """
    ratios = [max(a, b) / min(a, b) for times in series for a, b in pairwise(times)]
    if runs < ENOUGH or len(ratios) < 2:
        return TIME_RATIO
    usual = statistics.quantiles(ratios, n=10)[-1]
    return max(TIME_RATIO, math.exp(WIDE * math.log(max(usual, 1.0))))


SURE = 6.0
"""Smallest distance of two levels in standard errors of a median. In 24 runs with times that
include waiting, where any level is due to chance, the largest was 4.4. A change of level must also
reduce the sum of distances from the medians by this many.
"""

# For normal values with standard deviation 1: standard error of a median times the root of their
# number, mean |difference| of two values, and interquartile range.
MEDIAN_ERROR, DIFFERENCE, QUARTILES = 1.253, 1.128, 1.349


def change_points(values: Array, *, least: float, lasting: int) -> list[int]:
    """Return the indices at which the level of a series changes.

    Among all segmentations with only significant changes, the result has the least sum of distances
    from the medians of the parts, plus a penalty for each change. A change is significant if
    - the medians of `lasting` values before and after it differ by `least`: a slow drift is
      no change;
    - three quarters of the shorter part (of three values, all) lie beyond the median of the longer
      by `least`;
    - the medians of the parts differ by `SURE` standard errors.

    Medians and distances, instead of means and squares, keep one outlier from being a level.

    Args:
        values: shape (n,).
        least: the smallest significant distance of two levels.
        lasting: the fewest values of a level.
    """
    count = len(values)
    if count < 2 * lasting or np.ptp(values) < least:
        return []
    near = np.median(np.lib.stride_tricks.sliding_window_view(values, lasting), axis=1)
    jump = near[lasting:] - near[:-lasting]
    ends = [0, *(lasting + k for k in range(len(jump)) if abs(jump[k]) >= least), count]
    if len(ends) == 2:
        return []
    cost, middle, low, high, width = _parts(values, ends, lasting)
    deviation = _deviation(values)
    # best[i, j]: cost of the division up to ends[j] whose last part begins at ends[i]
    # before[i, j]: where the part before that one begins
    best = np.full(cost.shape, np.inf)
    best[0] = cost[0]
    before = np.zeros(cost.shape, int)
    for i in range(1, len(ends) - 1):
        left, right = (slice(0, i), i, None), (i, None, slice(i + 1, None))
        a = np.array([[ends[i] - end] for end in ends[:i]])
        b = np.array([[end - ends[i] for end in ends[i + 1 :]]])
        up = math.copysign(1.0, jump[ends[i] - lasting])
        outer, inner = (high, low) if up > 0 else (low, high)
        apart: Array = up * (middle[right] - middle[left])
        by_left: Array = up * (middle[right] - outer[left])
        by_right: Array = up * (inner[right] - middle[left])
        inside: Array = (a * width[left] + b * width[right]) / (a + b) / QUARTILES
        error = MEDIAN_ERROR * np.maximum(deviation, inside) * np.sqrt(1 / a + 1 / b)
        sure = (np.where(a <= b, by_left, by_right) >= least) & (apart >= SURE * error)
        costs = np.where(sure, best[:i, i, None], np.inf)
        before[i, i + 1 :] = costs.argmin(axis=0)
        best[i, i + 1 :] = costs.min(axis=0) + SURE * MEDIAN_ERROR * deviation + cost[i, i + 1 :]
    i, j = int(best[:, -1].argmin()), len(ends) - 1
    found: list[int] = []
    while i:
        found.append(int(ends[i]))
        i, j = int(before[i, j]), i
    return found[::-1]


def _deviation(values: Array) -> float:
    """Return the standard deviation from the mean difference of successive values, without the
    largest two.

    A temporary level makes two large differences, and single outliers make more. With many
    outliers, three in a row may be chance, which a median would ignore.
    """
    differences = np.sort(np.abs(np.diff(values)))
    calm = differences[: -2 if len(differences) > 3 else -1]
    return float(calm.mean()) / DIFFERENCE if calm.size else 0.0


def _parts(values: Array, ends: list[int], lasting: int) -> Array:
    """Return cost, median, lower and upper quartile, and interquartile range of all parts from one
    end to another.

    The quartiles are values of the part, rounded outwards; their distance is interpolated. A part
    below the shortest length costs infinity.
    """
    table = np.zeros((5, len(ends), len(ends)))
    table[0] = math.inf
    for (i, start), (j, stop) in combinations(enumerate(ends), 2):
        count = stop - start
        if count < lasting:
            continue
        part = sorted(values[start:stop].tolist())
        k, rest = divmod(count - 1, 4)
        low, high = part[k], part[-1 - k]
        inner = rest / 4 * (part[min(k + 1, count - 1)] - low + high - part[max(-2 - k, -count)])
        cost = sum(part[count - count // 2 :]) - sum(part[: count // 2])
        table[:, i, j] = (
            cost,
            (part[(count - 1) // 2] + part[count // 2]) / 2,
            low,
            high,
            high - low - inner,
        )
    return table


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
class _Level:
    """A new level of a series.

    Attributes:
        earlier, later: indices of the values before the change and after it.
        before, now: the levels.
        last, first: the last entry of the old level, and the first one of the new.
        repaired: the first run of a later level that is as low as the old one; None without one.
    """

    earlier: range
    later: range
    before: float
    now: float
    last: Entry
    first: Entry
    repaired: int | None


def steps(history: History) -> list[Step]:
    """Return the steps of all pairs, the latest first."""
    found: list[Step] = []
    for pair, entries in history.pairs.items():
        found += _outcomes(history, pair, entries)
        found += _times(history, pair, entries)
        for motion in QUANTITIES:
            found += _errors(history, pair, entries, motion)
    return sorted(found, key=lambda step: -step.first)


def standing_steps(found: Sequence[Step]) -> list[Step]:
    """Return the last step for the worse of each series, unless a later run has repaired it."""
    last: dict[tuple[str | None, ...], Step] = {}
    for step in found:  # the latest first
        if step.worse and step.repaired is None:
            last.setdefault((*step.pair, step.quantity, step.output), step)
    return [*last.values()]


def _outcomes(history: History, pair: Pair, entries: Sequence[Entry]) -> Iterator[Step]:
    """Yield the runs in which a pair began to fail, or to pass again. Runs without a verdict do
    not count.
    """
    able = [entry for entry in entries if entry.outcome not in (*IDLE, Outcome.UNJUDGED)]
    turns = [(a, b) for a, b in pairwise(able) if a.outcome.bad is not b.outcome.bad]
    for k, (a, b) in enumerate(turns, 1):
        next_turn = turns[k][1] if k < len(turns) else None
        repaired = next_turn.run if next_turn and b.outcome.bad else None
        yield _step(history, pair, a, b, quantity=OUTCOME, worse=b.outcome.bad, repaired=repaired)


def _times(history: History, pair: Pair, entries: Sequence[Entry]) -> Iterator[Step]:
    """Yield the changes of the time, in calibration loops, over the runs with a calibration on each
    machine.
    """
    loops = {run: calibration(row.circumstances) for run, row in history.runs.items()}
    by_machine: dict[Any, list[tuple[Entry, float]]] = {}
    for entry in entries:
        # without the waits of a busy machine, a time may be below zero
        if entry.seconds and entry.seconds > 0.0 and (loop := loops[entry.run]):
            machine = history.runs[entry.run].circumstances.get("processor")
            by_machine.setdefault(machine, []).append((entry, math.log(entry.seconds / loop)))
    for series in by_machine.values():
        for level in _levels(series, math.log(PACE), LASTING):
            loop = loops[level.first.run] or 1.0
            before, now = math.exp(level.before) * loop, math.exp(level.now) * loop
            if abs(now - before) > TIME_FLOOR:
                yield _new_level(history, pair, level, before, now, quantity=TIME)


def _errors(history: History, pair: Pair, entries: Sequence[Entry], motion: str) -> list[Step]:
    """Return the changes of outputs' errors; if several outputs change in a run, the largest."""
    largest: dict[tuple[int, bool, int | None], tuple[float, Step]] = {}
    for output in dict.fromkeys(output for entry in entries for output in entry.errors):
        errors = errors_of(entries, output, motion)
        logs = [math.log(size) for size in above_floor(errors)]
        series = [(entry, log) for (entry, _), log in zip(errors, logs, strict=True)]
        for level in _levels(series, math.log(DRIFT), 1):
            before, now = (
                float(np.median([errors[k][1].max_abs for k in part]))
                for part in (level.earlier, level.later)
            )
            row, case = history.runs[level.first.run], level.first.case
            units = row.circumstances.get("cases", {}).get(case, {}).get("units", {})
            about = {"quantity": motion, "output": output, "unit": unit_of(row, case, output)}
            about["units"] = units
            step = _new_level(history, pair, level, before, now, **about)
            key, size = (step.first, step.worse, step.repaired), abs(level.now - level.before)
            if key not in largest or size > largest[key][0]:
                largest[key] = size, step
    return sorted((step for _, step in largest.values()), key=lambda step: step.first)


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
    tolerances = [each.tolerance for _, each in errors if each.tolerance > 0.0]
    floor = DRIFT_FLOOR * min(tolerances, default=0.0)
    return [max(each.max_abs, floor) for _, each in errors]


def _levels(series: _Series, least: float, shortest: int) -> Iterator[_Level]:
    values = np.array([value for _, value in series])
    places = change_points(values, least=least, lasting=shortest)
    parts = [range(*each) for each in pairwise([0, *places, len(values)])] if places else []
    levels = [float(np.median(values[part.start : part.stop])) for part in parts]
    for k, (earlier, later) in enumerate(pairwise(parts), 1):
        before, now = levels[k - 1 : k + 1]
        rest = zip(parts[k + 1 :], levels[k + 1 :], strict=True)
        low = [part[0] for part, level in rest if now > before > level - least]
        repaired = series[low[0]][0].run if low else None
        last, first = series[earlier[-1]][0], series[later[0]][0]
        yield _Level(earlier, later, before, now, last, first, repaired)


def _new_level(
    history: History, pair: Pair, level: _Level, before: float, now: float, **about: Any
) -> Step:
    worse, repaired = now > before, level.repaired
    about |= {"before": before, "now": now, "worse": worse, "repaired": repaired}
    return _step(history, pair, level.last, level.first, **about)


def _step(history: History, pair: Pair, last: Entry, first: Entry, **about: Any) -> Step:
    """Return a step with the other differences between two runs; versions of the engine come from
    its own records.
    """
    case, engine, mode = pair
    before, now = (history.runs[entry.run] for entry in (last, first))
    other: list[dict[str, Any]] = [{**row.circumstances, "engines": {}} for row in (now, before)]
    version = Change(what=engine, before=last.version, now=first.version)
    defaults: dict[str, Any] = {"output": None, "before": None, "now": None}
    return Step(
        case=case,
        engine=engine,
        mode=mode,
        first=first.run,
        started=now.started,
        last=last.run,
        changes=[version] * (last.version != first.version) + changes(*other),
        **(defaults | about),
    )


def with_crept(subject: Subject, findings: Sequence[Finding]) -> list[Finding]:
    """Return the findings on a run with the errors that grew by less than a digit per night, but
    are a digit above the least error since their baseline was accepted, with the same tolerance and
    standard. Neither steps nor the comparison with one night show them in full.
    """
    found = {
        (*each.pair, each.kind, each.output, each.motion, each.message): each for each in findings
    }
    drifted = {
        (*each.pair, each.output, each.motion): (key, each.before or 0.0)
        for key, each in found.items()
        if each.kind is Kind.DRIFTED
    }
    for record in subject.results.records:
        state = subject.states.get(record.pair)
        for output, levels in state.levels.items() if state else ():
            for motion, least in levels.items():
                now = getattr(record.errors.get(output), motion, None)
                if now is None or not now.within:
                    continue
                key, before = drifted.get((*record.pair, output, motion), (None, math.inf))
                alike = (least.tolerance, least.against) == (now.tolerance, now.against)
                grown = has_drifted(least.error, now.max_abs, now.tolerance)
                if alike and grown and least.error < before:
                    words = f", gradually since run {least.run} ("
                    facts = subject.facts.get("cases", {}).get(record.case, {})
                    each = drift(record, output, motion, least.error, now, words, facts)
                    found[key or (*each.pair, each.kind, output, motion, each.message)] = each
    return [*found.values()]


def drift(
    record: Record,
    output: str,
    motion: str,
    before: float,
    now: Deviation,
    words: str,
    facts: Facts,
) -> Finding:
    """Return the finding of an error that has grown, with words before its tolerance.

    Args:
        facts: of the case, for the units of the text.
    """
    base = record.outputs[output].unit if output in record.outputs else ""
    unit = motion_unit(base, motion) if base else ""
    word = motion_word(motion, base)
    size = shown_change(before, now.max_abs, unit, facts)
    tolerance = number(displayed(unit, facts)[1] * now.tolerance)
    return Finding.of(
        Kind.DRIFTED,
        record,
        f"{output} {word} error {size}{words}tolerance {tolerance})",
        output=output,
        motion=motion,
        before=before,
        now=now.max_abs,
        ratio=now.max_abs / before if before else None,
        limit=DRIFT,
    )
