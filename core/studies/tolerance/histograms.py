"""Histograms of an output over the variants at one sample."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec
import numpy as np

from ...trajectory import Array
from .conformance import NO_SPREAD, Capability
from .reduce import Summary
from .study import Study

# The number of bins is the square root of the number of variants, within these bounds.
FEWEST, MOST = 5, 30


class Histogram(msgspec.Struct, frozen=True, kw_only=True):
    """Counts of the variants by the value of an output at one sample.

    Attributes:
        sample: the sample of the smallest Cpk or, without limits, of the largest spread.
        edges: edges of the bins [SI], one more than `counts`.
        counts: number of variants in each bin, from the random subset of the quantiles.
    """

    sample: int
    edges: list[float]
    counts: list[int]


def worst_sample(
    study: Study, limits: Sequence[Capability], whole: Summary, row: int
) -> int | None:
    """Return the sample of a row's histogram; None if the row has no spread."""
    name = study.rows[row].name
    named = [each.sample for each in limits if each.output == name and each.sample is not None]
    spread = whole.deviation[row]
    if named:
        return named[0]
    return int(np.nanargmax(spread)) if np.nansum(spread) > 0.0 else None


def histogram(parts: Sequence[Array], sample: int | None) -> Histogram | None:
    """Return the histogram of variants at a sample; None if all are equal.

    Args:
        parts: values, shape (n, V) each.
    """
    if sample is None:
        return None
    values = np.concatenate([part[sample] for part in parts])
    values = values[np.isfinite(values)]
    if not values.size or np.ptp(values) <= NO_SPREAD * np.abs(values).max():
        return None
    bins = min(MOST, max(FEWEST, math.isqrt(len(values))))
    counts, edges = np.histogram(values, bins)
    return Histogram(sample=sample, edges=edges.tolist(), counts=counts.tolist())


BARS = "▁▂▃▄▅▆▇█"


def sparkline(found: Histogram) -> str:
    """Return the histogram as text, one block for each bin; a blank is an empty bin."""
    most = max(found.counts)
    return "".join(
        BARS[math.ceil(len(BARS) * count / most) - 1] if count else " " for count in found.counts
    )
