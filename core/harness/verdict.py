"""Verdicts: the outcome of an answer and its reason, by the standards of its case: its reference,
with evidence on it, completed by the native engine.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter

import msgspec
import numpy as np
from numpy.typing import NDArray

from ..case.case import Case, Origin, Quantity, Series, Truth, size
from ..errors import shortened
from ..trajectory import QUANTITIES, Array
from .compare import NO_VALUE, as_array, describe, deviations
from .engine import STANDARD, Engine, bounds_error
from .execution import Answer
from .labels import against, shown_text
from .record import Deviation, Deviations, Evidence, Outcome, Record
from .table_units import driver_unit, table_facts

UNCERTAIN = "uncertain_samples"
"""Key of a record's details: samples that were reached, but refused as uncertain."""


@dataclass(frozen=True, eq=False)
class Standard:
    """The native engine's answer to a case.

    Attributes:
        outputs: outputs by name; empty without an answer.
        absent: the reason for a missing answer, which ends a sentence on the missing reference.
        refused: samples that the native engine cannot reach, shape (n,); None without such samples.
            Samples near a singular pose that it refuses for an uncertain pose or rate are not
            included: they contradict no other engine.
        why: the native engine's own message.
        dof: its number of degrees of freedom without drivers; None if it is not known.
    """

    outputs: Mapping[str, Series]
    absent: str = ""
    refused: NDArray[np.bool_] | None = None
    why: str = ""
    dof: int | None = None

    def refuses(self, case: Case) -> NDArray[np.bool_] | None:
        """Return the samples that neither native nor the reference reaches, shape (n,)."""
        if self.refused is None:
            return None
        return self.refused & ~samples_with_values(case.reference.values(), len(self.refused))


def standard_of(native: Record) -> Standard:
    """Return the standard from a record of the native engine."""
    if not native.outputs:
        why = f", and the native engine has no answer ({native.outcome.shown}: {native.message})"
        return Standard({}, why)
    outputs = {
        name: Series(
            np.array(output.position, dtype=np.float64),
            as_array(output.velocity),
            as_array(output.acceleration),
        )
        for name, output in native.outputs.items()
    }
    if native.solved == native.samples:
        return Standard(outputs, dof=native.dof)
    refused = ~samples_with_values(outputs.values(), native.samples or 0)
    refused[native.details.get(UNCERTAIN, [])] = False
    return Standard(outputs, refused=refused, why=native.message, dof=native.dof)


def has_everything(case: Case) -> bool:
    """Return whether the reference has a value of every comparable quantity at every sample."""
    return all(
        (series := case.reference.get(output.name)) is not None
        and all(
            each is not None
            for each in (series.position, series.velocity, series.acceleration)[: output.orders]
        )
        and np.isfinite(series.position).all()
        for output in case.outputs
    )


def samples_with_values(outputs: Iterable[Series], samples: int) -> NDArray[np.bool_]:
    """Return the samples where any output has a value, shape (samples,)."""
    found = np.zeros(samples, dtype=np.bool_)
    for each in outputs:
        found |= np.isfinite(each.position)
    return found


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


def judge_answer(case: Case, answer: Answer, native: Standard, tol: float) -> Verdict:
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
    about = case.sweep.driver, values, output.unit, table_facts(case)
    return describe(output.name, quantity, off, *about) + more


def _contradiction(case: Case, answer: Answer, native: Standard) -> str:
    """Return a sentence on values at samples that the native engine refuses, with its reason; empty
    if there are none.
    """
    refused = native.refuses(case)
    if refused is None:
        return ""
    samples = len(refused)
    at = refused & samples_with_values(answer.outputs.values(), samples)
    if not at.any():
        return ""
    first = int(np.argmax(at))
    facts = table_facts(case)
    values = [
        f"{output.name} = {shown_text(value, output.unit, facts, '.6g')}"
        for output in case.outputs
        if np.isfinite(value := answer.outputs[output.name].position[first])
    ]
    unit = driver_unit(facts)
    driven = shown_text(float(case.sweep.values[first]), unit, facts, ".9g")
    where = f"sample {first} ({case.sweep.driver} = {driven})"
    return (
        f"values at {at.sum()} of {samples} samples that {STANDARD} cannot reach, first at {where}:"
        f" {shortened(values, NAMED)}; {STANDARD}: {native.why or 'gives no reason'}"
    )


def _reached_elsewhere(case: Case, answer: Answer, native: Standard) -> str:
    """Return a phrase with the number of unsolved samples where a standard has a value; empty if
    zero.
    """
    samples = len(case.sweep.values)
    unsolved = ~samples_with_values(answer.outputs.values(), samples)
    for name, series in (
        (str(case.truth), case.reference.values()),
        (STANDARD, native.outputs.values()),
    ):
        if count := int((unsolved & samples_with_values(series, samples)).sum()):
            return f"; {against(name)} has values at {count} of the others"
    return ""


def residual_limit(engine: Engine, tol: float) -> float:
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


VALUES = "values"
"""Subject of a digest if no file holds the reference."""
# Straight series prove nothing: their rounded values agree in every bit whatever the source. The
# series of a driven coordinate is straight.
FEWEST, STRAIGHT = 3, 1e-9


def evidence(case: Case, native: Mapping[str, Series]) -> Evidence | None:
    """Return the evidence on the reference of a case; None without a reference.

    Args:
        native: known outputs of the native engine.
    """
    if not case.reference:
        return None
    origin = case.origin or Origin(case.source)
    return Evidence(
        citation=origin.citation,
        sha256=origin.sha256 or digest(case.reference),
        of=origin.file or VALUES,
        units=dict(origin.units),
        signs=origin.signs,
        grid=origin.grid,
        limits=dict(origin.limits),
        own=origin.own or (case.truth is Truth.THIRD_PARTY_DATA and _identical(case, native)),
    )


def _identical(case: Case, native: Mapping[str, Series]) -> bool:
    """Return whether every reference value equals native's in every bit, with at least one curved
    series.
    """
    telling = False
    for name, series in case.reference.items():
        for quantity in QUANTITIES:
            reference: Array | None = getattr(series, quantity)
            if reference is None:
                continue
            found: Array | None = getattr(native.get(name), quantity, None)
            known = np.isfinite(reference)
            if (
                found is None
                or found.shape != reference.shape
                or not np.array_equal(reference[known], found[known])
            ):
                return False
            telling = telling or not _straight(case.sweep.values[known], reference[known])
    return telling


def _straight(x: Array, y: Array) -> bool:
    if len(y) < FEWEST:
        return True
    slope = float(y[x.argmax()] - y[x.argmin()]) / (float(np.ptp(x)) or 1.0)
    off: Array = y - slope * x
    return float(np.ptp(off)) <= STRAIGHT * float(np.abs(y).max())


def digest(reference: Mapping[str, Series]) -> str:
    """Return the SHA-256 of reference values.

    Order: outputs by name, then quantities; after each name its values as little-endian SI doubles.
    """
    whole = hashlib.sha256()
    for name, series in sorted(reference.items()):
        for quantity in QUANTITIES:
            if (values := getattr(series, quantity)) is not None:
                whole.update(f"{name}.{quantity}\n".encode())
                whole.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return whole.hexdigest()
