"""Signatures: the answers of a release to the cases, and the differences of two of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from ...case.case import Truth
from ...harness.compare import as_array
from ...harness.labels import motion_unit
from ...harness.record import Outcome, Record
from ...trajectory import QUANTITIES, Array
from ...unit_text import motion_word
from .results import NEITHER, UNKNOWN, CaseChange, CurveChange

READER, FILE = "reader", "the file"
"""Case of a simulator's own reader, and its truth: the numbers in the file."""

TRUTHS = {FILE, *(each.value for each in Truth if each is not Truth.CONSENSUS_ONLY)}
IDLE = Outcome.ERROR, Outcome.UNSUPPORTED, Outcome.UNAVAILABLE, Outcome.TIMEOUT, Outcome.CRASHED
"""Outcomes of an engine that does not run a case."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A judged quantity over the samples [unit].

    Attributes:
        error: largest deviation from the standard.
        against: kind of the reference, or the name of the engine in its place.
    """

    values: Array
    error: float
    tolerance: float
    within: bool
    against: str
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Answer:
    """The answer of a release to a case.

    Attributes:
        runs: whether it solves the case, rightly or not.
        judged: whether the case has a truth of its own.
    """

    outcome: str
    message: str = ""
    runs: bool = True
    judged: bool = True
    curves: Mapping[str, Curve] = field(default_factory=dict[str, Curve])


Signature: TypeAlias = Mapping[str, Answer]
"""The answers of a release by case."""


def answer_of(record: Record) -> Answer:
    """Return the answer in a record."""
    judged = record.truth in TRUTHS
    runs = record.outcome not in IDLE
    curves = dict(_curves(record)) if runs else {}
    return Answer(record.outcome.shown, record.message, runs, judged, curves)


def _curves(record: Record) -> Iterator[tuple[str, Curve]]:
    for name, series in record.outputs.items():
        for quantity in QUANTITIES:
            values = as_array(getattr(series, quantity))
            off = getattr(record.errors[name], quantity) if name in record.errors else None
            if values is not None and off is not None:
                yield (
                    f"{name} {motion_word(quantity, series.unit)}",
                    Curve(
                        values,
                        off.max_abs,
                        off.tolerance,
                        off.within,
                        off.against,
                        motion_unit(series.unit, quantity),
                    ),
                )


def answer_of_reader(found: Mapping[str, tuple[Sequence[float], Sequence[float], float]]) -> Answer:
    """Return the answer of a simulator's own reader: values, those of the file, and a tolerance."""
    curves: dict[str, Curve] = {}
    for name, (values, truth, tolerance) in found.items():
        error = float(np.abs(np.subtract(values, truth)).max())
        curves[name] = Curve(np.array(values), error, tolerance, error <= tolerance, FILE)
    right = all(each.within for each in curves.values())
    return Answer((Outcome.PASS if right else Outcome.FAIL).shown, curves=curves)


def differences(first: Signature, second: Signature, names: Sequence[str]) -> dict[str, CaseChange]:
    """Return the cases with other answers in the second signature, with the names of both."""
    found: dict[str, CaseChange] = {}
    for case in first.keys() & second.keys():
        a, b = first[case], second[case]
        curves = sorted(_changed(a, b), key=_size, reverse=True)
        if a.runs and b.runs:
            if not (curves or a.outcome != b.outcome):
                continue
            right = _right(curves, (a, b), names)
        elif a.runs == b.runs:
            continue
        else:
            right, curves = UNKNOWN, []
        found[case] = CaseChange(
            kind="result" if a.runs and b.runs else "interface",
            outcomes=(a.outcome, b.outcome),
            messages=(a.message, b.message),
            right=right,
            curves=curves,
        )
    return dict(sorted(found.items()))


def _changed(first: Answer, second: Answer) -> Iterator[CurveChange]:
    """Yield the curves with a difference above their tolerance; two within it are alike."""
    for name in first.curves.keys() | second.curves.keys():
        a, b = first.curves.get(name), second.curves.get(name)
        known = a or b
        assert known is not None
        tolerance = max(each.tolerance for each in (a, b) if each)
        difference: float | None = None
        if a and b and a.values.shape == b.values.shape:
            both = np.isfinite(a.values) & np.isfinite(b.values)
            same = np.array_equal(np.isfinite(a.values), np.isfinite(b.values))
            largest = float(np.abs(a.values - b.values)[both].max(initial=0.0))
            if same and (largest <= tolerance or (a.within and b.within)):
                continue
            difference = largest if same else None
        yield CurveChange(
            output=name,
            difference=difference,
            tolerance=tolerance,
            errors=(a and a.error, b and b.error),
            against=known.against,
            unit=known.unit,
        )


def _size(change: CurveChange) -> tuple[float, str]:
    if change.difference is None:
        return math.inf, change.output
    return change.difference / (change.tolerance or 1e-300), change.output


def _right(
    curves: Sequence[CurveChange], answers: tuple[Answer, Answer], names: Sequence[str]
) -> str:
    """Return who is right by the truth of the changed curves; without one, nobody is known to be.
    Native completes a truth without rates. If only the outcome has changed, a pass is right.
    """
    judged = all(each.judged for each in answers)
    decided = [each for each in curves if each.against in TRUTHS] or (curves if judged else [])
    if decided:
        pairs = [[e is not None and e <= each.tolerance for e in each.errors] for each in decided]
        right = [all(column) for column in zip(*pairs, strict=True)]
    elif judged:
        right = [each.outcome == Outcome.PASS.shown for each in answers]
    else:
        return UNKNOWN
    return _one([name for name, good in zip(names, right, strict=True) if good])


def _one(right: Sequence[str]) -> str:
    return right[0] if len(right) == 1 else UNKNOWN if right else NEITHER


def right_of(cases: Iterable[CaseChange]) -> str:
    """Return the right release in all cases with a truth."""
    found = {each.right for each in cases} - {UNKNOWN}
    return found.pop() if len(found) == 1 else NEITHER if found else UNKNOWN
