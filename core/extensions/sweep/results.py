"""The results of a study as data: the JSON schema kincheck-sweep/1.

Numbers are in SI units. A number is null if it was not computed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import msgspec
import numpy as np

from ...case.units import ANGLES, LENGTHS, Unit
from ...dataset import Dataset, Variable
from ...errors import number_of
from ...harness.compare import numbers
from ...harness.record import Outcome
from ...harness.table_units import driver_unit
from ...tabular import Tabular
from ...trajectory import Array
from .conformance import Capability, Histogram
from .cross_check import Checked
from .statistics import QUANTILES, Quantiles, Summary
from .study import Gradients, Study, Unsolved
from .study_choices import Mode
from .variation import Law

Numbers = list[float | None]


class VariedCoordinate(msgspec.Struct, frozen=True, kw_only=True):
    """A varied coordinate.

    Attributes:
        scale: standard deviation, half width, or the largest offset [unit].
        values: the offsets [unit], if they are listed.
        bound: largest offset of a truncated normal distribution [unit]; zero for other laws.
    """

    name: str
    hardpoint: str
    unit: str
    law: Law
    scale: float
    values: list[float] = []
    bound: float = 0.0


class Correlated(msgspec.Struct, frozen=True, kw_only=True):
    """Coordinates drawn with a correlation matrix, by a Gaussian copula."""

    coordinates: list[str]
    matrix: list[list[float]]


class Envelope(msgspec.Struct, frozen=True, kw_only=True):
    """One output, or its derivative, over all variants; lists have a number for each sample [unit].

    Attributes:
        nominal: values at the nominal design.
        count: number of variants with a value.
        quantiles: quantiles by probability, of `quantiles_of` variants.
        standard_errors: standard errors of the quantiles, by probability; null if they are exact.
        min_variant, max_variant: the variants with the minimum and the maximum over all samples.
        histogram: at the sample of the smallest Cpk or, without limits, of the largest spread.
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
    histogram: Histogram | None = None

    @property
    def ends(self) -> tuple[float | None, ...]:
        """The least, the most, and the largest standard deviation, over all samples."""
        ways = ((min, self.min), (max, self.max), (max, self.standard_deviation))
        return tuple(way((x for x in xs if x is not None), default=None) for way, xs in ways)


class Gradient(msgspec.Struct, frozen=True, kw_only=True):
    """The derivative of an output by a coordinate at the nominal design [unit of output / unit of
    coordinate].

    Attributes:
        at_design: value at the design position; null if the case does not pass through it.
        along: values at the samples.
        largest: the value of largest size over the samples, with its sign.
        sample: the sample of `largest`.
        scale: scale of the coordinate.
        deviation: standard deviation of the coordinate's offsets, or the largest offset if one
            coordinate at a time varies [unit]; times `largest` it is the effect.
    """

    output: str
    coordinate: str
    unit: str
    at_design: float | None
    along: Numbers
    largest: float | None
    sample: int | None
    scale: float
    deviation: float


class Effect(msgspec.Struct, frozen=True, kw_only=True):
    """A variant of one coordinate at a time: by output, the largest change over the samples, with
    its sign [unit].
    """

    variant: int
    coordinate: str
    offset: float
    changes: dict[str, float | None]


