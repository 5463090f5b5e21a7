"""Comparison of a run with another, pair by pair, and with the history around them: new failures,
repairs, samples no longer reached, drifts, slower solves, and changes of the solution.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import msgspec

from ..case.io.tolerance import DEFAULT_ATOL
from ..harness.labels import UNMADE, motion_unit, number
from ..harness.record import Outcome, OutputSeries, Record
from ..trajectory import QUANTITIES
from ..unit_text import motion_word, value_text
from .findings import Finding, Kind, Loose, Regressions, Step, changes, finding_of, same_machine
from .queries import NIGHTS, NOTHING, Entry, History, Pair, calibration, read, same
from .run_selection import Subject, pairs_of
from .steps import (
    DRIFT,
    ENOUGH,
    HEADROOM,
    LOOSE,
    OUTCOME,
    RESIDUAL,
    RESIDUAL_FLOOR,
    SAME_SAMPLE,
    SEEN,
    TIME,
    TIME_FLOOR,
    UNJUDGED,
    crept,
    drifted,
    lasting,
    slowest,
    steps,
)
from .store import RunRow, Store

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


def differing(now: Subject, before: Subject) -> Iterator[Finding]:
    """Yield the changes of pairs solved in both runs, in the order of the records."""
    earlier = by_pair(before.results.records)
    for pair, record in by_pair(now.results.records).items():
        old = earlier.get(pair)
        if old is not None and old.solved and record.solved:
            yield from _numbers(record, old)
            yield from _residual(record, old)
            yield from _units(record, old)
            yield from _gone(record, old)


def _numbers(now: Record, before: Record) -> Iterator[Finding]:
    """Yield changes of dof and rank, and numbers that are null now."""
    for name, kind in (("dof", Kind.FREEDOM), ("rank", Kind.RANK)):
        old, new = getattr(before, name), getattr(now, name)
        if None not in (old, new) and new != old:
            yield finding_of(kind, now, f"{name} {old} → {new}", before=float(old), now=float(new))
    for name in ("dof", "rank", "residual_max"):
        if getattr(before, name) is not None and getattr(now, name) is None:
            why = now.reasons.get(name) or "no reason is given"
            yield finding_of(
                Kind.GONE,
                now,
                f"{name} has no value now, {number(getattr(before, name))} before: {why}",
            )


def _residual(now: Record, before: Record) -> Iterator[Finding]:
    old, new = before.residual_max, now.residual_max
    if old is None or new is None or new < RESIDUAL * max(old, RESIDUAL_FLOOR):
        return
    ratio = new / old if old else None
    times = f" (×{number(ratio)})" if ratio else ""
    message = f"largest residual {number(old)} → {number(new)}{times}"
    yield finding_of(Kind.RESIDUAL, now, message, before=old, now=new, ratio=ratio, limit=RESIDUAL)


def _units(now: Record, before: Record) -> Iterator[Finding]:
    """Yield outputs with a changed unit or positive sense."""
    for output, old in before.outputs.items():
        new = now.outputs.get(output)
        for what in ("unit", "sense"):
            a, b = getattr(old, what), getattr(new, what, None)
            if new is not None and a != b:
                yield finding_of(
                    Kind.UNIT, now, f"{output}: {what} {a or 'none'} → {b or 'none'}", output=output
                )


def _gone(now: Record, before: Record) -> Iterator[Finding]:
    """Yield motions of outputs with null in place of earlier numbers, unless another finding
    reports it.
    """
    if not same_samples(now, before):
        return
    unsolved = _unsolved(now) if (now.solved or 0) < (before.solved or 0) else set[int]()
    for output, old in before.outputs.items():
        new = now.outputs.get(output)
        for motion in QUANTITIES:
            judged = getattr(before.errors.get(output), motion, None)
            if judged is not None and getattr(now.errors.get(output), motion, None) is None:
                continue  # no longer compared, which another finding reports
            there, here = values_of(old, motion), values_of(new, motion)
            had = [k for k, value in enumerate(there) if value is not None]
            lost = [k for k in had if (k >= len(here) or here[k] is None) and k not in unsolved]
            if lost:
                at = [
                    f"{name} = {number(values[lost[0]])}"
                    for name, values in now.driver.items()
                    if lost[0] < len(values)
                ]
                first = at[0] if at else f"sample {lost[0]}"
                why = (
                    "the case has no such output now"
                    if new is None
                    else new.reason or "no reason is given"
                )
                word = motion_word(motion, old.unit)
                message = (
                    f"{output} {word} has no value at {len(lost)} of {len(had)} samples that had"
                    f" one, first at {first}: {why}"
                )
                yield finding_of(Kind.GONE, now, message, output=output, motion=motion)


def _unsolved(record: Record) -> set[int]:
    """Return the samples at which no output has a position; another finding reports unsolved
    samples.
    """
    count = max((len(output.position) for output in record.outputs.values()), default=0)
    series = [output.position for output in record.outputs.values()]
    return {k for k in range(count) if all(k >= len(each) or each[k] is None for each in series)}


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


def loose(history: History, cases: Mapping[str, Any]) -> list[Loose]:
    """Return the outputs whose errors stayed far below their tolerances in all runs, by case.

    Args:
        cases: the facts of each case from a run's circumstances, for the reasons of its tolerances.
    """
    largest: dict[tuple[str, str], float] = {}
    runs: dict[tuple[str, str], set[int]] = {}
    for (case, _, _), entries in history.pairs.items():
        for entry in entries:
            for output, deviations in entry.errors.items():
                for _, each in deviations.items():
                    ratio = each.max_abs / each.tolerance if each.tolerance else 1.0
                    largest[case, output] = max(ratio, largest.get((case, output), 0.0))
                    runs.setdefault((case, output), set()).add(entry.run)
    return [
        Loose(
            case=case,
            output=output,
            runs=len(runs[case, output]),
            largest=ratio,
            factor=1.0 / (HEADROOM * ratio) if ratio else None,
            why=str(_facts(cases, case, output).get("why", "")),
        )
        for (case, output), ratio in sorted(largest.items())
        if ratio * LOOSE < 1.0 and len(runs[case, output]) >= SEEN
    ]


def _facts(cases: Mapping[str, Any], case: str, output: str) -> Mapping[str, Any]:
    return cases.get(case, {}).get("outputs", {}).get(output, {})


def missing(
    subject: Subject, store: Store | None, findings: Sequence[Finding]
) -> Iterator[Finding]:
    """Yield the missing pairs, whatever run is compared with: the last run may have more pairs than
    the last green one.

    A run of another selection has another task and does not count.

    Args:
        findings: the findings on the subject so far.
    """
    last = _last(subject, store) if store else None
    if last is None:
        return
    known = pairs_of(subject) | {
        (each.case, each.engine, each.mode) for each in findings if each.kind is Kind.ABSENT
    }
    for case, engine, mode in last.plan:
        if (case, engine, mode) not in known:
            yield Finding(
                kind=Kind.ABSENT,
                case=case,
                engine=engine,
                mode=mode,
                message=f"in run {last.id}, by the same command",
            )


def _last(subject: Subject, store: Store) -> RunRow | None:
    """Return the last earlier run of the subject's selection."""
    return next(
        (
            row
            for row in store.runs()
            if row.status != "running"
            and (subject.before is None or row.id < subject.before)
            and same(row.circumstances, subject.facts)
        ),
        None,
    )


