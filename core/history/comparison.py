"""Comparison of a run with another, pair by pair, and with the history around them: new failures,
repairs, samples no longer reached, drifts, slower solves, and changes of the solution.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

import msgspec

from ..case.io.outputs import DEFAULT_ATOL
from ..harness.labels import UNMADE, motion_unit, number, shown_change, shown_text
from ..harness.record import Facts, Outcome, OutputSeries, Record
from ..trajectory import QUANTITIES
from ..unit_text import motion_word
from .findings import (
    Accepted,
    Change,
    Finding,
    Kind,
    Loose,
    Regressions,
    Step,
    changes,
    same_machine,
)
from .queries import (
    IDLE,
    NIGHTS,
    NOTHING,
    Entry,
    History,
    calibration,
    last_alike,
    present_names,
    read,
)
from .states import RECENT, State, accepted_in, base_record, state_before, vanished
from .steps import (
    ENOUGH,
    HEADROOM,
    LOOSE,
    OUTCOME,
    SAME_SAMPLE,
    SEEN,
    TIME,
    TIME_FLOOR,
    UNJUDGED,
    drift,
    has_drifted,
    slowest,
    standing_steps,
    steps,
    with_crept,
)
from .store import Pair, RunRow, Store
from .subjects import Subject
from .values import (
    NO_REASON,
    largest,
    largest_difference,
    quantities,
    same_samples,
    solution_changes,
    values_of,
)

PHASES = ("build", "first", "warm", "compare")

References: TypeAlias = Mapping[str, Mapping[str, OutputSeries]]
"""True values by case and output."""


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
    limit = time_limit(subject)
    every = steps(around)
    standing, over = standing_steps(every), [each for each in every if each.worse and each.repaired]
    records, why = subject.results.records, subject.results.unread
    accepted, told = _accepted(subject, store)
    found = [
        Finding(kind=Kind.LOST, case=case, engine=engine, mode=mode, message=why.get(case, UNMADE))
        for case, engine, mode in subject.results.missing
    ]
    if against is not None:
        number = -math.inf if against.number is None else against.number
        found += compare(subject, against, _on_machine(subject, around, before=number + 1), limit)
        found = with_crept(subject, found)
    last = last_alike(store.runs() if store else (), subject.before, subject.facts)
    gone = _vanished(subject, last, store)
    found += _find_missing(subject, last, [*found, *gone])
    if against is not None and against.bases and store is not None:
        found = [_of_state(finding, subject, against, store) for finding in found]
        found = [_renamed(finding, subject, store, [*found, *gone]) for finding in found]
    else:
        found = [_since(finding, standing) for finding in found]
    found += gone
    return Regressions(
        run=subject.label,
        against=against.label if against else None,
        reason=reason,
        pairs=len(records),
        failing=[record.pair for record in records if record.outcome.bad],
        unjudged=[record.pair for record in records if record.outcome is Outcome.UNJUDGED],
        unable=sum(record.outcome in IDLE for record in records),
        unread=[*why],
        passed_by=[*subject.passed_by],
        time_limit=limit,
        missing_is_failure=missing_is_failure,
        findings=[each for each in found if each.pair not in accepted or not each.kind.regression],
        changes=changes(subject.facts, against.facts) if against else [],
        steps=standing + over,
        loose=loose(around, subject.facts.get("cases", {})),
        accepted=[*accepted.values(), *told],
    )


def time_limit(subject: Subject) -> float:
    """Return the smallest ratio of times that is slower, by the latest runs on the machine."""
    states = subject.states.values()  # a step is no spread
    series = [[time.seconds for time in state.times if not time.slower] for state in states]
    return slowest(series, max(map(len, series), default=0))


def _of_state(finding: Finding, subject: Subject, against: Subject, store: Store) -> Finding:
    """Return the finding with its first run, the run compared with, and the changes between the
    runs where it began.
    """
    base, state = against.bases.get(finding.pair), subject.states.get(finding.pair)
    finding = msgspec.structs.replace(finding, against=base)
    if not finding.kind.regression:
        return finding
    since = (state and state.since(finding)) or subject.number
    other = list[Change]()
    if base is not None and since not in (None, subject.number):
        other = changes(*(store.run(run).circumstances for run in (since, base)))
    return msgspec.structs.replace(finding, since=since, changes=other)


def _around(subject: Subject, store: Store | None) -> History:
    """Return the runs up to the subject that solve and judge as it, including the subject if the
    history has it.
    """
    if store is None:
        return NOTHING
    cases = list(dict.fromkeys(record.case for record in subject.results.records))
    before = subject.before if subject.number is None else subject.number + 1
    return read(store, before=before, last=NIGHTS, cases=cases, like=subject.facts)


def _on_machine(subject: Subject, around: History, *, before: float) -> History:
    """Return the latest runs before a number on the subject's machine."""
    runs = [
        (number, row)
        for number, row in around.runs.items()
        if number < before and same_machine(row.circumstances, subject.facts)
    ]
    latest = dict(runs[-RECENT:])
    pairs = {
        pair: [entry for entry in entries if entry.run in latest]
        for pair, entries in around.pairs.items()
    }
    return History(latest, pairs)