class SweepResults(Tabular, msgspec.Struct, frozen=True, kw_only=True):
    """The results of a study.

    Attributes:
        run: its circumstances, as for a run: versions, machine, settings, and facts of the case.
        samples: number of finished variants.
        asked: number of requested variants; larger than `samples` if the sweep was stopped.
        quantiles_of: number of variants used for the quantiles and histograms.
        sampling: choice of the drawn variants: random, latin or sobol.
        length_unit, angle_unit: units of tables and figures.
        limits: conformance to the specification limits; the last entry is of all limits together.
        incomplete: judgement of variants that do not reach all samples: outside or ignore.
        driver: values at the samples by name, as in a run's records.
        unsolved: number of variants without a solution at some samples; `failed` lists the first.
        retried: number of variants solved again alone, with divided steps.
        checked: the variants cross-checked with the engine `check_engine`.
        measured: seconds, rate, and the peak memory of this process.
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
    effects: list[Effect] = []
    unsolved: int
    failed: list[Unsolved]
    retried: int
    check_engine: str | None = None
    checked: list[Checked] = []
    measured: dict[str, Any] = {}
    sampling: str = "random"
    correlations: list[Correlated] = []
    length_unit: str = "m"
    angle_unit: str = "rad"
    limits: list[Capability] = []
    incomplete: str = "outside"

    def shown_unit(self, unit: str) -> tuple[str, float]:
        """Return the unit of tables and figures for an SI unit, and the factor to it."""
        name, size = in_units(unit, LENGTHS[self.length_unit], ANGLES[self.angle_unit])
        return name, 1.0 / size

    @property
    def shown_driver(self) -> tuple[str, float]:
        """The unit of tables and figures for the swept driver, and the factor to it."""
        case = self.run["cases"].get(self.case, {})
        return self.shown_unit(driver_unit(case))

    def unit_of(self, coordinate: str) -> str:
        """Return the SI unit of a varied coordinate."""
        return next(each.unit for each in self.coordinates if each.name == coordinate)

    def summary(self) -> str:
        """Return the case, the mode, and the numbers of variants and of unsolved variants."""
        variants = (
            f"{self.partial} variants" if self.partial else number_of(self.samples, "variant")
        )
        found = f"{self.case}, {self.mode}, {variants}"
        missing = f"{self.unsolved} without a solution somewhere" if self.unsolved else ""
        return ", ".join(filter(None, [found, number_of(len(self.outputs), "output"), missing]))

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
        """The numbers of finished and of all variants of a stopped sweep; else empty."""
        return f"{self.samples} of {self.asked}" if self.samples < self.asked else ""

    @property
    def deviating(self) -> list[Checked]:
        """The checked variants with a bad outcome."""
        return [each for each in self.checked if each.outcome.bad]

    @property
    def unjudged(self) -> int:
        """The number of checked variants without a value to compare; all are unsolved."""
        return sum(each.outcome is Outcome.UNJUDGED for each in self.checked)

    @property
    def partly_judged(self) -> str:
        """The message of the first passing variant with uncompared rows; else empty."""
        passed = (each.message for each in self.checked if each.outcome is Outcome.PASS)
        return next(filter(None, passed), "")


BANDS = ("nominal", "mean", "min", "max", "standard_deviation")
"""Names of the curves of an envelope."""


def _bands(each: Envelope) -> list[Numbers]:
    return [getattr(each, name) for name in BANDS]


# Tables of the results, from the chunks and gradients of a study.


def envelopes(
    study: Study,
    whole: Summary,
    found: Sequence[Quantiles],
    nominal: Array,
    histograms: Sequence[Histogram | None],
) -> dict[str, Envelope]:
    """Return the envelope of every row, by name."""
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
            histogram=histograms[k],
        )
    return result


def _by_probability(values: Array) -> dict[str, Numbers]:
    return {f"{p:g}": numbers(each) for p, each in zip(QUANTILES, values, strict=True)}


def gradient_table(study: Study, found: Gradients) -> list[Gradient]:
    """Return every gradient, by output and coordinate."""
    table: list[Gradient] = []
    alone = study.variation.mode is Mode.ONE_AT_A_TIME
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
                    scale=coordinate.scale,
                    deviation=coordinate.scale if alone else coordinate.standard_deviation,
                )
            )
    return table


def effect_table(study: Study, effects: Array) -> list[Effect]:
    """Return the effects of a study of one coordinate at a time.

    Args:
        effects: the largest changes, shape (rows, variants); the first is the nominal design.
    """
    table: list[Effect] = []
    for variant, changes in [*enumerate(effects.T)][1:]:
        offsets = study.variation.of_variant(study.seed, variant)
        (moved,) = np.flatnonzero(offsets)
        by_row = zip((row.name for row in study.rows), numbers(changes), strict=True)
        table.append(
            Effect(
                variant=variant,
                coordinate=study.variation.coordinates[int(moved)].name,
                offset=float(offsets[moved]),
                changes=dict(by_row),
            )
        )
    return table


def coordinates(study: Study) -> list[VariedCoordinate]:
    """Return the varied coordinates."""
    varied = study.variation.coordinates
    return msgspec.convert(varied, list[VariedCoordinate], from_attributes=True)


def correlations(study: Study) -> list[Correlated]:
    """Return the correlations of coordinates."""
    names = [each.name for each in study.variation.coordinates]
    return [
        Correlated(coordinates=[names[row] for row in each.rows], matrix=each.matrix.tolist())
        for each in study.variation.correlations
    ]


def in_units(unit: str, length: Unit, angle: Unit) -> tuple[str, float]:
    """Return the name of an SI unit, N and s as they are, with other units of length and angle, and
    the size of one of it [SI]: N m with mm is N mm, a thousandth.
    """
    size, powers = 1.0, (1, *[-1] * unit.count("/"))
    parts = list[str]()
    for part, power in zip(unit.split("/"), powers, strict=True):
        names = [{"m": length, "rad": angle}.get(name, name) for name in part.split(" ")]
        for name in names:
            if isinstance(name, Unit):
                size = name.power(size, power)
        parts.append(" ".join(name.name if isinstance(name, Unit) else name for name in names))
    return "/".join(parts), size
