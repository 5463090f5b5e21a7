"""Check of an engine from outside against the engine protocol.

The engine solves a probe of every joint type, with and without loads, mechanisms of several
topologies, a motion up to a fold and a joint that no engine knows, always in a worker process. Each
check is a row of the report: the worst number, the limit with its reason, the place.
"""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np

from ...case.case import TIME, Case
from ...case.joint_probe import probe, probes
from ...errors import shortened
from ...harness.engine import STANDARD, Engine, runs_in_process, versions
from ...harness.execution import (
    Answer,
    Attempt,
    Attempts,
    Pair,
    Solver,
    error_text,
    solve_in_process,
)
from ...harness.record import Outcome, Record
from ...harness.resource_limits import Limits
from ...harness.run import Progress, run
from ...harness.verdict import NAMED
from ...harness.workers.pool import in_workers
from ...joints import Revolute
from ...studies.checks.findings import (
    Finding,
    Limit,
    Report,
    Verdict,
    agreement,
    fault_finding,
    judge_figures,
    skip,
)
from ...trajectory import QUANTITIES, Array
from .engine_cases import UnknownJoint, at_rate, force_cases, uneven_drives

Values: TypeAlias = Sequence[float | None] | None

# Weights of sixth-order differences over seven samples.
WEIGHTS = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0
NOISE = 1e-9
"""Error of the compared values relative to the largest: a thousand times the residual tolerance."""
RATES = Limit(1.0, "over the change of the differences with a doubled step")


def rates(solved: Sequence[tuple[Case, Record]]) -> Iterator[Finding]:
    """Yield the worst defect of velocity and of acceleration, against differences of what they are
    the rate of, over all cases.

    Only uniform sweeps of one driver count: others have motions with corners.
    """
    for before, after in pairwise(QUANTITIES):
        shares = [
            (share, f"{case.name}: {name}")
            for case, record in solved
            if (dt := _step(case)) is not None and record.solved == record.samples
            for name, output in record.outputs.items()
            if (share := _share(getattr(output, before), getattr(output, after), dt)) is not None
        ]
        if not shares:
            yield skip(f"rates: {after}", "the engine gives none")
            continue
        worst, where = max(shares, key=lambda each: each[0])
        remedy = f"is not the rate of its {before}"
        found = judge_figures(f"rates: {after}", np.array([worst]), RATES, [where], remedy=remedy)
        yield replace(found, pose=None)


def _step(case: Case) -> float | None:
    """Return the time between samples [s]; None if the sweep is short, uneven or has several
    drivers.
    """
    steps = np.diff(case.sweep.path.times)
    if case.sweep.driver == TIME or case.sweep.motions or len(steps) < 3 * len(WEIGHTS):
        return None
    even = np.allclose(steps, steps[0], rtol=1e-9, atol=0.0)
    return float(steps[0]) if even else None


def _share(before: Values, after: Values, dt: float) -> float | None:
    """Return the defect of a rate over its limit; None if there is nothing to compare."""
    if before is None or after is None or None in before or None in after:
        return None
    position, rate = (np.array(values, dtype=np.float64) for values in (before, after))
    slopes, coarse = _differences(position, dt), _differences(position[::2], 2.0 * dt)
    noise = NOISE * (float(np.abs(position).max()) + abs(dt)) / abs(dt)
    limit = float(np.abs(coarse - slopes[3::2][: len(coarse)]).max()) + noise
    return float(np.abs(slopes - rate[3:-3]).max()) / limit


def _differences(values: Array, dt: float) -> Array:
    """Return differences of values at equal steps, without the first and last three samples."""
    windows = np.lib.stride_tricks.sliding_window_view(values, len(WEIGHTS))
    return np.asarray(windows @ WEIGHTS / dt)


