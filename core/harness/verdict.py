"""Verdicts: the outcome of an answer and its reason, by the standards of its case."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter

import msgspec
import numpy as np

from ..case.case import Case, Quantity, size
from ..errors import shortened
from ..unit_text import value_text
from .compare import NO_VALUE, describe, deviations
from .engine import Engine, bounds_error
from .execution import Answer
from .labels import against
from .record import Deviation, Deviations, Outcome
from .standard import STANDARD, Standard, known

ROUNDED = 2.0
"""Factor on the residual tolerance: engines measure in a unit near the mechanism's size, a power of
two that may exceed the size.
"""


NAMED = 3
"""Largest number of outputs whose values a message gives; the record has all."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """The outcome of an answer.

    Attributes:
        outcome: pass, fail or unjudged.
        messages: reasons for a failure, or the unjudged parts.
        faults: reasons for a failure beside deviations.
        errors: deviations of every output.
        seconds: time of the comparison.
    """

    outcome: Outcome
    messages: Sequence[str]
    errors: Mapping[str, Deviations]
    seconds: float
    faults: Sequence[str] = ()


def judged(case: Case, answer: Answer, native: Standard, tol: float) -> Verdict:
    """Return the verdict on an answer.

    Args:
        native: the native engine's answer, the standard for everything that the case's reference
            lacks.
        tol: the largest residual promised for solved samples, relative to the size.
    """
    begin = perf_counter()
    solved, samples = answer.solved, len(case.sweep.values)
    complete = solved == samples
    errors = {
        output.name: _deviations(
            case, output, answer, native, complete=complete and not answer.reported
        )
        for output in case.outputs
    }
    reach: list[str] = []
    if not complete:
        why = answer.message or "the engine gives no reason; its adapter must report one"
        reach.append(
            f"{solved} of {samples} samples solved: {why}{_reached_elsewhere(case, answer, native)}"
        )
    reach += filter(None, (_contradiction(case, answer, native),))
    # an output without any value has no deviation, so this is its only test
    others = [
        f"{name}: {each.reason}" for name, each in errors.items() if each.lost and each.within
    ]
    dof = answer.details.get("dof")
    if solved and None not in (dof, native.dof) and dof != native.dof:
        others.append(f"counts {dof} degrees of freedom without drivers, {STANDARD} {native.dof}")
    others += filter(None, (excess(case, answer.residual if solved else 0.0, tol), *answer.faults))
    messages = [*reach, *filter(None, (_worst(case, errors),)), *others]
    if messages:
        faults = [*reach, *others]
        return Verdict(Outcome.FAIL, messages, errors, perf_counter() - begin, faults)
    compared = answer.judged or any(each.items() for each in errors.values())
    outcome = Outcome.PASS if compared else Outcome.UNJUDGED
    messages = _not_judged(case, errors)
    if outcome is Outcome.PASS and messages:
        messages[0] = f"{Outcome.UNJUDGED.shown}: {messages[0]}"
    if native.why and any(NO_VALUE in message for message in messages):
        messages.append(f"{STANDARD}: {native.why}")
    return Verdict(outcome, messages, errors, perf_counter() - begin)


def _deviations(
    case: Case, output: Quantity, answer: Answer, native: Standard, *, complete: bool
) -> Deviations:
    name, found = output.name, answer.outputs[output.name]
    standards = [(str(case.truth), case.reference[name])] if name in case.reference else []
    standards += [(STANDARD, native.outputs[name])] if name in native.outputs else []
    refused = native.refuses(case)
    result = deviations(case, output, found, standards, complete=complete, refused=refused)
    if standards:
        return result
    lack = "the reference does not have it" if case.reference else "the case has no reference"
    return msgspec.structs.replace(result, reason=lack + native.absent)


def _worst(case: Case, errors: Mapping[str, Deviations]) -> str:
    """Return a sentence on the deviation farthest out of tolerance; empty if all are within."""
    outside: list[tuple[float, Quantity, str, Deviation]] = [
        (off.ratio, output, quantity, off)
        for output in case.outputs
        for quantity, off in errors[output.name].items()
        if not off.within
    ]
    if not outside:
        return ""
    _, output, quantity, off = max(outside, key=lambda each: each[0])
    more = f" (worst of {len(outside)} quantities out of tolerance)" if len(outside) > 1 else ""
    values = case.sweep.values.tolist()
    return describe(output.name, quantity, off, case.sweep.driver, values, output.unit) + more


def _contradiction(case: Case, answer: Answer, native: Standard) -> str:
    """Return a sentence on values at samples that the native engine refuses, with its reason; empty
    if there are none.
    """
    refused = native.refuses(case)
    if refused is None:
        return ""
    samples = len(refused)
    at = refused & known(answer.outputs.values(), samples)
    if not at.any():
        return ""
    first = int(np.argmax(at))
    values = [
        f"{output.name} = {value_text(f'{value:.6g}', output.unit)}"
        for output in case.outputs
        if np.isfinite(value := answer.outputs[output.name].position[first])
    ]
    where = f"sample {first} ({case.sweep.driver} = {case.sweep.values[first]:.9g})"
    return (
        f"values at {at.sum()} of {samples} samples that {STANDARD} cannot reach, first at {where}:"
        f" {shortened(values, NAMED)}; {STANDARD}: {native.why or 'gives no reason'}"
    )


def _reached_elsewhere(case: Case, answer: Answer, native: Standard) -> str:
    """Return a phrase with the number of unsolved samples where a standard has a value; empty if
    zero.
    """
    samples = len(case.sweep.values)
    unsolved = ~known(answer.outputs.values(), samples)
    for name, series in (
        (str(case.truth), case.reference.values()),
        (STANDARD, native.outputs.values()),
    ):
        if count := int((unsolved & known(series, samples)).sum()):
            return f"; {against(name)} has values at {count} of the others"
    return ""


def promised(engine: Engine, tol: float) -> float:
    """Return the largest residual promised for solved samples, relative to the size.

    The tolerance is infinite for engines judged by their outputs alone: a simulation accepts
    samples by its own settings, and an engine that bounds the pose error needs no bound of the
    residual.
    """
    return tol if engine.mode == "projection" and not bounds_error(engine) else math.inf


def excess(case: Case, residual: float, tol: float) -> str:
    """Return a sentence on a residual of solved samples above the tolerance; empty without one.

    The tolerance is relative to the mechanism's size for lengths, and absolute for residuals
    without a unit.
    """
    extent = size(case)
    if not residual > tol * max(1.0, ROUNDED * extent):
        return ""
    return (
        f"the residual of samples that the engine calls solved is {residual:.3g}, tolerance"
        f" {tol:.3g} of the mechanism's size ({extent:.3g} m): it has not converged; let it iterate"
        " further, or allow more by --tol"
    )


def _not_judged(case: Case, errors: Mapping[str, Deviations]) -> list[str]:
    """Return the uncompared outputs, quantities or samples with their reasons; equal reasons are
    merged.
    """
    reasons: dict[str, list[str]] = {}
    for output in case.outputs:
        each = errors[output.name]
        orders = 1 if case.sweep.static else output.orders
        if len(each.items()) < orders or NO_VALUE in (each.reason or ""):
            reasons.setdefault(each.reason or "", []).append(output.name)
    return [
        reason if len(names) == len(case.outputs) else f"{', '.join(names)}: {reason}"
        for reason, names in reasons.items()
    ]