def _accepted(subject: Subject, store: Store | None) -> tuple[dict[Pair, Accepted], list[Accepted]]:
    """Return what was accepted in the run, by pair, and in the last runs of its pairs before it."""
    if store is None:
        return {}, []
    now = accepted_in(store, subject.number) if subject.number is not None else {}
    last = {state.run for state in subject.states.values()}
    earlier = {run: accepted_in(store, run) for run in sorted(last)}
    told = [
        found
        for pair, state in subject.states.items()
        if pair not in now and (found := earlier[state.run].get(pair)) is not None
    ]
    return now, told


def _since(finding: Finding, standing: list[Step]) -> Finding:
    """Return the finding with its first run, if a step gives one."""
    kinds = {Kind.SLOWER: TIME, Kind.FAILURE: OUTCOME, Kind.DRIFTED: finding.motion}
    output = finding.output if finding.kind is Kind.DRIFTED else None
    about = (finding.pair, kinds.get(finding.kind), output)
    for step in standing:
        if (step.pair, step.quantity, step.output) == about:
            return msgspec.structs.replace(finding, since=step.first)
    return finding


def _renamed(finding: Finding, subject: Subject, store: Store, found: Sequence[Finding]) -> Finding:
    """Return the finding of a new pair with the missing pair of equal outputs, if there is one: the
    case may have another name.
    """
    new = next((each for each in subject.results.records if each.pair == finding.pair), None)
    if finding.kind is not Kind.ADDED or new is None or not new.solved:
        return finding
    for gone in found:
        pair = (gone.case, *finding.pair[1:])
        if gone.kind not in (Kind.ABSENT, Kind.LOST) or gone.pair != pair:
            continue
        state = state_before(store, pair, subject.before, subject.facts)
        with store.sparing():
            old = state and base_record(store, state.run, pair, subject.facts)
            if state and old and old.solved and _alike(new, old):
                message = (
                    f"{finding.message}. It looks like {gone.case} of run {state.run}: write"
                    f' formerly = ["{gone.case}"] in the case file to go on with its history'
                )
                return msgspec.structs.replace(finding, message=message)
    return finding


def _alike(a: Record, b: Record) -> bool:
    """Return whether two records have equal samples and outputs, up to last digits."""
    return (
        bool(a.outputs)
        and same_samples(a, b)
        and a.outputs.keys() == b.outputs.keys()
        and all(
            len(each.old) == len(each.new)
            and largest_difference(each.old, each.new) <= UNJUDGED * largest(each.old)
            for each in quantities(a, b)
        )
    )


def _vanished(subject: Subject, last: RunRow | None, store: Store | None) -> list[Finding]:
    """Return the pairs that were worse in the last run of the same selection and are not in this
    one: a fault does not go with its case.
    """
    if store is None:
        return []
    found = vanished(store, last, subject.facts, subject.pairs)
    return [
        Finding(
            kind=Kind.LOST,
            case=case,
            engine=engine,
            mode=mode,
            message=f"not in this run, and not good before: {', '.join(kinds)}",
            since=min(each.since for each in state.open),
            against=state.base,
        )
        for (case, engine, mode), state in found.items()
        for kinds in (dict.fromkeys(each.kind for each in state.open),)
    ]


