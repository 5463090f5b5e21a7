"""Comparison of two runs, pair by pair: new failures, repairs, samples no longer reached, drifts
and slower solves.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...case.io.outputs import DEFAULT_ATOL
from ...harness.labels import UNMADE, motion_unit, number
from ...harness.record import Outcome, OutputSeries, Record
from ...trajectory import QUANTITIES
from ...unit_text import motion_word, value_text
from ..queries import History, Pair
from .circumstance_changes import same_machine
from .findings import Finding, Kind, finding_of
from .run_selection import Subject
from .slower_solves import slower, usual_times
from .thresholds import DRIFT, SAME_SAMPLE, UNJUDGED, drifted

PHASES = ("build", "first", "warm", "compare")

References = Mapping[str, Mapping[str, OutputSeries]]
"""True values by case and output."""


def compare(now: Subject, before: Subject, history: History, slowest: float) -> list[Finding]:
    """Return the differences, in the order of the records.

    Args:
        history: runs on the same machine up to the run compared with, which give the usual times.
        slowest: the largest ratio of times that is not reported as slower.
    """
    earlier = by_pair(before.results.records)
    findings: list[Finding] = []
    for pair, record in by_pair(now.results.records).items():
        old = earlier.pop(pair, None)
        if old is None:
            findings.append(
                finding_of(
                    Kind.FAILURE if record.outcome.bad else Kind.ADDED, record, _result(record)
                )
            )
            continue
        findings += _outcomes(record, old)
        findings += _lost(record, old)
        findings += _moved(record, old)
        findings += _errors(record, old)
        findings += _references(record, now.results.references, before.results.references)
        entries = history.pairs.get(pair, ())
        findings += slower(
            record,
            usual_times(before, old, entries, history, same_machine(now.facts, before.facts)),
            now.facts,
            slowest,
        )
    unfinished = set(now.results.missing)
    findings += [
        finding_of(Kind.ABSENT, old, f"{old.outcome.shown} there")
        for pair, old in earlier.items()
        if pair not in unfinished
    ]
    return findings


def unmade(now: Subject) -> list[Finding]:
    """Return the planned pairs without a record, which no comparison checks."""
    pairs, why = now.results.missing, now.results.unread
    return [
        Finding(kind=Kind.LOST, case=case, engine=engine, mode=mode, message=why.get(case, UNMADE))
        for case, engine, mode in pairs
    ]


def by_pair(records: Sequence[Record]) -> dict[Pair, Record]:
    """Return the records by case, engine and mode."""
    return {(record.case, record.engine, record.mode): record for record in records}


def _outcomes(now: Record, before: Record) -> Iterator[Finding]:
    if now.outcome.bad and not before.outcome.bad:
        yield finding_of(Kind.FAILURE, now, f"{before.outcome.shown} → {_result(now)}")
    elif before.outcome.bad and now.outcome is Outcome.PASS:
        yield finding_of(Kind.FIXED, now, f"{before.outcome} → {now.outcome}")
    elif before.outcome.judged and now.outcome is Outcome.UNJUDGED:
        yield finding_of(Kind.UNJUDGED, now, f"{before.outcome} → {_result(now)}")
    elif before.outcome is Outcome.UNJUDGED and now.outcome is Outcome.PASS:
        yield finding_of(Kind.JUDGED, now, f"{before.outcome.shown} → {now.outcome}")


def _lost(now: Record, before: Record) -> Iterator[Finding]:
    """Return findings on lost phases, samples, motions and standards."""
    phases = [phase for phase in PHASES if _reached(before, phase) and not _reached(now, phase)]
    if phases:
        why = f": {_result(now)}" if now.outcome is not Outcome.PASS else ""
        yield finding_of(Kind.LOST, now, f"{', '.join(phases)} no longer reached{why}")
        return
    if (now.solved or 0) < (before.solved or 0):
        total = "" if now.samples == before.samples else f" of {before.samples}"
        yield finding_of(
            Kind.LOST,
            now,
            f"{now.solved} of {now.samples} samples solved, {before.solved}{total} before",
        )
    # the whole pair is no longer judged, which is a separate finding
    if now.outcome is Outcome.UNJUDGED:
        return
    for output, old in before.errors.items():
        new = now.errors.get(output)
        lost = [motion for motion, _ in old.items() if getattr(new, motion, None) is None]
        if lost:
            why = (
                f"the case has no output {output!r} now"
                if new is None
                else new.reason or "no reason is given"
            )
            yield finding_of(
                Kind.LOST,
                now,
                f"{output}: {', '.join(lost)} no longer compared: {why}",
                output=output,
                motion=lost[0],
            )
    if before.validated and not now.validated and now.outcome is Outcome.PASS:
        against, was = (each.truth.replace("_", " ") for each in (now, before))
        why = (
            f"{against}, before {was}"
            if against != was
            else f"{against} whose source is not cited or is kincheck itself"
        )
        yield finding_of(Kind.LOST, now, f"no longer validated: judged against {why}")


def _moved(now: Record, before: Record) -> Iterator[Finding]:
    """Return the outputs with changed values or samples, which only this comparison shows if there
    is no reference.
    """
    if not (now.driver and before.driver):
        return
    if not same_samples(now, before):
        yield finding_of(Kind.MOVED, now, "solved at other values of the drivers than before")
        return
    for output, old in before.outputs.items():
        for motion in QUANTITIES:
            off = _apart(values_of(old, motion), values_of(now.outputs.get(output), motion))
            judged = getattr(now.errors.get(output), motion, None)
            # largest distance of two values within the tolerance of one standard
            limit = (
                2.0 * judged.tolerance
                if judged
                else DEFAULT_ATOL + UNJUDGED * _largest(before, motion, old.unit)
            )
            if off > limit:
                size = value_text(number(off), motion_unit(old.unit, motion))
                word = motion_word(motion, old.unit)
                message = f"{output} {word} differs by up to {size} from its earlier values"
                yield finding_of(
                    Kind.MOVED, now, message, now=off, limit=limit, output=output, motion=motion
                )
                break


def same_samples(now: Record, before: Record) -> bool:
    """Return whether all drivers have equal values, up to last digits of sines and splines that
    differ between processors.
    """
    here, there = now.driver, before.driver
    if {name: len(values) for name, values in here.items()} != {
        name: len(values) for name, values in there.items()
    }:
        return False
    sizes = {name: max(map(abs, values), default=0.0) for name, values in here.items()}
    return all(
        _apart(values, there[name]) <= SAME_SAMPLE * sizes[name] for name, values in here.items()
    )


def values_of(series: OutputSeries | None, motion: str) -> Sequence[float | None]:
    """Return the values of a motion over the samples; empty without such a series."""
    return getattr(series, motion, None) or ()


def _apart(a: Sequence[float | None], b: Sequence[float | None]) -> float:
    """Return the largest difference over the common samples."""
    return max(
        (abs(x - y) for x, y in zip(a, b, strict=False) if x is not None and y is not None),
        default=0.0,
    )


def _largest(record: Record, motion: str, unit: str) -> float:
    """Return the largest value of all outputs of a unit: forces set no scale for lengths."""
    outputs = (output for output in record.outputs.values() if output.unit == unit)
    values = (x for output in outputs for x in values_of(output, motion))
    return max((abs(x) for x in values if x is not None), default=0.0)


def _reached(record: Record, phase: str) -> bool:
    return record.seconds is not None and getattr(record.seconds, phase) is not None


def _errors(now: Record, before: Record) -> Iterator[Finding]:
    for output, old in before.errors.items():
        for motion in QUANTITIES:
            a, b = getattr(old, motion), getattr(now.errors.get(output), motion, None)
            if a is None or b is None:
                continue
            about: dict[str, Any] = {"output": output, "motion": motion}
            base = now.outputs[output].unit if output in now.outputs else ""
            word = motion_word(motion, base)
            if a.tolerance != b.tolerance:
                message = f"{output} {word}: {number(a.tolerance)} → {number(b.tolerance)}"
                yield finding_of(
                    Kind.TOLERANCE, now, message, before=a.tolerance, now=b.tolerance, **about
                )
            # an error out of tolerance is a failure, which is reported there
            if b.within and a.against == b.against and drifted(a.max_abs, b.max_abs, b.tolerance):
                unit = motion_unit(base, motion) if base else ""
                times = f"×{number(b.max_abs / a.max_abs)}, " if a.max_abs else ""
                size = f"{number(a.max_abs)} → {value_text(number(b.max_abs), unit)}"
                message = f"{output} {word} error {size} ({times}tolerance {number(b.tolerance)})"
                ratio = b.max_abs / a.max_abs if a.max_abs else None
                yield finding_of(
                    Kind.DRIFTED,
                    now,
                    message,
                    before=a.max_abs,
                    now=b.max_abs,
                    ratio=ratio,
                    limit=DRIFT,
                    **about,
                )


def _references(record: Record, now: References, before: References) -> Iterator[Finding]:
    """Return the changed reference values; other findings show new and missing ones."""
    for output, old in before.get(record.case, {}).items():
        new = now.get(record.case, {}).get(output)
        for motion in QUANTITIES:
            was, off = (
                values_of(old, motion),
                _apart(values_of(old, motion), values_of(new, motion)),
            )
            if off > SAME_SAMPLE * max((abs(x) for x in was if x is not None), default=0.0):
                message = (
                    f"{output} {motion_word(motion, old.unit)} differs by up to {number(off)}"
                    f" {motion_unit(old.unit, motion)} from its earlier values"
                )
                yield finding_of(
                    Kind.REFERENCE, record, message, now=off, output=output, motion=motion
                )
                break


def _result(record: Record) -> str:
    return f"{record.outcome.shown}: {record.message}" if record.message else record.outcome.shown
