"""Running: every case with every engine, each pair judged and timed, exactly one record per pair."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from time import perf_counter
from typing import Any

import msgspec
import numpy as np

from ..errors import KincheckError
from ..trajectory import Array, Trajectory
from .case import Case, Series
from .circumstances import plain, readable, results, truth_of
from .compare import as_numbers, describe, deviations, output_series
from .engine import Engine
from .record import Deviations, Outcome, Record, Results, Seconds

NATIVE = "native"
"""Name of the engine that stands in where a case has no reference."""

# Enough solves for a median that one interruption cannot move; slow engines stop after the budget [s].
WARM_SOLVES = 5
WARM_BUDGET = 0.5

Progress = Callable[[Record, int, int], None]
"""Told of each record as it is made, how many there are now, and how many there will be."""


class BadTrajectoryError(KincheckError):
    """An engine's answer is not what the engine protocol promises."""


@dataclass(frozen=True, eq=False)
class _Answer:
    """What an engine made of a case."""

    trajectory: Trajectory
    outputs: Mapping[str, Series]
    seconds: Seconds


@dataclass(frozen=True, eq=False)
class _Standard:
    """The native engine's outputs to compare with where a case has no reference; none, and why, where there are none."""

    outputs: Mapping[str, Series]
    absent: str = ""


def run(
    cases: Sequence[Case],
    engines: Sequence[Engine],
    *,
    tol: float,
    progress: Progress | None = None,
    baseline: Engine | None = None,
    command: str = "",
) -> Results:
    """Solve every case with every engine and judge each answer.

    An output is judged against the case's reference; what the reference does not have (an output, its velocity or acceleration)
    is compared with the native engine's, and where that is missing too, with nothing, which the record says.

    Args:
        tol: largest accepted constraint residual, as for `Engine.solve`.
        baseline: the native engine, to compare with, where it is not among the engines; it gets no records.
        command: the command line, kept with the results.
    """
    started = datetime.now(UTC)
    records: list[Record] = []
    for case in cases:
        native = _Standard({}, "no reference, and the native engine is not in this run: compared with nothing")
        if baseline is not None and not _referenced(case):
            native = _standard(*_attempt(case, baseline, tol, native))
        for engine in sorted(engines, key=lambda each: each.name != NATIVE):
            if engine.name == NATIVE:
                native = _Standard({}, "no reference: compared with nothing")
            record, answer = _attempt(case, engine, tol, native)
            if engine.name == NATIVE:
                native = _standard(record, answer)
            records.append(record)
            if progress is not None:
                progress(record, len(records), len(cases) * len(engines))
    return results(cases, records, started=started, tol=tol, command=command)


def _referenced(case: Case) -> bool:
    """Whether the case's reference has everything there is to compare."""
    return all(
        output.name in case.reference
        and case.reference[output.name].velocity is not None
        and case.reference[output.name].acceleration is not None
        for output in case.outputs
    )


def _standard(record: Record, answer: _Answer | None) -> _Standard:
    if answer is None:
        return _Standard({}, f"no reference, and the native engine has no answer ({record.message}): compared with nothing")
    return _Standard(answer.outputs)


def _attempt(case: Case, engine: Engine, tol: float, native: _Standard) -> tuple[Record, _Answer | None]:
    """The record of one pair, and the answer where there is one. Whatever an engine raises becomes a record."""
    version: str | None = None

    def without(outcome: Outcome, message: str) -> tuple[Record, None]:
        nothing = Deviations(position=None, velocity=None, acceleration=None, reason=f"{outcome}: {message}")
        errors = {output.name: nothing for output in case.outputs}
        return _record(case, engine, version, outcome=outcome, message=message, errors=errors), None

    try:
        version = engine.version()
        if version is None:
            return without(Outcome.UNAVAILABLE, f"{engine.name} is not installed")
        reason = engine.unsupported(case)
        if reason is not None:
            return without(Outcome.UNSUPPORTED, reason)
        answer = _solve(case, engine, tol)
        return _judged(case, engine, version, answer, native), answer
    except Exception as error:  # anything a simulator may raise; KeyboardInterrupt is none of these
        return without(Outcome.ERROR, readable(f"{type(error).__name__}: {error}"))


def _solve(case: Case, engine: Engine, tol: float) -> _Answer:
    """Build once, solve, and solve again for the time. The answer kept is the last: the one that was timed."""
    begin = perf_counter()
    model = engine.build(case)
    build = perf_counter() - begin

    def solve() -> tuple[Trajectory, float]:
        begin = perf_counter()
        trajectory = engine.solve(model, case, tol)
        seconds = perf_counter() - begin
        check(case, engine.name, trajectory)
        return trajectory, seconds

    _, first = solve()  # may load and compile
    trajectory, seconds = solve()
    warm = [seconds]
    while len(warm) < WARM_SOLVES and sum(warm) + warm[-1] <= WARM_BUDGET:
        trajectory, seconds = solve()
        warm.append(seconds)
    outputs = {output.name: output_series(case, output, trajectory) for output in case.outputs}
    return _Answer(trajectory, outputs, Seconds(build=build, first=first, warm=statistics.median(warm)))