def _find_missing(
    subject: Subject, last: RunRow | None, findings: Sequence[Finding]
) -> Iterator[Finding]:
    """Yield the missing pairs of the last run of the same selection, whatever run is compared with:
    a case or an engine left out in silence. A run of another selection has another task.
    """
    if last is None:
        return
    known = subject.pairs | {
        each.pair for each in findings if each.kind in (Kind.ABSENT, Kind.LOST)
    }
    why = f"in run {last.id}, by the same command"
    present = present_names(subject.facts)
    for name, engine, mode in last.plan:
        case = present.get(name, name)
        if (case, engine, mode) not in known:
            yield Finding(kind=Kind.ABSENT, case=case, engine=engine, mode=mode, message=why)


def compare(now: Subject, before: Subject, history: History, slowest: float) -> list[Finding]:
    """Return the differences of all pairs, in the order of the records, and then the changes of
    the solutions.

    Args:
        history: runs on the same machine up to the run compared with, which give the usual times.
        slowest: the largest ratio of times that is not reported as slower.
    """
    earlier = {record.pair: record for record in before.results.records}
    findings, solutions = list[Finding](), list[Finding]()
    alike = same_machine(now.facts, before.facts)
    references = (now.results.references, before.results.references)
    for record in {record.pair: record for record in now.results.records}.values():
        old = earlier.pop(record.pair, None)
        if old is None:
            known = record.pair in now.states and record.outcome is Outcome.PASS
            kind = Kind.FIXED if known else Kind.ADDED
            kind = Kind.FAILURE if record.outcome.bad else kind
            findings.append(Finding.of(kind, record, _result(record)))
            continue
        findings += _outcomes(record, old)
        findings += _lost(record, old)
        facts = now.facts.get("cases", {}).get(record.case, {})
        findings += _find_moved(record, old, facts)
        findings += _errors(record, old, facts)
        findings += _references(record, *references, facts)
        state = now.states.get(record.pair)
        if before.bases and state is not None:
            findings += _slower_on_machine(record, state, now, slowest)
        else:
            usual = _usual_times(before, old, history.pairs.get(record.pair, ()), history)
            findings += _slower(record, *usual if alike else (None, usual[1]), now, slowest)
        if old.solved and record.solved:
            solutions += solution_changes(record, old)
    unfinished = set(now.results.missing)
    findings += [
        Finding.of(Kind.ABSENT, old, f"{old.outcome.shown} there")
        for pair, old in earlier.items()
        if pair not in unfinished
    ]
    return findings + solutions


def _result(record: Record) -> str:
    return f"{record.outcome.shown}: {record.message}" if record.message else record.outcome.shown


def _outcomes(now: Record, before: Record) -> Iterator[Finding]:
    old = before.outcome
    if now.outcome.bad and not old.bad:
        yield Finding.of(Kind.FAILURE, now, f"{old.shown} → {_result(now)}")
    elif old.bad and now.outcome is Outcome.PASS:
        yield Finding.of(Kind.FIXED, now, f"{old} → {now.outcome}")
    elif old.judged and now.outcome is Outcome.UNJUDGED:
        yield Finding.of(Kind.UNJUDGED, now, f"{old} → {_result(now)}")
    elif old is Outcome.UNJUDGED and now.outcome is Outcome.PASS:
        yield Finding.of(Kind.JUDGED, now, f"{old.shown} → {now.outcome}")


