"""Variants inside and outside of specification limits, and capability indices.

A variant is inside the limits of an output if it is inside at every sample. It is outside if it is
outside at any sample. An incomplete variant does not reach all samples, or lacks a value of the
output at a sample where the nominal design has one. It is outside too, as it was never seen to be
inside; or all incomplete variants are left out, whatever their other samples are. The yield is the
share of inside variants among the judged ones.

    Cp  = (high - low) / (6 s)
    Cpk = min(high - m, m - low) / (3 s)

Here m is the mean and s the standard deviation of the variants at one sample. Both indices assume a
normal distribution. The index by quantiles does not (ISO 22514-2, percentile method):

    min((high - x50) / (x99.865 - x50), (x50 - low) / (x50 - x0.135))

The result is the smallest value of each index over the samples.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from ...trajectory import Array
from .statistics import Summary
from .study import Study
from .study_choices import Incomplete, Mode

CONFIDENCE = 0.95
# Share of a normal distribution below -3 standard deviations, and above +3.
TAIL = 0.00135
# A spread below this share of the limits or of the mean is round-off: all variants are equal.
NO_SPREAD = 1e-12


class Capability(msgspec.Struct, frozen=True, kw_only=True):
    """Conformance of an output to its limits, over all variants [SI].

    Attributes:
        output: name of the output; empty for all limits together.
        low, high: the limits; null without a limit.
        known: number of judged variants: all, or the complete ones.
        below, above: number of judged variants below or above at some sample; a variant may be
            both.
        outside: number of judged variants outside.
        incomplete: number of incomplete variants.
        share: the yield, (known - outside) / known.
        share_of_all, share_of_complete: the yield with incomplete variants outside and left out;
            one of them is `share`.
        interval: 95 % confidence interval of the yield, by Clopper and Pearson; null unless
            the variants are drawn.
        cp, cpk, by_quantiles: smallest index over the samples; null if the spread is zero or no
            distribution is drawn; by_quantiles also if the variants are too few.
        sample: index of the sample with the smallest Cpk.
    """

    output: str
    unit: str
    low: float | None
    high: float | None
    known: int
    below: int
    above: int
    outside: int
    incomplete: int
    share: float | None
    share_of_all: float | None
    share_of_complete: float | None
    interval: tuple[float, float] | None
    cp: float | None = None
    cpk: float | None = None
    by_quantiles: float | None = None
    sample: int | None = None


def _least(index: Array) -> tuple[float | None, int | None]:
    """Return the smallest value of an index over the samples, and its sample."""
    if np.isnan(index).all():
        return None, None
    sample = int(np.nanargmin(index))
    value = float(index[sample])
    return value if math.isfinite(value) else None, sample


def capabilities(
    study: Study,
    counts: NDArray[np.int64],
    whole: Summary,
    kept: Sequence[Sequence[Array]],
    incomplete: Incomplete,
) -> list[Capability]:
    """Return the conformance of every limited output, then of all limits together.

    Args:
        counts: `Chunk.limited`, summed over all chunks.
        kept: values of the random subset by row, in parts of shape (n, V).
    """
    if not study.limits:
        return []
    found = [
        _with_indices(study, k, _of_counts(study, k, counts[k], incomplete), whole, kept)
        for k in range(len(study.limits))
    ]
    return [*found, _of_counts(study, None, counts[-1], incomplete)]


def _of_counts(
    study: Study, index: int | None, counts: NDArray[np.int64], incomplete: Incomplete
) -> Capability:
    total, lacking, *of_all = map(int, counts[:4])
    *of_complete, off = map(int, counts[4:])
    complete = total - lacking
    inside = complete - off
    ignored = incomplete is Incomplete.IGNORE
    known, (below, above) = (complete, of_complete) if ignored else (total, of_all)
    drawn = study.variation.mode is Mode.MONTE_CARLO
    limit = None if index is None else study.limits[index]
    row = None if limit is None else study.rows[limit.row]
    return Capability(
        output="" if row is None else row.name,
        unit="" if row is None else row.unit,
        low=None if limit is None or math.isinf(limit.low) else limit.low,
        high=None if limit is None or math.isinf(limit.high) else limit.high,
        known=known,
        below=below,
        above=above,
        outside=known - inside,
        incomplete=lacking,
        share=inside / known if known else None,
        share_of_all=inside / total if total else None,
        share_of_complete=inside / complete if complete else None,
        interval=_interval(inside, known) if known and drawn else None,
    )


def _interval(inside: int, known: int) -> tuple[float, float]:
    import scipy.stats  # pyright: ignore[reportMissingTypeStubs]

    binomial: Any = scipy.stats
    found = binomial.binomtest(inside, known).proportion_ci(CONFIDENCE, method="exact")
    return float(found.low), float(found.high)


def _with_indices(
    study: Study,
    index: int,
    found: Capability,
    whole: Summary,
    kept: Sequence[Sequence[Array]],
) -> Capability:
    if study.variation.mode is not Mode.MONTE_CARLO:
        return found
    limit = study.limits[index]
    mean, spread = whole.mean[limit.row], whole.deviation[limit.row]
    size = np.fmax(np.abs(mean), limit.size)
    spread = np.where(spread > NO_SPREAD * size, spread, 0.0)
    values = np.concatenate(kept[limit.row], axis=1)
    with np.errstate(all="ignore"):
        cp, _ = _least((limit.high - limit.low) / (6.0 * spread))
        cpk, sample = _least(np.minimum(limit.high - mean, mean - limit.low) / (3.0 * spread))
    both = math.isfinite(limit.high - limit.low)
    return msgspec.structs.replace(
        found,
        cp=cp if both else None,
        cpk=cpk,
        by_quantiles=_by_quantiles(values[spread > 0.0], limit.low, limit.high),
        sample=sample,
    )


def _by_quantiles(values: Array, low: float, high: float) -> float | None:
    """Return the smallest index by quantiles of values of shape (n, V); None if V is too small."""
    if values.shape[1] * TAIL < 1.0 or not np.isfinite(values).any():
        return None
    known = values[np.isfinite(values).any(axis=1)]
    below, middle, above = np.nanquantile(known, (TAIL, 0.5, 1.0 - TAIL), axis=1)
    with np.errstate(all="ignore"):
        index = np.minimum((high - middle) / (above - middle), (middle - low) / (middle - below))
    return _least(index)[0]


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
