"""Values of two records beside each other, motion by motion."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..harness.record import Deviation, OutputSeries, Record
from ..trajectory import QUANTITIES
from ..unit_text import motion_word
from .steps import (
    SAME_SAMPLE,
)

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
