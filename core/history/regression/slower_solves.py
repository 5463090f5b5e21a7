"""Comparison of solve times with the usual times of earlier runs."""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...harness.labels import number
from ...harness.record import Record
from ..queries import Entry, History, calibration
from .findings import Finding, Kind, finding_of
from .run_selection import Subject
from .thresholds import ENOUGH, TIME_FLOOR


def usual_times(
    before: Subject, record: Record, entries: Sequence[Entry], history: History, same: bool
) -> tuple[float | None, float | None]:
    """Return the usual time of a warm solve [s] and in calibration loops of its run.

    Both are None if the machines cannot be compared. The time is the median over the latest runs up
    to the run compared with, whose own noise would affect every comparison. With few runs it is the
    time of this run alone.
    """
    latest = [entry for entry in entries if entry.seconds][-ENOUGH:]
    if len(latest) < ENOUGH:
        seconds = record.seconds.own if record.seconds else None
        loop = calibration(before.facts)
        return seconds if same else None, seconds / loop if seconds is not None and loop else None
    times = [(entry.seconds or 0.0, calibration(history.runs[entry.run])) for entry in latest]
    loops = [seconds / loop for seconds, loop in times if loop]
    return statistics.median(seconds for seconds, _ in times) if same else None, (
        statistics.median(loops) if loops else None
    )


def slower(
    now: Record, usual: tuple[float | None, float | None], facts: Mapping[str, Any], limit: float
) -> Iterator[Finding]:
    """Yield a finding if a solve is slower by the clock and by the calibration loop.

    One of the two alone may be due to the machine.
    """
    seconds = now.seconds.own if now.seconds else None
    if seconds is None:
        return
    by_clock, by_loop = usual
    loop = calibration(facts)
    expected = [by_clock] if by_clock else []
    expected += [by_loop * loop] if by_loop and loop else []
    if not expected:
        return
    should = max(expected)
    if seconds > limit * should and seconds - should > TIME_FLOOR:
        ratio = seconds / should
        spread = f"×{number(ratio)}; by the spread from run to run, ×{number(limit)} may be chance"
        message = f"{number(1e3 * should)} → {number(1e3 * seconds)} ms a sweep ({spread})"
        yield finding_of(
            Kind.SLOWER, now, message, before=should, now=seconds, ratio=ratio, limit=limit
        )
