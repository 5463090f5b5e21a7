"""Running: every case with every engine, each pair judged and timed, exactly one record per pair."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from datetime import UTC, datetime
from time import perf_counter
from typing import Any

import msgspec
import numpy as np

from ..errors import CaseError
from .attempt import Answer, Attempt, Facts, Failure, Pair, Solver, here, said
from .case import Case, Series, Truth
from .circumstances import results, truth_of
from .compare import NOTHING, as_numbers, describe, deviations
from .engine import Engine
from .evidence import evidence
from .record import Deviations, Outcome, OutputSeries, Record, Results, Seconds

NATIVE = "native"
"""Name of the engine that stands in where a case has no reference."""

UNTOLD = {
    "residual_max": "no sample was solved",
    "rank": "the engine does not tell it",
    "dof": "the engine does not tell it",
    "iterations": "no sample was solved",
    "us_per_step": "known only where all samples are solved, and solved again for the time",
}
"""Why a number of a record is null, by its key, where the engine has answered."""

Progress = Callable[[Record, int, int], None]
"""Told of each record as it is made, how many there are now, and how many there will be."""


@dataclass(frozen=True, eq=False)
class _Standard:
    """The native engine's outputs to compare with where a case has no reference; none, and why, where there are none."""

    outputs: Mapping[str, Series]
    absent: str = ""


@dataclass(eq=False)
class _Judging:
    """A case being judged: what to compare with, None until the native engine is through, and the pairs that wait for it."""

    standard: _Standard | None
    waiting: list[tuple[Pair, Attempt]] = field(default_factory=list[tuple[Pair, Attempt]])


def run(
    cases: Sequence[Case],
    engines: Sequence[Engine],
    *,
    tol: float,
    progress: Progress | None = None,
    baseline: Engine | None = None,
    command: str = "",
    solver: Solver = here,
    made: Sequence[Record] = (),
    facts: Mapping[str, Any] | None = None,
    unread: Sequence[str] = (),
) -> Results:
    """Solve every case with every engine and judge each answer.

    An output is judged against the case's reference; what the reference does not have (an output, its velocity or acceleration)
    is compared with the native engine's, and where that is missing too, with nothing, which the record says. The records are in
    the order of cases and engines, the native engine first, whatever the order in which the solver is through with them.

    Args:
        tol: largest accepted constraint residual, as for `Engine.solve`.
        baseline: the native engine, to compare with, where it is not among the engines; it gets no records.
        command: the command line, kept with the results.
        solver: where pairs are solved: in this process, in worker processes, on a cluster.
        made: records made earlier, by a run of the same cases and engines; their pairs are not solved again.
        facts: further circumstances, kept with the results; they come before those of now.
        unread: names of cases that were asked for and make no sense; their pairs are among those that are missing.

    Raises:
        CaseError: two cases share their name, or two engines theirs and the mode: records go by names.
    """
    started = datetime.now(UTC)
    _distinct("cases", [case.name for case in cases])
    _distinct("engines", [f"{engine.name} ({engine.mode})" for engine in engines])
    records = {_key(record): record for record in made}
    ordered = sorted(engines, key=_native_first)
    wanted = planned(cases, engines)
    judging = {case.name: _Judging(_standard_known(case, ordered, baseline, records)) for case in cases}
    pairs = [Pair(case, engine, tol) for case, engine in _to_solve(cases, ordered, baseline, records, judging)]

    def judge(pair: Pair, attempt: Attempt, standard: _Standard) -> Record:
        record = _record(pair, attempt, standard)
        if pair.engine is not baseline:
            records[_key(record)] = record
            if progress is not None:
                progress(record, len(records), len(wanted))
        return record

    with closing(solver(pairs)) as attempts:
        for index, attempt in attempts:
            pair, case = pairs[index], judging[pairs[index].case.name]
            if pair.engine.name == NATIVE:
                case.standard = _standard(judge(pair, attempt, _Standard({}, "no reference: compared with nothing")))
                for each in case.waiting:
                    judge(*each, case.standard)
            elif case.standard is None:
                case.waiting.append((pair, attempt))
            else:
                judge(pair, attempt, case.standard)
    found, asked = [records[key] for key in wanted], planned(cases, engines, unread)
    return results(cases, found, started=started, tol=tol, command=command, facts=facts, plan=asked)