RECENT = 20
"""Number of latest runs that give the spread of times on the machine."""


def regressions(
    subject: Subject,
    against: Subject | None,
    reason: str,
    store: Store | None,
    *,
    missing_is_failure: bool = False,
) -> Regressions:
    """Return all changes.

    Args:
        reason: the reason why there is no run to compare with.
        missing_is_failure: whether a pair of an earlier run, missing in this one, is a regression.

    Raises:
        HistoryError: the history cannot be read.
    """
    around = _around(subject, store)
    limit = slowest(_alike(subject, around, before=subject.before))
    every = steps(around)
    standing, over = lasting(every), [each for each in every if each.worse and each.repaired]
    found = unmade(subject)
    if against is not None:
        then = (
            NOTHING
            if against.number is None
            else _alike(subject, around, before=against.number + 1)
        )
        found += compare(subject, against, then, limit)
        found += differing(subject, against)
        found += crept(subject, around, found)
    found += missing(subject, store, found)
    records = subject.results.records
    return Regressions(
        run=subject.label,
        against=against.label if against else None,
        reason=reason,
        pairs=len(records),
        failing=[
            (record.case, record.engine, record.mode) for record in records if record.outcome.bad
        ],
        unjudged=[
            (record.case, record.engine, record.mode)
            for record in records
            if record.outcome is Outcome.UNJUDGED
        ],
        unread=[*subject.results.unread],
        passed_by=[*subject.passed_by],
        time_limit=limit,
        missing_is_failure=missing_is_failure,
        findings=[_since(finding, standing) for finding in found],
        changes=changes(subject.facts, against.facts) if against else [],
        steps=standing + over,
        loose=loose(around, subject.facts.get("cases", {})),
    )


def _around(subject: Subject, store: Store | None) -> History:
    """Return the runs up to the subject that solve and judge as it, including the subject if the
    history has it.
    """
    if store is None:
        return NOTHING
    cases = list(dict.fromkeys(record.case for record in subject.results.records))
    before = subject.before if subject.number is None else subject.number + 1
    return read(store, before=before, last=NIGHTS, cases=cases, like=subject.facts)


def _alike(subject: Subject, around: History, *, before: int | None) -> History:
    """Return the latest runs before a number on the subject's machine."""
    runs = {
        number: row
        for number, row in around.runs.items()
        if (before is None or number < before) and same_machine(row.circumstances, subject.facts)
    }
    runs = dict([*runs.items()][-RECENT:])
    pairs = {
        pair: [entry for entry in entries if entry.run in runs]
        for pair, entries in around.pairs.items()
    }
    return History(runs, pairs)


def _since(finding: Finding, standing: list[Step]) -> Finding:
    """Return the finding with its first run, if a step gives one."""
    quantity = {Kind.SLOWER: TIME, Kind.FAILURE: OUTCOME, Kind.DRIFTED: finding.motion}.get(
        finding.kind
    )
    about = (
        finding.case,
        finding.engine,
        finding.mode,
        quantity,
        finding.output if finding.kind is Kind.DRIFTED else None,
    )
    for step in standing:
        if (step.case, step.engine, step.mode, step.quantity, step.output) == about:
            return msgspec.structs.replace(finding, since=step.first)
    return finding