def _lost(now: Record, before: Record) -> Iterator[Finding]:
    """Yield lost phases, samples, motions and standards."""

    def has_phase(record: Record, phase: str) -> bool:
        return getattr(record.seconds, phase, None) is not None

    phases = [phase for phase in PHASES if has_phase(before, phase) and not has_phase(now, phase)]
    if phases:
        why = f": {_result(now)}" if now.outcome is not Outcome.PASS else ""
        yield Finding.of(Kind.LOST, now, f"{', '.join(phases)} no longer reached{why}")
        return
    if (now.solved or 0) < (before.solved or 0):
        total = "" if now.samples == before.samples else f" of {before.samples}"
        message = f"{now.solved} of {now.samples} samples solved, {before.solved}{total} before"
        yield Finding.of(Kind.LOST, now, message)
    # the whole pair is no longer judged, which is a separate finding
    if now.outcome is Outcome.UNJUDGED:
        return
    for output, old in before.errors.items():
        new = now.errors.get(output)
        lost = [motion for motion, _ in old.items() if getattr(new, motion, None) is None]
        if lost:
            why = f"the case has no output {output!r} now" if new is None else new.reason
            message = f"{output}: {', '.join(lost)} no longer compared: {why or NO_REASON}"
            yield Finding.of(Kind.LOST, now, message, output=output, motion=lost[0])
    if before.validated and not now.validated and now.outcome is Outcome.PASS:
        against, was = (each.truth.replace("_", " ") for each in (now, before))
        why = (
            f"{against}, before {was}"
            if against != was
            else f"{against} whose source is not cited or is kincheck itself"
        )
        yield Finding.of(Kind.LOST, now, f"no longer validated: judged against {why}")


def _find_moved(now: Record, before: Record, facts: Facts) -> Iterator[Finding]:
    """Yield the outputs with changed values or samples, which only this comparison shows if there
    is no reference.
    """
    if not (now.driver and before.driver):
        return
    if not same_samples(now, before):
        yield Finding.of(Kind.MOVED, now, "solved at other values of the drivers than before")
        return
    moved: set[str] = set()
    for each in quantities(now, before):
        if each.judged and not each.judged.within and each.was_judged and each.was_judged.within:
            continue  # a failure, which is reported there
        if each.judged:  # largest distance of two values within the tolerance of one standard
            limit = 2.0 * each.judged.tolerance
        else:  # forces set no scale for lengths
            outputs = (other for other in before.outputs.values() if other.unit == each.unit)
            scale = largest(x for other in outputs for x in values_of(other, each.motion))
            limit = DEFAULT_ATOL + UNJUDGED * scale
        off = largest_difference(each.old, each.new)
        if off > limit and each.output not in moved:
            moved.add(each.output)
            size = shown_text(off, motion_unit(each.unit, each.motion), facts)
            message = f"{each.word} differs by up to {size} from its earlier values"
            yield Finding.of(Kind.MOVED, now, message, now=off, limit=limit, **each.place)


def _errors(now: Record, before: Record, facts: Facts) -> Iterator[Finding]:
    for output, old in before.errors.items():
        for motion in QUANTITIES:
            a, b = getattr(old, motion), getattr(now.errors.get(output), motion, None)
            if a is None or b is None:
                continue
            base = now.outputs[output].unit if output in now.outputs else ""
            word = f"{output} {motion_word(motion, base)}"
            unit = motion_unit(base, motion) if base else ""
            if a.tolerance != b.tolerance:
                yield Finding.of(
                    Kind.TOLERANCE,
                    now,
                    f"{word}: {shown_change(a.tolerance, b.tolerance, unit, facts)}",
                    before=a.tolerance,
                    now=b.tolerance,
                    output=output,
                    motion=motion,
                )
            # an error out of tolerance is a failure, which is reported there
            if (
                b.within
                and a.against == b.against
                and has_drifted(a.max_abs, b.max_abs, b.tolerance)
            ):
                times = f"×{number(b.max_abs / a.max_abs)}, " if a.max_abs else ""
                yield drift(now, output, motion, a.max_abs, b, f" ({times}", facts)


def _references(
    record: Record, now: References, before: References, facts: Facts
) -> Iterator[Finding]:
    """Yield the changed reference values; other findings show new and missing ones."""
    for output, old in before.get(record.case, {}).items():
        new = now.get(record.case, {}).get(output)
        for motion in QUANTITIES:
            was = values_of(old, motion)
            off = largest_difference(was, values_of(new, motion))
            if off > SAME_SAMPLE * largest(was):
                size = shown_text(off, motion_unit(old.unit, motion), facts)
                word = f"{output} {motion_word(motion, old.unit)}"
                message = f"{word} differs by up to {size} from its earlier values"
                about: dict[str, Any] = {"now": off, "output": output, "motion": motion}
                yield Finding.of(Kind.REFERENCE, record, message, **about)
                break


