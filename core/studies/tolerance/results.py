"""The results of a study as data: the JSON schema kincheck-sweep/1. SI units; what was not computed
is null.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import msgspec
import numpy as np

from ...dataset import Dataset, Variable
from ...harness.record import Outcome
from ...tabular import Tabular
from ...trajectory import Array
from .cross_check import Checked
from .gradients import Gradients
from .reduce import QUANTILES, Quantiles, Summary
from .study import Study

Numbers = list[float | None]


class VariedCoordinate(msgspec.Struct, frozen=True, kw_only=True):
    """A coordinate that varies.

    Attributes:
        law: normal, uniform, or values.
        scale: standard deviation, half width, or the largest offset [unit].
        values: the offsets [unit] where they are listed.
    """

    name: str
    hardpoint: str
    unit: str
    law: str
    scale: float
    values: list[float] = []


class Envelope(msgspec.Struct, frozen=True, kw_only=True):
    """One output, or a derivative of it, over all variants; lists have a number for each sample
    [unit].

    Attributes:
        nominal: at the nominal design.
        count: variants that have a value.
        quantiles: by probability; `quantiles_of` says of how many variants.
        standard_errors: of the quantiles, by probability; null where they are exact.
        min_variant, max_variant: the variants with the least and the most of all samples.
    """

    unit: str
    sense: str | None
    nominal: Numbers
    count: list[int]
    min: Numbers
    max: Numbers
    mean: Numbers
    standard_deviation: Numbers
    quantiles: dict[str, Numbers]
    standard_errors: dict[str, Numbers] | None
    min_variant: int | None
    max_variant: int | None


class Gradient(msgspec.Struct, frozen=True, kw_only=True):
    """The derivative of an output by a coordinate at the nominal design [unit of output / unit of
    coordinate].

    Attributes:
        at_design: at the design position; null where the case does not pass through it.
        along: at the samples.
        largest: that of the largest size over the samples, with its sign.
        sample: where that is.
        error: what it is off by at most, from two step sizes.
        accurate: whether that is at most 1e-6 of the output's largest gradient by any coordinate of
            that unit.
        scale: of the coordinate; times `largest` it is the bar of a tornado diagram.
    """

    output: str
    coordinate: str
    unit: str
    at_design: float | None
    along: Numbers
    largest: float | None
    sample: int | None
    error: float | None
    accurate: bool
    scale: float


class Effect(msgspec.Struct, frozen=True, kw_only=True):
    """One at a time: a variant, and by output the largest change over the samples, with its sign
    [unit].
    """

    variant: int
    coordinate: str
    offset: float
    changes: dict[str, float | None]


class Failed(msgspec.Struct, frozen=True, kw_only=True):
    """A variant without a solution at some samples."""

    variant: int
    samples: int
    message: str


class SweepResults(Tabular, msgspec.Struct, frozen=True, kw_only=True):
    """A study.

    Attributes:
        run: its circumstances, as of a run: versions, machine, settings, and what the case is.
        samples: how many variants were solved.
        asked: how many there were to be: more than were solved where the sweep was stopped before
            its end.
        quantiles_of: how many variants the quantiles are of.
        driver: values at the samples by name, as in a run's records.
        unsolved: variants without a solution somewhere; `failed` lists the first of them.
        retried: variants that were solved again alone, with divided steps.
        checked: the cross-checked variants, and the engine that they were checked with.
        measured: seconds, rate, and the largest memory of this process.
    """

    schema: Literal["kincheck-sweep/1"] = "kincheck-sweep/1"
    run: dict[str, Any]
    case: str
    mode: str
    seed: int
    samples: int
    asked: int
    coordinates: list[VariedCoordinate]
    driver: dict[str, list[float]]
    outputs: dict[str, Envelope]
    quantiles_of: int
    gradients: list[Gradient]
    gradient_messages: dict[str, str] = {}
    effects: list[Effect] = []
    unsolved: int
    failed: list[Failed]
    retried: int
    check_engine: str | None = None
    checked: list[Checked] = []
    measured: dict[str, Any] = {}

    def summary(self) -> str:
        """Return case, mode, variants and what is missing of them."""
        found = f"{self.case}, {self.mode}, {self.partial or self.samples} variants"
        missing = f"{self.unsolved} without a solution somewhere" if self.unsolved else ""
        return ", ".join(filter(None, [found, f"{len(self.outputs)} outputs", missing]))

    def dataset(self) -> Dataset:
        """Return the envelope of every output over the driver [units of the output]."""
        coords = {name: Variable("sample", values) for name, values in self.driver.items()}
        coords["band"] = Variable("band", [*BANDS])
        variables = {
            name: Variable(
                ("sample", "band"), np.array(_bands(each), dtype=np.float64).T, each.unit
            )
            for name, each in self.outputs.items()
        }
        return Dataset(("sample",), coords, variables, next(iter(self.driver), ""))

    @property
    def partial(self) -> str:
        """How many variants of how many there are, of a sweep that was stopped before its end; else
        empty.
        """
        return f"{self.samples} of {self.asked}" if self.samples < self.asked else ""

    @property
    def deviating(self) -> list[Checked]:
        """The checked variants that did not pass."""
        return [each for each in self.checked if each.outcome.bad]

    @property
    def unjudged(self) -> int:
        """How many checked variants have no value to compare; all are among those without a
        solution.
        """
        return sum(each.outcome is Outcome.UNJUDGED for each in self.checked)

    @property
    def partly_judged(self) -> str:
        """The rows not compared in the first passing variant, with the reason; else empty."""
        passed = (each.message for each in self.checked if each.outcome is Outcome.PASS)
        return next(filter(None, passed), "")


BANDS = ("nominal", "mean", "min", "max", "standard_deviation")
"""Curves of an envelope."""


def _bands(each: Envelope) -> list[Numbers]:
    return [getattr(each, name) for name in BANDS]


def numbers(values: Array) -> Numbers:
    """Numbers, null for NaN."""
    return [value if math.isfinite(value) else None for value in values.tolist()]


def envelopes(
    study: Study, whole: Summary, found: Sequence[Quantiles], nominal: Array
) -> dict[str, Envelope]:
    """The envelope of every row, by name."""
    spread = whole.deviation
    result: dict[str, Envelope] = {}
    for k, (row, quantiles) in enumerate(zip(study.rows, found, strict=True)):
        low, high = (int(each) for each in whole.extremes[k])
        result[row.name] = Envelope(
            unit=row.unit,
            sense=row.output.sense or None,
            nominal=numbers(nominal[k]),
            count=whole.count[k].tolist(),
            min=numbers(whole.least[k]),
            max=numbers(whole.most[k]),
            mean=numbers(whole.mean[k]),
            standard_deviation=numbers(spread[k]),
            quantiles=_by_probability(quantiles.values),
            standard_errors=None if quantiles.errors is None else _by_probability(quantiles.errors),
            min_variant=low if low >= 0 else None,
            max_variant=high if high >= 0 else None,
        )
    return result


def _by_probability(values: Array) -> dict[str, Numbers]:
    return {f"{p:g}": numbers(each) for p, each in zip(QUANTILES, values, strict=True)}


def gradient_table(study: Study, found: Gradients) -> list[Gradient]:
    """Every gradient, by output and coordinate."""
    table: list[Gradient] = []
    for r, row in enumerate(study.rows):
        for c, coordinate in enumerate(study.variation.coordinates):
            along = found.along[c, r]
            known = np.isfinite(along).any()
            sample = int(np.nanargmax(np.abs(along))) if known else None
            table.append(
                Gradient(
                    output=row.name,
                    coordinate=coordinate.name,
                    unit=f"({row.unit})/{coordinate.unit}",
                    at_design=None
                    if found.design is None
                    else numbers(found.design[c, r : r + 1])[0],
                    along=numbers(along),
                    largest=None if sample is None else float(along[sample]),
                    sample=sample,
                    error=numbers(found.error[c, r : r + 1])[0],
                    accurate=bool(found.accurate[c, r]),
                    scale=coordinate.scale,
                )
            )
    return table


def effect_table(study: Study, effects: Mapping[int, Array]) -> list[Effect]:
    """What each variant of one at a time changes; effects by variant, shape (rows,)."""
    table: list[Effect] = []
    for variant, changes in effects.items():
        offsets = study.variation.of_variant(study.seed, variant)
        (moved,) = np.flatnonzero(offsets)
        each = study.variation.coordinates[int(moved)]
        by_row = {
            row.name: change for row, change in zip(study.rows, numbers(changes), strict=True)
        }
        table.append(
            Effect(
                variant=variant, coordinate=each.name, offset=float(offsets[moved]), changes=by_row
            )
        )
    return table


def coordinates(study: Study) -> list[VariedCoordinate]:
    """The coordinates that vary."""
    return [
        VariedCoordinate(
            name=each.name,
            hardpoint=each.hardpoint,
            unit=each.unit,
            law=str(each.law),
            scale=each.scale,
            values=[*each.values],
        )
        for each in study.variation.coordinates
    ]
