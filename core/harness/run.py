"""The run: every case in every engine, one record per pair, judged and timed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import msgspec

from ..case.case import Case, Truth
from ..errors import CaseError
from .compare import as_numbers
from .engine import STANDARD, Engine, untimed
from .execution import Answer, Attempt, Facts, Failure, Pair, Solver, error_text, solve_in_process
from .provenance import results, truth_of
from .record import Deviations, Evidence, Outcome, Record, Results, Seconds
from .table_units import table_facts
from .verdict import (
    Standard,
    Verdict,
    evidence,
    has_everything,
    judge_answer,
    residual_limit,
    standard_of,
)

NULL_REASONS = {
    "residual_max": "no sample was solved, or the engine has none",
    "rank": "the engine does not report it",
    "dof": "the engine does not report it",
    "iterations": "no sample was solved",
    "us_per_step": "measured only if all samples are solved, by a second solve",
}
"""Reasons for null numbers in the record of an answer, by key."""

Progress = Callable[[Record, int, int], None]
"""Called with each new record, the number of records so far, and their final number."""


@dataclass(eq=False)
class _Judging:
    """A case being judged.

    Attributes:
        standard: None until the native engine has finished.
        waiting: pairs waiting for the standard.
    """

    standard: Standard | None
    waiting: list[tuple[Pair, Attempt]] = field(default_factory=list[tuple[Pair, Attempt]])


def run(
    cases: Sequence[Case],
    engines: Sequence[Engine],
    *,
    tol: float,
    progress: Progress | None = None,
    baseline: Engine | None = None,
    command: str = "",
    solver: Solver = solve_in_process,
    made: Sequence[Record] = (),
    facts: Mapping[str, Any] | None = None,
    unread: Sequence[str] = (),
    residuals: bool = True,
) -> Results:
    """Solve every case with every engine and judge each answer.

    An output is judged against the case's reference. An output, velocity or acceleration missing
    in the reference is compared with the native engine's. A pair that nothing can be compared with
    is `unjudged`, like the native engine on a case without a reference. An engine fails if it has
    values at samples that neither the reference nor the native engine reaches.

    The records keep the order of cases and engines, the native engine first, whatever the order in
    which the solver finishes.

    Args:
        tol: largest accepted constraint residual, as for `Engine.solve`.
        baseline: the native engine as a standard, if it is not among the engines; it gets no
            records.
        command: the command line, kept with the results.
        solver: solves the pairs: in this process, in worker processes, on a cluster.
        made: records of an earlier run of the same cases and engines, whose pairs are not solved
            again.
        facts: further circumstances, kept with the results; they replace the present ones.
        unread: names of unreadable requested cases; their pairs count as missing.
        residuals: whether an engine in projection mode fails if a solved sample has a residual
            above `tol`; False for efforts that leave a residual on purpose.

    Raises:
        CaseError: two cases have the same name, or two engines the same name and mode; names
            identify records.
    """
    started = datetime.now(UTC)
    _distinct("cases", [case.name for case in cases])
    _distinct("engines", [f"{engine.name} ({engine.mode})" for engine in engines])
    records = {record.pair: record for record in made}
    ordered = sorted(engines, key=_standard_first)
    wanted = plan_pairs(cases, engines)
    judging = {
        case.name: _Judging(_standard_known(case, ordered, baseline, records)) for case in cases
    }
    pairs = [
        Pair(case, engine, tol, timed=not untimed(engine))
        for case, engine in _to_solve(cases, ordered, baseline, records, judging)
    ]

    def judge(pair: Pair, attempt: Attempt, standard: Standard) -> Record:
        record = _record(pair, attempt, standard, residuals=residuals)
        if pair.engine is not baseline:
            records[record.pair] = record
            if progress is not None:
                progress(record, len(records), len(wanted))
        return record

    with closing(solver(pairs)) as attempts:
        for index, attempt in attempts:
            pair, case = pairs[index], judging[pairs[index].case.name]
            if pair.engine.name == STANDARD:
                case.standard = standard_of(judge(pair, attempt, Standard({})))
                for each in case.waiting:
                    judge(*each, case.standard)
            elif case.standard is None:
                case.waiting.append((pair, attempt))
            else:
                judge(pair, attempt, case.standard)
    found, requested = [records[key] for key in wanted], plan_pairs(cases, engines, unread)
    native = {name: each.standard.outputs for name, each in judging.items() if each.standard}
    return results(
        cases,
        found,
        started=started,
        tol=tol,
        command=command,
        facts=facts,
        plan=requested,
        native=native,
    )


def _distinct(what: str, names: Sequence[str]) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise CaseError(
            f"run: there are two {what} named {twice[0]!r}; names identify results: rename one, or"
            " leave it out"
        )


def plan_pairs(
    cases: Sequence[Case], engines: Sequence[Engine], unread: Sequence[str] = ()
) -> list[tuple[str, str, str]]:
    """Return case, engine and mode of every pair in the order of records, unread cases last."""
    names = [*(case.name for case in cases), *unread]
    return [
        (name, engine.name, engine.mode)
        for name in names
        for engine in sorted(engines, key=_standard_first)
    ]


def _standard_first(engine: Engine) -> bool:
    return engine.name != STANDARD


def _to_solve(
    cases: Sequence[Case],
    engines: Sequence[Engine],
    baseline: Engine | None,
    made: Mapping[tuple[str, str, str], Record],
    judging: Mapping[str, _Judging],
) -> Iterator[tuple[Case, Engine]]:
    """Yield every pair without a record, and the baseline pair if the standard is needed."""
    for case in cases:
        missing = [
            engine for engine in engines if (case.name, engine.name, engine.mode) not in made
        ]
        if baseline is not None and missing and judging[case.name].standard is None:
            yield case, baseline
        yield from ((case, engine) for engine in missing)


def _standard_known(
    case: Case,
    engines: Sequence[Engine],
    baseline: Engine | None,
    made: Mapping[tuple[str, str, str], Record],
) -> Standard | None:
    """Return the standard of a case if it is known before anything is solved."""
    # third-party data must first be checked: they must not equal native's result
    if has_everything(case) and case.truth is not Truth.THIRD_PARTY_DATA:
        return Standard({})
    native = next((engine for engine in engines if engine.name == STANDARD), None)
    if native is not None:
        record = made.get((case.name, native.name, native.mode))
        return None if record is None else standard_of(record)
    if baseline is not None:
        return None
    return Standard({}, ", and the native engine is not in this run")


def _record(pair: Pair, attempt: Attempt, native: Standard, *, residuals: bool) -> Record:
    """Return the record of one pair."""
    case, engine = pair.case, pair.engine
    facts = attempt.facts or Facts("unknown")
    result = attempt.result
    if isinstance(result, Answer):
        tol = residual_limit(engine, pair.tol) if residuals else math.inf
        try:
            verdict = judge_answer(case, result, native, tol)
            found = result.outputs if engine.name == STANDARD else native.outputs
            own = evidence(case, found)
            return _answer_record(
                case, engine, facts, result, attempt.seconds or Seconds(), verdict, own
            )
        except Exception as error:  # for example, an unsuitable reference
            result = Failure(Outcome.ERROR, error_text(error))
    nothing = Deviations(
        position=None,
        velocity=None,
        acceleration=None,
        reason=f"{result.outcome}: {result.message}",
    )
    return _make_record(
        case,
        engine,
        facts,
        outcome=result.outcome,
        message=result.message,
        errors={output.name: nothing for output in case.outputs},
        evidence=evidence(case, native.outputs),
        seconds=attempt.seconds,
        reasons=dict.fromkeys(NULL_REASONS, f"{result.outcome}: see message"),
        details={"printed": result.printed} if result.printed else {},
    )


def _answer_record(
    case: Case,
    engine: Engine,
    facts: Facts,
    answer: Answer,
    seconds: Seconds,
    verdict: Verdict,
    own: Evidence | None,
) -> Record:
    """Return the record of an answer."""
    solved, samples = answer.solved, len(case.sweep.values)
    details = dict(answer.details)
    # a correct answer may have notes too, for example on a singular pose it passed
    messages = [*verdict.messages, *details.pop("notes", [])]
    if solved == samples and answer.message:  # on forces; else the verdict has it
        messages.append(answer.message)
    numbers = {
        "residual_max": answer.residual if solved and answer.residual == answer.residual else None,
        "rank": details.pop("rank", None),
        "dof": details.pop("dof", None),
        "iterations": answer.iterations if solved else None,
        "us_per_step": (
            1e6 * seconds.own / samples if solved == samples and seconds.own is not None else None
        ),
    }
    return _make_record(
        case,
        engine,
        facts,
        outcome=verdict.outcome,
        message="; ".join(messages),
        faults=list(verdict.faults),
        driver={name: each.tolist() for name, each in case.sweep.moved.items()},
        outputs={
            output.name: as_numbers(answer.outputs[output.name], output) for output in case.outputs
        },
        errors=dict(verdict.errors),
        **numbers,
        reasons={key: NULL_REASONS[key] for key, number in numbers.items() if number is None},
        solved=solved,
        samples=samples,
        seconds=msgspec.structs.replace(seconds, compare=verdict.seconds),
        details=details,
        evidence=own,
    )


def _make_record(case: Case, engine: Engine, facts: Facts, **result: Any) -> Record:
    return Record(
        case=case.name,
        truth=truth_of(case),
        table={**table_facts(case)} or msgspec.UNSET,
        engine=engine.name,
        mode=engine.mode,
        loop=facts.loop,
        version=facts.version,
        settings=dict(facts.settings),
        **result,
    )
