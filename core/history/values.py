"""Values of two records beside each other, motion by motion, and changes of their solutions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..harness.labels import number
from ..harness.record import Deviation, OutputSeries, Record
from ..trajectory import QUANTITIES
from ..unit_text import motion_word
from .findings import Finding, Kind
from .steps import RESIDUAL, RESIDUAL_FLOOR, SAME_SAMPLE

NO_REASON = "no reason is given"

Values: TypeAlias = Sequence[float | None]


@dataclass(frozen=True)
class _Quantity:
    """A motion of an output in two records, with its values and deviations."""

    output: str
    motion: str
    unit: str
    old: Values
    new: Values
    judged: Deviation | None
    was_judged: Deviation | None

    @property
    def word(self) -> str:
        return f"{self.output} {motion_word(self.motion, self.unit)}"

    @property
    def place(self) -> dict[str, Any]:
        return {"output": self.output, "motion": self.motion}


def quantities(now: Record, before: Record) -> Iterator[_Quantity]:
    """Yield the motions of all earlier outputs."""
    for output, old in before.outputs.items():
        for motion in QUANTITIES:
            yield _Quantity(
                output,
                motion,
                old.unit,
                values_of(old, motion),
                values_of(now.outputs.get(output), motion),
                getattr(now.errors.get(output), motion, None),
                getattr(before.errors.get(output), motion, None),
            )


def values_of(series: OutputSeries | None, motion: str) -> Values:
    """Return the values of a motion over the samples; empty without such a series."""
    return getattr(series, motion, None) or ()


def largest_difference(a: Values, b: Values) -> float:
    """Return the largest difference over the common samples."""
    pairs = zip(a, b, strict=False)
    return max((abs(x - y) for x, y in pairs if x is not None and y is not None), default=0.0)


def largest(values: Iterable[float | None]) -> float:
    """Return the largest size of the values; zero without any."""
    return max((abs(x) for x in values if x is not None), default=0.0)


def same_samples(now: Record, before: Record) -> bool:
    """Return whether all drivers have equal values, up to last digits of sines and splines that
    differ between processors.
    """
    mine, other = now.driver, before.driver
    return {name: len(each) for name, each in mine.items()} == {
        name: len(each) for name, each in other.items()
    } and all(
        largest_difference(values, other[name]) <= SAME_SAMPLE * largest(values)
        for name, values in mine.items()
    )


def solution_changes(now: Record, before: Record) -> Iterator[Finding]:
    """Yield what changed in the solution of a pair: freedoms, residual, units and values gone."""
    yield from _numbers(now, before)
    yield from _residual(now, before)
    yield from _units(now, before)
    yield from _gone(now, before)


def _numbers(now: Record, before: Record) -> Iterator[Finding]:
    """Yield changes of dof and rank, and numbers that are null now."""
    for name, kind in (("dof", Kind.FREEDOM), ("rank", Kind.RANK)):
        old, new = getattr(before, name), getattr(now, name)
        if None not in (old, new) and new != old:
            message = f"{name} {old} → {new}"
            yield Finding.of(kind, now, message, before=float(old), now=float(new))
    for name in ("dof", "rank", "residual_max"):
        old = getattr(before, name)
        if old is not None and getattr(now, name) is None:
            why = now.reasons.get(name) or NO_REASON
            yield Finding.of(
                Kind.GONE, now, f"{name} has no value now, {number(old)} before: {why}"
            )


def _residual(now: Record, before: Record) -> Iterator[Finding]:
    old, new = before.residual_max, now.residual_max
    if old is None or new is None or new < RESIDUAL * max(old, RESIDUAL_FLOOR):
        return
    ratio = new / old if old else None
    times = f" (×{number(ratio)})" if ratio else ""
    message = f"largest residual {number(old)} → {number(new)}{times}"
    about = {"before": old, "now": new, "ratio": ratio, "limit": RESIDUAL}
    yield Finding.of(Kind.RESIDUAL, now, message, **about)


def _units(now: Record, before: Record) -> Iterator[Finding]:
    """Yield outputs with a changed unit or positive sense."""
    for output, old in before.outputs.items():
        new = now.outputs.get(output)
        for what in ("unit", "sense"):
            a, b = getattr(old, what), getattr(new, what, None)
            if new is not None and a != b:
                message = f"{output}: {what} {a or 'none'} → {b or 'none'}"
                yield Finding.of(Kind.UNIT, now, message, output=output)


def _gone(now: Record, before: Record) -> Iterator[Finding]:
    """Yield motions of outputs with null in place of earlier numbers, unless another finding
    reports it: motions no longer compared, and samples no longer solved, at which no output has a
    position.
    """
    if not same_samples(now, before):
        return
    series = [output.position for output in now.outputs.values()]
    count = max(map(len, series), default=0) if (now.solved or 0) < (before.solved or 0) else 0
    unsolved = {
        k for k in range(count) if all(k >= len(each) or each[k] is None for each in series)
    }
    for each in quantities(now, before):
        if each.was_judged is not None and each.judged is None:
            continue
        had = [k for k, value in enumerate(each.old) if value is not None]
        there = {k for k, value in enumerate(each.new) if value is not None}
        lost = [k for k in had if k not in there and k not in unsolved]
        if lost:
            at = [
                f"{name} = {number(values[lost[0]])}"
                for name, values in now.driver.items()
                if lost[0] < len(values)
            ]
            new = now.outputs.get(each.output)
            why = "the case has no such output now" if new is None else new.reason or NO_REASON
            message = (
                f"{each.word} has no value at {len(lost)} of {len(had)} samples that had one,"
                f" first at {at[0] if at else f'sample {lost[0]}'}: {why}"
            )
            yield Finding.of(Kind.GONE, now, message, **each.place)
