"""Two runs, pair by pair: what failed, what is fixed, what is no longer reached, what drifted, what
became slower.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...case.io.tolerance import DEFAULT_ATOL
from ...harness.labels import UNMADE, motion_unit, number
from ...harness.record import Outcome, OutputSeries, Record
from ...trajectory import QUANTITIES
from ..queries import Entry, History, Pair, calibration, own_seconds
from .findings import Change, Finding, Kind
from .run_selection import Subject
from .thresholds import DRIFT, ENOUGH, SAME_SAMPLE, TIME_FLOOR, UNJUDGED, drifted

CIRCUMSTANCES = ("kincheck", "python", "numpy", "tol", "host", "processor", "platform")
PHASES = ("build", "first", "warm", "compare")

References = Mapping[str, Mapping[str, OutputSeries]]
"""True values by case and output."""


def compare(now: Subject, before: Subject, history: History, slowest: float) -> list[Finding]:
    """What differs, in the order of the records.

    Args:
        history: runs up to the one compared with, and on the same machine: what times were then.
        slowest: the ratio of times up to which a pair is not called slower.
    """
    earlier = by_pair(before.results.records)
    findings: list[Finding] = []
    for pair, record in by_pair(now.results.records).items():
        old = earlier.pop(pair, None)
        if old is None:
            findings.append(
                finding_of(
                    Kind.FAILURE if record.outcome.bad else Kind.ADDED, record, _said(record)
                )
            )
            continue
        findings += _outcomes(record, old)
        findings += _lost(record, old)
        findings += _moved(record, old)
        findings += _errors(record, old)
        findings += _references(record, now.results.references, before.results.references)
        entries = history.pairs.get(pair, ())
        findings += _slower(
            record,
            _usual(before, old, entries, history, same_machine(now.facts, before.facts)),
            now.facts,
            slowest,
        )
    asked = set(now.results.missing)
    findings += [
        finding_of(Kind.ABSENT, old, f"{old.outcome.shown} there")
        for pair, old in earlier.items()
        if pair not in asked
    ]
    return findings


def unmade(now: Subject) -> list[Finding]:
    """The pairs that the run was to make and did not: whatever it is compared with, nothing checks
    them.
    """
    pairs, why = now.results.missing, now.results.unread
    return [
        Finding(kind=Kind.LOST, case=case, engine=engine, mode=mode, message=why.get(case, UNMADE))
        for case, engine, mode in pairs
    ]


def by_pair(records: Sequence[Record]) -> dict[Pair, Record]:
    """The records by case, engine and mode."""
    return {(record.case, record.engine, record.mode): record for record in records}


def changes(now: Mapping[str, Any], before: Mapping[str, Any]) -> list[Change]:
    """Versions, machine and settings of two runs that differ: engines first, then ours and what it
    stands on.
    """
    old: dict[str, Any] = before.get("engines") or {}
    new: dict[str, Any] = now.get("engines") or {}
    # an engine that only one of the runs has was not asked for in the other
    pairs: list[tuple[str, Any, Any]] = [
        (name, old[name], new[name]) for name in new if name in old
    ]
    pairs += [(name, before.get(name), now.get(name)) for name in CIRCUMSTANCES]
    pairs.append(("commit", _git(before, "commit"), _git(now, "commit")))
    pairs.append(("uncommitted edits", _edits(before), _edits(now)))
    return [Change(what=what, before=a, now=b) for what, a, b in pairs if a != b]


def _git(facts: Mapping[str, Any], what: str) -> Any:
    git: Mapping[str, Any] = facts.get("git") or {}
    return git.get(what)


def _edits(facts: Mapping[str, Any]) -> str | None:
    """What tells edits apart: a digest, or where none was kept that there are some."""
    return _git(facts, "edits") or ("some" if _git(facts, "changed") else None)


def same_machine(now: Mapping[str, Any], before: Mapping[str, Any]) -> bool:
    """Whether times can be compared by the clock too: on equal processors. Hosted runners have
    another name every night.
    """
    return now.get("processor") == before.get("processor")


def _outcomes(now: Record, before: Record) -> Iterator[Finding]:
    if now.outcome.bad and not before.outcome.bad:
        yield finding_of(Kind.FAILURE, now, f"{before.outcome.shown} → {_said(now)}")
    elif before.outcome.bad and now.outcome is Outcome.PASS:
        yield finding_of(Kind.FIXED, now, f"{before.outcome} → {now.outcome}")
    elif before.outcome.judged and now.outcome is Outcome.UNJUDGED:
        yield finding_of(Kind.UNJUDGED, now, f"{before.outcome} → {_said(now)}")
    elif before.outcome is Outcome.UNJUDGED and now.outcome is Outcome.PASS:
        yield finding_of(Kind.JUDGED, now, f"{before.outcome.shown} → {now.outcome}")


def _lost(now: Record, before: Record) -> Iterator[Finding]:
    """Phases, samples, motions, standards."""
    phases = [phase for phase in PHASES if _reached(before, phase) and not _reached(now, phase)]
    if phases:
        why = f": {_said(now)}" if now.outcome is not Outcome.PASS else ""
        yield finding_of(Kind.LOST, now, f"{', '.join(phases)} no longer reached{why}")
        return
    if (now.solved or 0) < (before.solved or 0):
        asked = "" if now.samples == before.samples else f" of {before.samples}"
        yield finding_of(
            Kind.LOST,
            now,
            f"{now.solved} of {now.samples} samples solved, {before.solved}{asked} before",
        )
    # the pair as a whole is no longer judged, which is a finding of its own
    if now.outcome is Outcome.UNJUDGED:
        return
    for output, old in before.errors.items():
        new = now.errors.get(output)
        gone = [motion for motion, _ in old.items() if getattr(new, motion, None) is None]
        if gone:
            why = (
                f"the case has no output {output!r} now"
                if new is None
                else new.reason or "no reason is given"
            )
            yield finding_of(
                Kind.LOST,
                now,
                f"{output}: {', '.join(gone)} no longer compared: {why}",
                output=output,
                motion=gone[0],
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
    """Outputs whose values are others than they were, or samples: where there is no reference
    nothing else would show it.
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
            # as far as two values can be that are within a tolerance of one standard
            limit = (
                2.0 * judged.tolerance
                if judged
                else DEFAULT_ATOL + UNJUDGED * _largest(before, motion)
            )
            if off > limit:
                unit = motion_unit(old.unit, motion)
                told = f"{output} {motion} differs by up to {number(off)} {unit} from what it was"
                yield finding_of(
                    Kind.MOVED, now, told, now=off, limit=limit, output=output, motion=motion
                )
                break