def faults_of_forces(case: Case, mode: str, attempt: Attempt, native: Attempt) -> Iterator[str]:
    """Yield faults in the forces of an answer beside their values.

    An engine may leave out the reactions of joints for which it solves others. A simulation need
    not give forces.

    Args:
        native: the native engine's attempt at the same case.
    """
    found, right = attempt.result, native.result
    if not (case.forces and isinstance(found, Answer) and isinstance(right, Answer)):
        return
    replaced = {joint.name for joint in case.mechanism.joints if "equivalents" in found.details}
    outputs = [output for output in case.outputs if output.forces]
    lacking = [
        output.name
        for output in outputs
        if not found.outputs[output.name].possible and not replaced.issuperset(output.forces)
    ]
    if lacking and not (mode == "simulate" and found.power is None):
        yield (
            f"gives no {shortened(lacking, NAMED)}: return them in Trajectory.forces, or let"
            " unsupported() refuse cases with such outputs"
        )
    loose = [
        output.name
        for output in outputs
        if right.outputs[output.name].reason
        and np.isfinite(found.outputs[output.name].position).any()
    ]
    if loose:
        yield (
            f"gives values of {shortened(loose, NAMED)}, which rigid bodies leave undetermined:"
            " Reaction.free is to hold the undetermined directions"
        )
    if found.power is not None and right.power is not None:
        missing = np.isfinite(right.power) & np.isnan(found.power)
        if missing.any():
            yield (
                f"gives no balance of power at {missing.sum()} of {len(missing)} samples:"
                " Forces.power is the drivers' power less the change of energy and the dissipation"
            )


MODES = ("projection", "simulate")
LOOPS = ("python", "simulator", "compiled")
REACH = np.linspace(-3.0, 3.0, 61)
"""Angles of the probe of a revolute joint [rad]; rods lock it at -1.8 and 2.4."""
AGREE_WHY = "largest error over the tolerance of its output"
SAME = Limit(0.0, "the same bits from a new model, in another process and order")
UNREACHED = Limit(0.0, "values at samples that cannot be reached")
VERDICTS = {
    Outcome.PASS: Verdict.PASS,
    Outcome.UNSUPPORTED: Verdict.SKIP,
    Outcome.UNJUDGED: Verdict.SKIP,
}
BEYOND, UNKNOWN = "refusal: beyond a fold", "refusal: unknown joint"


def check_engine(
    engine: Engine,
    native: Engine,
    topologies: Mapping[str, Case],
    *,
    tol: float,
    progress: Progress | None = None,
) -> Report:
    """Examine an engine.

    Args:
        native: the native engine, the standard of cases without a reference.
        topologies: further cases, by a word on their structure.
        tol: largest accepted constraint residual, as for `Engine.solve`.
        progress: called with each record.
    """
    found = [*_protocol(engine)]
    if any(each.verdict is Verdict.FAIL for each in found):
        return Report(str(engine.name), (), None, tuple(found))
    refused = {BEYOND: _beyond(), UNKNOWN: probe(UnknownJoint)}
    cases = {f"joint: {case.name}": at_rate(case) for case in probes()}
    cases |= {f"topology: {word}": case for word, case in topologies.items()}
    cases |= {"topology: uneven drives": uneven_drives()}
    cases |= {f"forces: {word}": case for word, case in force_cases()}
    solver = in_workers(1, Limits())
    answers: dict[str, dict[str, Attempt]] = {engine.name: {}, STANDARD: {}}

    def keep_answers(pairs: Sequence[Pair]) -> Attempts:
        for index, attempt in solver(pairs):
            answers[pairs[index].engine.name][pairs[index].case.name] = attempt
            yield index, attempt

    every = [*cases.values(), *refused.values()]
    engines = [engine] if engine.name == STANDARD else [native, engine]
    results = run(every, engines, tol=tol, solver=keep_answers, progress=progress)
    records = {record.case: record for record in results.records if record.engine == engine.name}
    mine, standards = answers[engine.name], answers[STANDARD]
    for name, case in cases.items():
        faults = faults_of_forces(case, engine.mode, mine[case.name], standards[case.name])
        found.append(_compare_case(name, records[case.name], "; ".join(faults)))
    found += rates([(case, records[case.name]) for case in cases.values()])
    beyond = refused[BEYOND].name
    found += [
        _check_fold(records[beyond], mine[beyond]),
        _check_unknown_joint(records[refused[UNKNOWN].name]),
    ]
    again = [Pair(case, engine, tol, timed=False) for case in reversed(cases.values())]
    found.append(_check_repetition("determinism", again, mine, in_workers(1, Limits())))
    if runs_in_process(engine):
        found.append(_check_repetition("isolation: in this process", again, mine, solve_in_process))
    return Report(engine.name, (), None, tuple(found))


def _beyond() -> Case:
    case = probe(Revolute)
    return replace(case, name="beyond_a_fold", sweep=replace(case.sweep, values=REACH))


