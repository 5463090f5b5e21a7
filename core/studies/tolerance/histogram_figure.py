"""Figure of a histogram of variants."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

from ...harness.labels import output_label
from ...report.figures import Figure
from ...unit_text import with_unit
from .histograms import Histogram

LIMIT: Figure = {"width": 1.5, "color": "#CC79A7", "dash": "8px,3px,2px,3px"}
"""Look of a specification limit."""


def histogram_figure(
    name: str, unit: str, scale: float, found: Histogram, limits: Mapping[str, float]
) -> Figure:
    """Return bars of the counts of variants by output value at one sample, with the limits.

    Args:
        scale: factor from SI to the unit.
        limits: the limits by name [unit].
    """
    pairs = [*pairwise(scale * edge for edge in found.edges)]
    bars: Figure = {
        "type": "bar",
        "x": [float(f"{0.5 * (low + high):.7g}") for low, high in pairs],
        "y": found.counts,
        "width": [float(f"{high - low:.7g}") for low, high in pairs],
        "name": "variants",
        "marker": {"color": "#0072B2"},
        "uid": "bars",
    }
    lines: list[Figure] = [
        {
            "type": "scatter",
            "mode": "lines",
            "x": [limit, limit],
            "y": [0, max(found.counts)],
            "name": which,
            "line": LIMIT,
            "uid": which,
        }
        for which, limit in limits.items()
    ]
    sides: Figure = {
        "xaxis": {"title": {"text": with_unit(output_label(name), unit)}, "hoverformat": ".5g"},
        "yaxis": {"title": {"text": "variants"}, "rangemode": "tozero"},
    }
    return {"data": [bars, *lines], "layout": {**sides, "hovermode": "closest"}}
