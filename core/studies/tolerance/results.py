"""The results of a study as data: the JSON schema kincheck-sweep/1. SI units; what was not computed
is null.
"""

from __future__ import annotations

from typing import Any, Literal

import msgspec
import numpy as np

from ...case.units import ANGLES, LENGTHS, in_units
from ...dataset import Dataset, Variable
from ...harness.record import Outcome
from ...report.axis import DRIVER_UNITS
from ...tabular import Tabular
from .conformance import Capability
from .cross_check import Checked
from .histograms import Histogram

Numbers = list[float | None]


class VariedCoordinate(msgspec.Struct, frozen=True, kw_only=True):
    """A coordinate that varies.

    Attributes:
        law: normal, truncated_normal, uniform, triangular, or values.
        scale: standard deviation, half width, or the largest offset [unit].
        values: the offsets [unit] where they are listed.
        bound: largest offset of a truncated normal distribution [unit]; zero of all others.
    """

    name: str
    hardpoint: str
    unit: str
    law: str
    scale: float
    values: list[float] = []
    bound: float = 0.0


class Correlated(msgspec.Struct, frozen=True, kw_only=True):
    """Coordinates that are drawn with a matrix of correlations, by a Gaussian copula."""

    coordinates: list[str]
    matrix: list[list[float]]


class Envelope(msgspec.Struct, frozen=True, kw_only=True):
    """One output, or a derivative of it, over all variants; lists have a number for each sample
    [unit].

    Attributes:
        nominal: at the nominal design.
        count: variants that have a value.
        quantiles: by probability; `quantiles_of` says of how many variants.
        standard_errors: of the quantiles, by probability; null where they are exact.
        min_variant, max_variant: the variants with the least and the most of all samples.
        histogram: at the sample of the least capability or, without limits, of the largest spread.
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
        quantiles_of: how many variants the quantiles and histograms are of.
        sampling: choice of the drawn variants: random, latin or sobol.
        length_unit, angle_unit: in which tables and figures show the numbers.
        limits: how outputs keep their specification limits; the last is of all limits together.
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
    sampling: str = "random"
    correlations: list[Correlated] = []
    length_unit: str = "m"
    angle_unit: str = "rad"
    limits: list[Capability] = []

    def shown_unit(self, unit: str) -> tuple[str, float]:
        """Return the unit in which tables and figures show numbers of an SI unit, and the factor to
        it.
        """
        name, size = in_units(unit, LENGTHS[self.length_unit], ANGLES[self.angle_unit])
        return name, 1.0 / size

    @property
    def shown_driver(self) -> tuple[str, float]:
        """The unit in which tables and figures show the values of the swept driver, and the factor
        to it.
        """
        case = self.run["cases"].get(self.case, {})
        return self.shown_unit(DRIVER_UNITS.get(case.get("driver", {}).get("type", ""), ""))

    def unit_of(self, coordinate: str) -> str:
        """Return the SI unit of a coordinate that varies."""
        return next(each.unit for each in self.coordinates if each.name == coordinate)

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