def check(case: Case, engine: str, trajectory: Trajectory) -> None:
    """Hold an answer to the engine protocol.

    Raises:
        BadTrajectoryError: a point is missing, a shape is wrong, or a sample that is called solved is not finite.
    """
    n = len(case.sweep.values)
    for name in ("solved", "iterations"):
        _check_shape(f"{engine}: {name}", getattr(trajectory, name), (n,))
    solved = np.asarray(trajectory.solved, dtype=np.bool_)
    if solved.any() and not np.isfinite(trajectory.residual):
        raise BadTrajectoryError(f"{engine}: residual is {trajectory.residual} although {solved.sum()} samples are called solved")
    for point in case.points:
        if point not in trajectory.points:
            raise BadTrajectoryError(f"{engine}: no motion of point {point!r}; found: {', '.join(trajectory.points) or 'none'}")
        motion = trajectory.points[point]
        for quantity in ("position", "velocity", "acceleration"):
            values: Array | None = getattr(motion, quantity)
            if values is None and quantity != "position":
                continue
            _check_shape(f"{engine}: {quantity} of point {point!r}", values, (n, 3))
            finite = np.isfinite(np.asarray(values, dtype=np.float64)).all(axis=1)
            bad = np.flatnonzero(solved & ~finite)
            if bad.size:
                raise BadTrajectoryError(
                    f"{engine}: {quantity} of point {point!r} is {np.asarray(values)[bad[0]].tolist()} at sample {bad[0]} "
                    f"({case.sweep.driver} = {case.sweep.values[bad[0]]:.9g}), which is called solved; "
                    f"{bad.size} of {n} samples are so: mark them unsolved and explain, or give finite numbers"
                )


def _check_shape(what: str, values: Any, expected: tuple[int, ...]) -> None:
    if np.shape(values) != expected:
        raise BadTrajectoryError(f"{what} has shape {np.shape(values)}, expected {expected}")


def _judged(case: Case, engine: Engine, version: str, answer: _Answer, native: _Standard) -> Record:
    trajectory, values = answer.trajectory, case.sweep.values.tolist()
    errors = {output.name: _deviations(case, output.name, answer.outputs[output.name], native) for output in case.outputs}
    solved, samples = int(trajectory.solved.sum()), len(values)
    messages: list[str] = []
    if solved < samples:
        why = trajectory.message or "the engine does not say why; ask it to"
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
        messages.append(describe(output, quantity, deviation, case.sweep.driver, values) + more)
    outcome = Outcome.FAIL if messages else Outcome.PASS
    if outcome is Outcome.PASS:
        messages += _not_compared(errors)
    details = plain(trajectory.details)
    return _record(
        case,
        engine,
        version,
        outcome=outcome,
        message="; ".join(messages),
        driver={name: each.tolist() for name, each in case.sweep.moved.items()},
        outputs={output.name: as_numbers(answer.outputs[output.name], output) for output in case.outputs},
        errors=errors,
        residual_max=float(trajectory.residual) if solved else None,
        rank=details.pop("rank", None),
        dof=details.pop("dof", None),
        iterations=int(np.asarray(trajectory.iterations)[trajectory.solved].sum()) if solved else None,
        solved=solved,
        samples=samples,
        seconds=answer.seconds,
        us_per_step=1e6 * (answer.seconds.warm or 0.0) / samples if solved == samples else None,
        details=details,
    )


def _not_compared(errors: Mapping[str, Deviations]) -> list[str]:
    """A pass must not hide that there was nothing to be judged by."""
    reasons = {name: each.reason or "" for name, each in errors.items() if each.position is None}
    if len(reasons) == len(errors) and len(set(reasons.values())) == 1:
        return [*set(reasons.values())]
    return [f"{name}: {reason}" for name, reason in reasons.items()]


def _deviations(case: Case, name: str, found: Series, native: _Standard) -> Deviations:
    output = next(each for each in case.outputs if each.name == name)
    standards = [(str(case.truth), case.reference[name])] if name in case.reference else []
    standards += [(NATIVE, native.outputs[name])] if name in native.outputs else []
    result = deviations(case, output, found, standards)
    if standards or not native.absent:
        return result
    return msgspec.structs.replace(result, reason=native.absent)


def _record(case: Case, engine: Engine, version: str | None, **result: Any) -> Record:
    return Record(
        case=case.name,
        truth=truth_of(case),
        engine=engine.name,
        mode=engine.mode,
        loop=engine.loop,
        version=version,
        settings=plain(engine.settings),
        **result,
    )
