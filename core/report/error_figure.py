"""Figures of differences to the standard, on log axes with a floor for exact zeros."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..harness.record import Deviation
from ..unit_text import motion_word, with_unit
from .axis import Axis
from .figures import MARKERS, Figure, Style, Values, taken, ticks

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def error_figure(
    motion: str,
    unit: str,
    axis: Axis,
    curves: Sequence[tuple[Style, Values, Deviation]],
    standard: Values,
) -> Figure:
    """Return the absolute error of each engine per sample on a log axis, with the tolerance and the
    worst sample.

    An error of zero has no place on the axis: the page draws it on a labelled floor,
    `layout.meta.floor`.

    Args:
        unit: unit of the errors.
        curves: at least one judged engine, each with its deviations.
        standard: the values of the standard.
    """
    traces: list[Figure] = []
    for style, values, _ in curves:
        errors = taken(absolute_errors(values, standard), axis.kept, 1.0)
        # three digits suffice for an error, and keep the page small
        rounded = [None if e is None else float(f"{e:.2e}") for e in errors]
        curve = style.curve("driver", rounded, width=1.2, size=5)
        curve["marker"]["maxdisplayed"] = 3 * MARKERS
        traces.append(curve)
    worst = max((deviation for *_, deviation in curves), key=lambda deviation: deviation.max_abs)
    if worst.worst_step < len(axis.values) and 0 < worst.max_abs < math.inf:
        place = {
            "x": [axis.scale * axis.values[worst.worst_step]],
            "y": [worst.max_abs],
            "hoverinfo": "skip",
        }
        ring = {"size": 15, "symbol": "circle-open", "color": "#7f7f7f", "line": {"width": 2}}
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                **place,
                "marker": ring,
                "uid": "worst",
                "meta": "worst",
            }
        )
    tolerance = worst.tolerance
    positive = [e for trace in traces for e in trace["y"] if e]
    ends = positive + ([tolerance] if tolerance else [])
    low, high = min(positive, default=(tolerance or 1e-9) * 1e-6), max(ends, default=1.0)
    side, floor = log_axis(with_unit(f"{motion_word(motion, unit)} difference", unit), low, high)
    layout: Figure = {
        "xaxis": (
            {"title": {"text": axis.label}, "hoverformat": ".6~g", "zeroline": False} | ticks(axis)
        ),
        "yaxis": side,
        "hovermode": "x unified",
        "meta": {"floor": floor},
    }
    if tolerance:
        layout["shapes"] = accepted(floor, tolerance)
    return {"data": traces, "layout": layout}


def accepted(floor: float, tolerance: float) -> list[Figure]:
    """Return the field of accepted errors above a floor, and the line of the tolerance over it."""
    across = {"xref": "paper", "x0": 0, "x1": 1, "y1": tolerance}
    below = {"type": "rect", **across, "y0": floor / 10, "layer": "below"}
    return [
        {**below, "line": {"width": 0}, "fillcolor": "rgba(0,158,115,0.07)"},
        {
            "type": "line",
            **across,
            "y0": tolerance,
            "line": {"width": 1.5, "dash": "dot", "color": "#7f7f7f"},
        },
    ]


def log_axis(title: str, low: float, high: float) -> tuple[Figure, float]:
    """Return a log axis for errors, and the floor, its lowest line: the page draws zero errors
    there.

    Args:
        low, high: the smallest and the largest value, both above zero.
    """
    first, last = math.floor(math.log10(low)) - 1, math.ceil(math.log10(high)) + 0.5
    stride = max(1, math.ceil((last - first) / 6))
    decades = range(first + 1, math.floor(last) + 1, stride)
    powers = [f"10{str(d).translate(RAISED)}" for d in decades]
    axis: Figure = {
        "type": "log",
        "title": {"text": title},
        "range": [first - 0.4, last],
        "tickvals": [10.0**first, *(10.0**d for d in decades)],
        "ticktext": ["exactly 0", *powers],
    }
    return axis, 10.0**first


def absolute_errors(values: Values, standard: Values) -> list[float | None]:
    """Return the distance from the standard at each sample; None if a value is unknown."""
    return [
        None if a is None or b is None else abs(a - b)
        for a, b in zip(values, standard, strict=True)
    ]