def _usual_times(
    before: Subject, record: Record, entries: Sequence[Entry], history: History
) -> tuple[float | None, float | None]:
    """Return the usual time of a warm solve [s] and in calibration loops of its run.

    It is the median over the latest runs up to the run compared with, whose own noise would affect
    every comparison. With few runs it is the time of this run alone.
    """
    loops = {run: calibration(row.circumstances) for run, row in history.runs.items()}
    times = [(entry.seconds, loops[entry.run]) for entry in entries if entry.seconds][-ENOUGH:]
    if len(times) < ENOUGH:
        seconds = record.seconds and record.seconds.own
        times = [(seconds, calibration(before.facts))] if seconds is not None else []
    in_loops = [seconds / loop for seconds, loop in times if loop]
    return (
        statistics.median(seconds for seconds, _ in times) if times else None,
        statistics.median(in_loops) if in_loops else None,
    )


def _slower(
    now: Record, by_clock: float | None, by_loop: float | None, subject: Subject, limit: float
) -> Iterator[Finding]:
    """Yield a finding if a solve is slower by the clock and by the calibration loop. One of the two
    alone may be due to the machine.
    """
    seconds = now.seconds and now.seconds.own
    loop = calibration(subject.facts)
    expected = [by_clock] if by_clock else []
    expected += [by_loop * loop] if by_loop and loop else []
    if seconds is None or not expected:
        return
    should = max(expected)
    if seconds > limit * should and seconds - should > TIME_FLOOR:
        ratio = seconds / should
        spread = f"×{number(ratio)}: by the spread from run to run, ×{number(limit)} may be chance"
        message = f"{number(1e3 * should)} → {number(1e3 * seconds)} ms a sweep ({spread})"
        about = {"before": should, "now": seconds, "ratio": ratio, "limit": limit}
        yield Finding.of(Kind.SLOWER, now, message, **about)


def _slower_on_machine(
    now: Record, state: State, subject: Subject, limit: float
) -> Iterator[Finding]:
    """Yield a finding if a solve is slower than the latest good ones of the pair on the machine.

    On a machine without any, a pair that was slower before still is.
    """
    good = [time for time in state.times if not time.slower][-ENOUGH:]
    open_since = [each.since for each in state.open if each.kind is Kind.SLOWER]
    if not good or now.seconds is None or now.seconds.own is None:
        if open_since and now.solved:
            message = f"slower in run {state.run}, and no good time on this machine to compare with"
            yield Finding.of(Kind.SLOWER, now, message)
        return
    in_loops = [time.seconds / time.loop for time in good if time.loop]
    usual = statistics.median(time.seconds for time in good)
    # the spread of so few times is unknown; what was slower must be seen to be good again
    limit = limit if open_since or len(good) >= ENOUGH else limit**2
    yield from _slower(
        now, usual, statistics.median(in_loops) if in_loops else None, subject, limit
    )


def loose(history: History, cases: Facts) -> list[Loose]:
    """Return the outputs whose errors stayed far below their tolerances in all runs, by case.

    Args:
        cases: the facts of each case from a run's circumstances, for the reasons of its tolerances.
    """
    ratios: dict[tuple[str, str], dict[int, float]] = {}
    for (case, _, _), entries in history.pairs.items():
        for entry in entries:
            for output, deviations in entry.errors.items():
                for _, each in deviations.items():
                    ratio = each.max_abs / each.tolerance if each.tolerance else 1.0
                    by_run = ratios.setdefault((case, output), {})
                    by_run[entry.run] = max(ratio, by_run.get(entry.run, 0.0))
    found: list[Loose] = []
    for (case, output), by_run in sorted(ratios.items()):
        largest = max(by_run.values())
        if largest * LOOSE < 1.0 and len(by_run) >= SEEN:
            facts = cases.get(case, {}).get("outputs", {}).get(output, {})
            found.append(
                Loose(
                    case=case,
                    output=output,
                    runs=len(by_run),
                    largest=largest,
                    factor=1.0 / (HEADROOM * largest) if largest else None,
                    why=str(facts.get("why", "")),
                )
            )
    return found
