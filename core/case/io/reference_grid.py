"""Grid of a reference: its rows at the samples of the sweep.

A row belongs to the sample with its driver value. If every row belongs to a sample, the reference
is compared at these samples, possibly fewer than the sweep's. Otherwise it is interpolated at the
samples within its range.

Three known errors of the values enter the tolerance: half a unit of the last printed digit, that of
the driver values times the slope, and the estimated error of the interpolation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...trajectory import Array
from ..interpolation import FEWEST, bounded, interpolated, matched, slopes
from ..printed import even, multiples
from ..units import Unit
from .document import fault
from .reference_samples import Samples

# Twelve digits of a driver value: a smaller error moves no output by as much as a tolerance; a
# rounded table has a larger error.
SAME_GRID = 1e-12


@dataclass(frozen=True, eq=False)
class Column:
    """A column of a reference at the samples.

    Attributes:
        values, uncertainty: SI, shape (n,); NaN at a sample without a value.
        reasons: parts of the uncertainty, each with its largest value [SI].
    """

    values: Array
    uncertainty: Array
    reasons: Sequence[tuple[str, float]]


class Grid:
    """The rows of a reference, and the samples of a sweep.

    Args:
        driver: unit of the driver values in the file.
        values: samples of the sweep [SI].
        own: whether the sweep has the samples of the reference.

    Raises:
        CaseError: no sample is within the range of the rows, or an interpolation has too few rows
            or two rows at one driver value.
    """

    def __init__(self, samples: Samples, driver: Unit, values: Array, *, own: bool) -> None:
        self._samples, self._at = samples, values
        self._written = np.array([row[0] for _, row in samples.rows])
        rows = np.array([driver(x) for x in self._written.tolist()])
        self._allowed = allowed = SAME_GRID * float(np.max(np.abs(values)))
        self._index = np.arange(len(rows)) if own else matched(rows, values, allowed)
        self._full = any(printed.exact for printed in samples.printed[1:])
        half = samples.printed[0].half(self._written) * abs(driver(1.0))
        if (self._index is not None and not own) or self._set():
            half = np.zeros_like(half)  # the driver values are exact as printed
        self._order = np.argsort(rows, kind="stable")
        self._x, self._half = rows[self._order], float(half.max())
        slack = max(allowed, self._half)
        self._within = (values >= self._x[0] - slack) & (values <= self._x[-1] + slack)
        if self._index is None:
            self._check(driver, values)

    def _set(self) -> bool:
        """Return whether somebody set the driver values, so that they are not rounded."""
        printed, values = self._samples.printed[0], self._written
        return printed.as_set or even(values) or multiples(values, printed.decimals or 0)

    def _check(self, driver: Unit, values: Array) -> None:
        """Refuse rows unfit for interpolation."""
        samples, at = self._samples, 'or take its samples: [sweep] at = "reference"'
        if not self._within.any():
            low, high = (driver.written(float(x)) for x in (self._x[0], self._x[-1]))
            ends = " to ".join(driver.written(float(x)) for x in (values[0], values[-1]))
            problem = f"found driver values from {low} to {high}, expected some within the sweep"
            raise fault(samples.file, samples.key, f"{problem}, {ends}; correct one, {at}")
        if len(self._x) < FEWEST:
            off = np.abs(self._x[:, None] - values).min(axis=1)
            k = int(self._order[off.argmax()])
            nearest = values[np.abs(values - driver(float(self._written[k]))).argmin()]
            problem = (
                f"found driver value {samples.driver_value(k)} {driver.name} at no sample of the"
                f" sweep, the nearest is {driver.written(float(nearest))}, expected {FEWEST} rows"
                f" or more to interpolate, found {len(self._x)}"
            )
            raise fault(samples.file, samples.rows[k][0], f"{problem}; correct it, {at}")
        twice = np.flatnonzero(np.diff(self._x) <= 0.0)
        if twice.size:
            k = int(self._order[twice[0] + 1])
            problem = f"found driver value {samples.driver_value(k)} {driver.name} twice"
            raise fault(
                samples.file,
                samples.rows[k][0],
                f"{problem}, expected it once where rows are interpolated; remove one, {at}",
            )

    @property
    def words(self) -> str:
        """The samples with a reference value, in words; empty for all samples."""
        rows, samples = len(self._x), len(self._at)
        if self._index is None:
            where = f"interpolated at {int(self._within.sum())} of {samples} samples"
            return f"{rows} rows on a grid of their own, {where}"
        there = int((self._index >= 0).sum())
        return "" if there == samples else f"rows for {there} of {samples} samples"

    def column(self, k: int, scale: Callable[[float], float]) -> Column:
        """Return a column at the samples.

        Args:
            scale: conversion from the unit of the file to SI.
        """
        written = np.array([row[k] for _, row in self._samples.rows])
        printed = self._samples.printed[k]
        y = np.array([scale(value) for value in written.tolist()])
        half = printed.half(written) * abs(scale(1.0))
        if self._full and even(written):  # a file of all digits has them here too
            half = np.zeros_like(half)
        error = np.zeros_like(self._at)
        if self._index is not None:
            there = self._index >= 0
            values = np.where(there, y[self._index], np.nan)
            rounding = np.where(there, half[self._index], 0.0)
        else:
            ordered = y[self._order]
            values, error = interpolated(self._x, ordered, self._at)
            values = np.where(self._within, values, np.nan)
            above = np.clip(np.searchsorted(self._x, self._at), 1, len(self._x) - 1)
            around = np.stack([above - 1, above])
            at_row = (np.abs(self._x[around] - self._at) <= self._allowed).any(axis=0)
            error = np.where(self._within & ~at_row, error, 0.0)
            rounding = bounded(self._x, half[self._order], self._at, self._within)
        shifted = np.zeros_like(self._at)
        if self._half and len(self._x) > 1:
            shifted = self._half * slopes(self._x, y[self._order], self._at)
            shifted = np.where(np.isfinite(values), shifted, 0.0)
        parts = {
            f"printed to {printed.significant} digits": rounding,
            f"driver values printed to {self._samples.printed[0].significant} digits": shifted,
            f"interpolated between {len(self._x)} rows": error,
        }
        reasons = [(why, float(each.max())) for why, each in parts.items() if each.any()]
        return Column(values, rounding + shifted + error, reasons)