def _distinct(what: str, names: Sequence[str]) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise CaseError(f"run: there are two {what} named {twice[0]!r}; results go by name: rename one, or leave it out")


def planned(cases: Sequence[Case], engines: Sequence[Engine], unread: Sequence[str] = ()) -> list[tuple[str, str, str]]:
    """Case, engine and mode of every pair, in the order of the records; last those of cases that cannot be read."""
    names = [*(case.name for case in cases), *unread]
    return [(name, engine.name, engine.mode) for name in names for engine in sorted(engines, key=_native_first)]


def _native_first(engine: Engine) -> bool:
    return engine.name != NATIVE


def _key(record: Record) -> tuple[str, str, str]:
    return record.case, record.engine, record.mode


def _to_solve(
    cases: Sequence[Case],
    engines: Sequence[Engine],
    baseline: Engine | None,
    made: Mapping[tuple[str, str, str], Record],
    judging: Mapping[str, _Judging],
) -> Iterator[tuple[Case, Engine]]:
    """Every pair that has no record, and the baseline where it is to be compared with."""
    for case in cases:
        missing = [engine for engine in engines if (case.name, engine.name, engine.mode) not in made]
        if baseline is not None and missing and judging[case.name].standard is None:
            yield case, baseline
        yield from ((case, engine) for engine in missing)


def _standard_known(
    case: Case, engines: Sequence[Engine], baseline: Engine | None, made: Mapping[tuple[str, str, str], Record]
) -> _Standard | None:
    """What to compare with, if it is known before anything is solved."""
    # of data of others it has to be known whether they are native's own
    if _referenced(case) and case.truth is not Truth.THIRD_PARTY_DATA:
        return _Standard({})
    native = next((engine for engine in engines if engine.name == NATIVE), None)
    if native is not None:
        record = made.get((case.name, native.name, native.mode))
        return None if record is None else _standard(record)
    if baseline is not None:
        return None
    return _Standard({}, "no reference, and the native engine is not in this run: compared with nothing")


def _referenced(case: Case) -> bool:
    """Whether the case's reference has everything there is to compare."""
    return all(
        (series := case.reference.get(output.name)) is not None
        and all(each is not None for each in (series.position, series.velocity, series.acceleration)[: output.orders])
        for output in case.outputs
    )


def _standard(native: Record) -> _Standard:
    if not native.outputs:
        return _Standard({}, f"no reference, and the native engine has no answer ({native.message}): compared with nothing")
    return _Standard({name: _series(output) for name, output in native.outputs.items()})


def _series(output: OutputSeries) -> Series:
    """What `as_numbers` wrote down, without loss: NaN for null."""
    rates = [None if each is None else np.array(each, dtype=np.float64) for each in (output.velocity, output.acceleration)]
    return Series(np.array(output.position, dtype=np.float64), *rates)


def _record(pair: Pair, attempt: Attempt, native: _Standard) -> Record:
    """The record of one pair."""
    case, engine = pair.case, pair.engine
    facts = attempt.facts or Facts("unknown")
    result = attempt.result
    if isinstance(result, Answer):
        try:
            return _judged(case, engine, facts, result, attempt.seconds or Seconds(), native)
        except Exception as error:  # a reference that does not fit, for one
            result = Failure(Outcome.ERROR, said(error))
    nothing = Deviations(position=None, velocity=None, acceleration=None, reason=f"{result.outcome}: {result.message}")
    return _made(
        case,
        engine,
        facts,
        outcome=result.outcome,
        message=result.message,
        errors={output.name: nothing for output in case.outputs},
        evidence=evidence(case, native.outputs),
        seconds=attempt.seconds,
        reasons=dict.fromkeys(UNTOLD, f"{result.outcome}: see message"),
        details={"printed": result.printed} if result.printed else {},
    )


