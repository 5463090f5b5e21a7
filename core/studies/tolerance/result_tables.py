"""Tables of the results of a study, from its chunks and gradients."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ...trajectory import Array
from .gradients import Gradients
from .histograms import Histogram
from .reduce import QUANTILES, Quantiles, Summary
from .results import Correlated, Effect, Envelope, Gradient, Numbers, VariedCoordinate
from .study import Study


def numbers(values: Array) -> Numbers:
    """Return numbers, None for NaN."""
    return [value if math.isfinite(value) else None for value in values.tolist()]


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
    """Return the effects of a study of one coordinate at a time.

    Args:
        effects: the largest changes by variant, shape (rows,).
    """
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
    """Return the varied coordinates."""
    return [
        VariedCoordinate(
            name=each.name,
            hardpoint=each.hardpoint,
            unit=each.unit,
            law=str(each.law),
            scale=each.scale,
            values=[*each.values],
            bound=each.bound,
        )
        for each in study.variation.coordinates
    ]


def correlations(study: Study) -> list[Correlated]:
    """Return the correlations of coordinates."""
    names = [each.name for each in study.variation.coordinates]
    return [
        Correlated(coordinates=[names[row] for row in each.rows], matrix=each.matrix.tolist())
        for each in study.variation.correlations
    ]
