"""The results of a study as CSV, in the units of its file. A missing value is an empty field."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from typing import Any

from ...case.io.escape import cell
from .page import effect
from .results import SweepResults

_STATISTICS = ("nominal", "count", "min", "max", "mean", "standard_deviation")


def envelope_csv(results: SweepResults) -> str:
    """Return a line for each output and sample."""
    swept = next(iter(results.driver))
    probabilities = list(next(iter(results.outputs.values())).quantiles)
    errors = any(each.standard_errors for each in results.outputs.values())
    columns = ["output", "unit", "sample", swept, "driver_unit", *_STATISTICS]
    columns += [f"quantile_{p}" for p in probabilities]
    columns += [f"standard_error_{p}" for p in probabilities] if errors else []
    columns += ["partial"] if results.partial else []
    partial = [f"{results.partial} variants"] if results.partial else []
    driver_unit, driver_scale = results.shown_driver
    rows: list[Sequence[Any]] = []
    for name, each in results.outputs.items():
        unit, scale = results.shown_unit(each.unit)
        numbers = [
            getattr(each, key) if key == "count" else scaled(scale, getattr(each, key))
            for key in _STATISTICS
        ]
        quantiles = [*each.quantiles.values(), *(each.standard_errors or {}).values()]
        numbers += [scaled(scale, column) for column in quantiles]
        for k, value in enumerate(scaled(driver_scale, results.driver[swept])):
            found = (column[k] for column in numbers)
            rows.append([name, unit, k, value, driver_unit, *found, *partial])
    return _csv(columns, rows)


def gradient_csv(results: SweepResults) -> str:
    """Return a line for each output and coordinate."""
    numbers = ("at_design", "largest", "error")
    columns = ["output", "coordinate", "unit", "at_design", "largest", "sample", "error"]
    columns += ["accurate", "scale", "scale_unit", "effect", "effect_unit"]
    rows: list[Sequence[Any]] = []
    for each in results.gradients:
        unit, scale = results.shown_unit(results.outputs[each.output].unit)
        its, factor = results.shown_unit(results.unit_of(each.coordinate))
        at, largest, error = scaled(scale / factor, [getattr(each, key) for key in numbers])
        rows.append(
            [
                *(each.output, each.coordinate, f"({unit})/({its})"),
                *(at, largest, each.sample, error, each.accurate),
                *(factor * each.scale, its, scale * effect(each), unit),
            ]
        )
    return _csv(columns, rows)


def limits_csv(results: SweepResults) -> str:
    """Return a line for each limited output, and one for all limits together."""
    columns = ["output", "unit", "low", "high", "known", "below", "above", "outside", "incomplete"]
    columns += ["yield", "yield_from", "yield_to", "yield_of_all", "yield_of_complete"]
    columns += ["cp", "cpk", "cpk_by_quantiles", "sample"]
    rows: list[Sequence[Any]] = []
    for each in results.limits:
        unit, scale = results.shown_unit(each.unit)
        counts = (each.known, each.below, each.above, each.outside, each.incomplete)
        interval = each.interval or (None, None)
        indices = (each.cp, each.cpk, each.by_quantiles, each.sample)
        limits = scaled(scale, [each.low, each.high])
        name = each.output or "all"
        shares = (each.share_of_all, each.share_of_complete)
        rows.append([name, unit, *limits, *counts, each.share, *interval, *shares, *indices])
    return _csv(columns, rows)


def scaled(scale: float, values: Iterable[float | None]) -> list[float | None]:
    """Return numbers times a factor; None stays None."""
    return [None if value is None else scale * value for value in values]


def _csv(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([cell(each) for each in row] for row in rows)
    return text.getvalue()