def _judged(case: Case, engine: Engine, facts: Facts, answer: Answer, seconds: Seconds, native: _Standard) -> Record:
    begin = perf_counter()
    values = case.sweep.values.tolist()
    solved, samples, found = answer.solved, len(values), answer.outputs
    complete = solved == samples
    errors = {each.name: _deviations(case, each.name, found[each.name], native, complete=complete) for each in case.outputs}
    messages: list[str] = []
    if not complete:
        why = answer.message or "the engine does not say why; ask it to"
        messages.append(f"{solved} of {samples} samples solved: {why}")
    outside = [
        (deviation.max_abs / deviation.tolerance if deviation.tolerance else np.inf, output, quantity, deviation)
        for output, each in errors.items()
        for quantity, deviation in each.items()
        if not deviation.within
    ]
    if outside:
        _, output, quantity, deviation = max(outside, key=lambda each: each[0])
        more = f" (worst of {len(outside)} quantities out of tolerance)" if len(outside) > 1 else ""
        unit = next(each.unit for each in case.outputs if each.name == output)
        messages.append(describe(output, quantity, deviation, case.sweep.driver, values, unit) + more)
    # with no value at all there is nothing to be out of tolerance
    messages += [f"{name}: {each.reason}" for name, each in errors.items() if each.lost and each.within]
    outcome = Outcome.FAIL if messages else Outcome.PASS
    if outcome is Outcome.PASS:
        messages += _not_compared(errors)
    details = dict(answer.details)
    messages += details.pop("notes", [])  # a right answer that passed a singular pose says so
    numbers = {
        "residual_max": answer.residual if solved else None,
        "rank": details.pop("rank", None),
        "dof": details.pop("dof", None),
        "iterations": answer.iterations if solved else None,
        "us_per_step": 1e6 * seconds.warm / samples if complete and seconds.warm is not None else None,
    }
    return _made(
        case,
        engine,
        facts,
        outcome=outcome,
        message="; ".join(messages),
        driver={name: each.tolist() for name, each in case.sweep.moved.items()},
        outputs={output.name: as_numbers(found[output.name], output) for output in case.outputs},
        errors=errors,
        **numbers,
        reasons={key: UNTOLD[key] for key, number in numbers.items() if number is None},
        solved=solved,
        samples=samples,
        seconds=msgspec.structs.replace(seconds, compare=perf_counter() - begin),
        details=details,
        evidence=evidence(case, found if engine.name == NATIVE else native.outputs),
    )


def _not_compared(errors: Mapping[str, Deviations]) -> list[str]:
    """A pass must not hide that there was nothing to be judged by, or not everywhere."""
    wanting = {name: each for name, each in errors.items() if each.position is None or NOTHING in (each.reason or "")}
    reasons = {name: each.reason or "" for name, each in wanting.items()}
    if len(reasons) == len(errors) and len(set(reasons.values())) == 1:
        return [*set(reasons.values())]
    return [f"{name}: {reason}" for name, reason in reasons.items()]


def _deviations(case: Case, name: str, found: Series, native: _Standard, *, complete: bool) -> Deviations:
    output = next(each for each in case.outputs if each.name == name)
    standards = [(str(case.truth), case.reference[name])] if name in case.reference else []
    standards += [(NATIVE, native.outputs[name])] if name in native.outputs else []
    result = deviations(case, output, found, standards, complete=complete)
    if standards or not native.absent:
        return result
    return msgspec.structs.replace(result, reason=native.absent)


def _made(case: Case, engine: Engine, facts: Facts, **result: Any) -> Record:
    return Record(
        case=case.name,
        truth=truth_of(case),
        engine=engine.name,
        mode=engine.mode,
        loop=facts.loop,
        version=facts.version,
        settings=dict(facts.settings),
        **result,
    )