def same_samples(now: Record, before: Record) -> bool:
    """Whether all drivers have the values they had, but for the last digits of sines and splines on
    another processor.
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
    """Return the values of a motion over the samples; none where there is no such series."""
    return getattr(series, motion, None) or ()


def _apart(a: Sequence[float | None], b: Sequence[float | None]) -> float:
    """The largest difference, over the samples that both have."""
    return max(
        (abs(x - y) for x, y in zip(a, b, strict=False) if x is not None and y is not None),
        default=0.0,
    )


def _largest(record: Record, motion: str) -> float:
    """The largest value of any output."""
    values = (x for output in record.outputs.values() for x in values_of(output, motion))
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
            if a.tolerance != b.tolerance:
                told = f"{output} {motion}: {number(a.tolerance)} → {number(b.tolerance)}"
                yield finding_of(
                    Kind.TOLERANCE, now, told, before=a.tolerance, now=b.tolerance, **about
                )
            # what is out of tolerance is a failure, and named there
            if b.within and a.against == b.against and drifted(a.max_abs, b.max_abs, b.tolerance):
                unit = (
                    motion_unit(now.outputs[output].unit, motion) if output in now.outputs else ""
                )
                times = f"×{number(b.max_abs / a.max_abs)}, " if a.max_abs else ""
                size = f"{number(a.max_abs)} → {number(b.max_abs)} {unit}"
                told = f"{output} {motion} error {size} ({times}tolerance {number(b.tolerance)})"
                ratio = b.max_abs / a.max_abs if a.max_abs else None
                yield finding_of(
                    Kind.DRIFTED,
                    now,
                    told,
                    before=a.max_abs,
                    now=b.max_abs,
                    ratio=ratio,
                    limit=DRIFT,
                    **about,
                )


def _references(record: Record, now: References, before: References) -> Iterator[Finding]:
    """True values that are not what they were; those that came or went show in what is compared."""
    for output, old in before.get(record.case, {}).items():
        new = now.get(record.case, {}).get(output)
        for motion in QUANTITIES:
            was, off = (
                values_of(old, motion),
                _apart(values_of(old, motion), values_of(new, motion)),
            )
            if off > SAME_SAMPLE * max((abs(x) for x in was if x is not None), default=0.0):
                told = (
                    f"{output} {motion} differs by up to {number(off)}"
                    f" {motion_unit(old.unit, motion)} from what it was"
                )
                yield finding_of(
                    Kind.REFERENCE, record, told, now=off, output=output, motion=motion
                )
                break


def _usual(
    before: Subject, record: Record, entries: Sequence[Entry], history: History, same: bool
) -> tuple[float | None, float | None]:
    """Seconds that a warm solve took, and the same in calibration loops of its run; None where they
    are not to be compared.

    The median of the latest runs up to the one compared with, and of that one alone where there are
    few: the noise of one run would be in every comparison with it.
    """
    latest = [entry for entry in entries if entry.seconds][-ENOUGH:]
    if len(latest) < ENOUGH:
        seconds = (
            own_seconds(record.seconds.warm, record.seconds.waited) if record.seconds else None
        )
        loop = calibration(before.facts)
        return seconds if same else None, seconds / loop if seconds is not None and loop else None
    times = [(entry.seconds or 0.0, calibration(history.runs[entry.run])) for entry in latest]
    loops = [seconds / loop for seconds, loop in times if loop]
    return statistics.median(seconds for seconds, _ in times) if same else None, (
        statistics.median(loops) if loops else None
    )


def _slower(
    now: Record, usual: tuple[float | None, float | None], facts: Mapping[str, Any], limit: float
) -> Iterator[Finding]:
    """Slower by the clock and by the calibration loop, where both can be compared: either alone may
    be the machine's doing.
    """
    seconds = own_seconds(now.seconds.warm, now.seconds.waited) if now.seconds else None
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
        told = f"{number(1e3 * should)} → {number(1e3 * seconds)} ms a sweep ({spread})"
        yield finding_of(
            Kind.SLOWER, now, told, before=should, now=seconds, ratio=ratio, limit=limit
        )


def _said(record: Record) -> str:
    return f"{record.outcome.shown}: {record.message}" if record.message else record.outcome.shown


def finding_of(kind: Kind, record: Record, message: str, **about: Any) -> Finding:
    """Return a finding about the pair of a record."""
    return Finding(
        kind=kind,
        case=record.case,
        engine=record.engine,
        mode=record.mode,
        message=message,
        **about,
    )