def _protocol(engine: Engine) -> Iterator[Finding]:
    """Check attributes, version and transport; the rest needs all of them."""
    given: Any = engine  # may lack members of the protocol
    facts = (
        ("name", given.name, isinstance(given.name, str) and given.name, "a text"),
        ("mode", given.mode, given.mode in MODES, " or ".join(MODES)),
        ("loop", given.loop, given.loop in LOOPS, " or ".join(LOOPS)),
        ("settings", given.settings, isinstance(given.settings, Mapping), "a mapping"),
    )
    wrong = [
        f"{name} is {value!r}, expected {wanted}" for name, value, good, wanted in facts if not good
    ]
    yield fault_finding("protocol", "; ".join(wrong))
    try:
        pickle.loads(pickle.dumps(engine))
    except Exception as error:  # any error of the engine's own code
        remedy = "worker processes need an engine that pickle takes"
        yield fault_finding("isolation: pickle", f"{error_text(error)}; {remedy}")
        return
    yield fault_finding("isolation: pickle", "")
    (version,) = versions([engine])
    fault = "version() returns None: the engine is not installed, or cannot be imported"
    yield fault_finding("version", fault if version is None else "", version or "")


def _compare_case(name: str, record: Record, faults: str) -> Finding:
    """Return the agreement of a case with its reference and the native engine.

    Args:
        faults: of the forces beside their values.
    """
    passed = record.outcome is Outcome.PASS
    message = faults or ("" if passed else f"{record.outcome.shown}: {record.message}")
    verdict = Verdict.FAIL if faults else VERDICTS.get(record.outcome, Verdict.FAIL)
    return replace(agreement(name, verdict, record.errors, AGREE_WHY, message), pose=None)


def _check_fold(record: Record, attempt: Attempt) -> Finding:
    """Check samples beyond a fold: they have no values, and a message gives the reason."""
    if record.outcome is Outcome.UNSUPPORTED:
        return skip(BEYOND, record.message)
    beyond = sum(each.contradicted or 0 for each in record.errors.values())
    reached = record.solved or 0
    silent = isinstance(attempt.result, Answer) and not attempt.result.message
    problems = [
        f"ends with {record.outcome.shown}: {record.message}" if record.solved is None else "",
        "has values at samples that cannot be reached; mark them unsolved" if beyond else "",
        "" if reached else "reaches no sample, although the design is one of them",
        "gives no message" if silent else "",
    ]
    message = "; ".join(filter(None, problems))
    verdict = Verdict.FAIL if message else Verdict.PASS
    text = f"reaches {reached} of {len(REACH)} samples"
    return Finding(BEYOND, verdict, float(beyond), *UNREACHED, message=message or text)


def _check_unknown_joint(record: Record) -> Finding:
    """Check a joint of an unknown type: it is refused with a reason, or solved correctly."""
    solved = record.outcome in (Outcome.PASS, Outcome.UNJUDGED)
    good = solved or (record.outcome is Outcome.UNSUPPORTED and record.message)
    message = record.outcome.shown + (f": {record.message}" if record.message else "")
    remedy = "; unsupported() is to return the reason"
    return fault_finding(UNKNOWN, "" if good else message + remedy, message)


def _check_repetition(
    name: str, pairs: Sequence[Pair], first: Mapping[str, Attempt], solver: Solver
) -> Finding:
    """Check repeated solves: all give the same answers."""
    worst, where = 0.0, ""
    for index, attempt in solver(pairs):
        case = pairs[index].case.name
        off = _difference(first[case], attempt)
        if off > worst:
            worst, where = off, case
    return replace(judge_figures(name, np.array([worst]), SAME, [where]), pose=None)


def _difference(one: Attempt, other: Attempt) -> float:
    """Return the largest difference between two answers; infinite if only one has values."""
    if not (isinstance(one.result, Answer) and isinstance(other.result, Answer)):
        return 0.0 if type(one.result) is type(other.result) else np.inf
    worst = 0.0
    for name, series in one.result.outputs.items():
        found = other.result.outputs[name]
        for quantity in QUANTITIES:
            a, b = getattr(series, quantity), getattr(found, quantity)
            if (a is None) != (b is None):
                return np.inf
            if a is not None and not np.array_equal(a, b, equal_nan=True):
                off = np.abs(a - b)
                worst = max(worst, float(np.nanmax(off, initial=0.0)) or np.inf)
    return worst
