"""Figures of the report, as Plotly JSON: outputs against the driver, and each engine's error.

The page's style sheet colours the traces, so that dark mode and print need no second set of
figures. Samples refer to the driver's values by the word "driver"; the page inserts the values.
"""

from __future__ import annotations

import html
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..harness.labels import output_label
from ..harness.record import Deviation, OutputSeries
from .axis import DISPLAY, Axis

Figure: TypeAlias = dict[str, Any]
Values: TypeAlias = Sequence[float | None]

MARKERS = 9  # per curve, staggered, so that coincident curves stay tellable
# one more than is told where a curve is pointed at; engines that agree in these are packed as one
DIGITS = 10
THIN = 1 / 2000  # a band narrower than this part of the curve's range is less than a pixel

# Okabe and Ito: told apart by colour-blind readers
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
DASHES = ("solid", "12px,5px", "3px,3px", "12px,4px,3px,4px", "7px,7px")
SYMBOLS = (
    "circle-open",
    "square-open",
    "diamond-open",
    "triangle-up-open",
    "x-thin-open",
    "cross-thin-open",
    "asterisk-open",
)


@dataclass(frozen=True)
class Style:
    """How an engine is drawn, the same in every figure of a page."""

    key: str
    name: str
    colour: str
    dash: str
    symbol: str

    @classmethod
    def number(cls, index: int, name: str) -> Style:
        """The style of the index-th engine."""
        k = index % len(COLOURS)
        return cls(
            f"s{k}", name, COLOURS[k], DASHES[index % len(DASHES)], SYMBOLS[index % len(SYMBOLS)]
        )


def plain(text: str) -> str:
    """Return text for Plotly to show unchanged; it takes tags and links for mark-up."""
    return html.escape(text, quote=False)


def output_figure(
    output: str,
    axis: Axis,
    curves: Sequence[tuple[Style, OutputSeries]],
    truth: OutputSeries | None,
    band: tuple[OutputSeries, float] | None,
) -> Figure:
    """All engines' positions against the driver, over the reference.

    Args:
        curves: the engines and their outputs; at least one.
        truth: the reference.
        band: the values compared with, and the tolerance; drawn if it is wide enough to be seen.
    """
    unit, scale = DISPLAY.get(curves[0][1].unit, (curves[0][1].unit, 1.0))
    traces: list[Figure] = []

    def curve(values: Sequence[float | None], driver: Any = "driver", **options: Any) -> Figure:
        x, y = (values, driver) if axis.up else (driver, values)
        return {"type": "scatter", "x": x, "y": y, **options}

    if band is not None and not band_is_thin(*band):
        standard, tolerance = _taken(band[0].position, axis.kept, scale), scale * band[1]
        known = [(v, d) for v, d in zip(standard, axis.shown, strict=False) if v is not None]
        around = [v - tolerance for v, _ in known] + [v + tolerance for v, _ in reversed(known)]
        there = [d for _, d in known]
        look: Figure = {
            "mode": "lines",
            "fill": "toself",
            "line": {"width": 0},
            "hoverinfo": "skip",
            "uid": "band",
        }
        traces.append(
            curve(
                around,
                there + there[::-1],
                **look,
                fillcolor="rgba(128,128,128,0.18)",
                meta="reference",
            )
        )
    if truth is not None:
        values = _taken(truth.position, axis.kept, scale)
        line = {"width": 6, "color": "rgba(128,128,128,0.45)"}
        traces.append(
            curve(
                values, mode="lines", line=line, name="reference", uid="reference", meta="reference"
            )
        )
    for index, (style, series) in enumerate(curves):
        values = _taken(series.position, axis.kept, scale)
        line = {"width": 2, "color": style.colour, "dash": style.dash}
        traces.append(
            curve(
                values,
                mode="lines",
                line=line,
                name=plain(style.name),
                uid=style.key,
                meta=style.name,
            )
        )
        stride = max(len(curves), len(values) // MARKERS)
        some = range(index * stride // len(curves), len(values), stride)
        marker = {"size": 9, "symbol": style.symbol, "color": style.colour, "line": {"width": 1.8}}
        look = {
            "mode": "markers",
            "marker": marker,
            "hoverinfo": "skip",
            "uid": f"{style.key}-markers",
            "meta": style.name,
        }
        traces.append(curve([values[k] for k in some], [axis.shown[k] for k in some], **look))
    value_axis: Figure = {
        "title": {"text": plain(f"{output_label(output)} [{unit}]")},
        "hoverformat": ".9g",
        "zeroline": True,
    }
    moved_axis: Figure = {
        "title": {"text": plain(axis.title)},
        "hoverformat": ".6~g",
        "zeroline": True,
    } | _ticks(axis)
    if axis.up < 0:
        moved_axis["autorange"] = "reversed"
    sides = (
        {"xaxis": value_axis, "yaxis": moved_axis}
        if axis.up
        else {"xaxis": moved_axis, "yaxis": value_axis}
    )
    return {
        "data": traces,
        "layout": {**sides, "hovermode": "y unified" if axis.up else "x unified"},
    }


def band_is_thin(standard: OutputSeries, tolerance: float) -> bool:
    """Whether the tolerance band would be hidden behind the line."""
    known = [v for v in standard.position if v is not None]
    return not known or 2 * tolerance < THIN * (max(known) - min(known))


def error_figure(
    motion: str,
    unit: str,
    axis: Axis,
    curves: Sequence[tuple[Style, Values, Deviation]],
    standard: Values,
) -> Figure:
    """Absolute error of each engine per sample on a log axis, with the tolerance and the worst
    sample.

    An error of zero has no place on the axis: the page draws it on a labelled floor,
    `layout.meta.floor`.

    Args:
        unit: of the errors.
        curves: the judged engines and their deviations; at least one.
        standard: the values compared with.
    """
    traces: list[Figure] = []
    for style, values, _ in curves:
        errors = _taken(absolute_errors(values, standard), axis.kept, 1.0)
        # three digits are as many as an error deserves, and keep the page small
        rounded = [None if e is None else float(f"{e:.2e}") for e in errors]
        line = {"width": 1.2, "color": style.colour, "dash": style.dash}
        marker = {
            "size": 5,
            "symbol": style.symbol,
            "color": style.colour,
            "maxdisplayed": 3 * MARKERS,
        }
        look = {
            "name": plain(style.name),
            "uid": style.key,
            "meta": style.name,
            "line": line,
            "marker": marker,
        }
        traces.append(
            {"type": "scatter", "mode": "lines+markers", "x": "driver", "y": rounded, **look}
        )
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
    side, floor = log_axis(f"{motion} error [{unit}]", low, high)
    layout: Figure = {
        "xaxis": (
            {"title": {"text": plain(axis.label)}, "hoverformat": ".6~g", "zeroline": False}
            | _ticks(axis)
        ),
        "yaxis": side,
        "hovermode": "x unified",
        "meta": {"floor": floor},
    }
    if tolerance:
        line = {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": tolerance, "y1": tolerance}
        below = {
            "type": "rect",
            "xref": "paper",
            "x0": 0,
            "x1": 1,
            "y0": floor / 10,
            "y1": tolerance,
            "layer": "below",
        }
        layout["shapes"] = [
            {**below, "line": {"width": 0}, "fillcolor": "rgba(0,158,115,0.07)"},
            {**line, "line": {"width": 1.5, "dash": "dot", "color": "#7f7f7f"}},
        ]
    return {"data": traces, "layout": layout}


def log_axis(title: str, low: float, high: float) -> tuple[Figure, float]:
    """A log axis for errors, and its lowest line: the floor, on which the page draws errors of
    exactly zero.

    Args:
        low, high: the smallest and the largest value, both above zero.
    """
    first, last = math.floor(math.log10(low)) - 1, math.ceil(math.log10(high)) + 0.5
    stride = max(1, math.ceil((last - first) / 6))
    decades = range(first + 1, math.floor(last) + 1, stride)
    powers = [f"10<sup>\N{MINUS SIGN}{-d}</sup>" if d < 0 else f"10<sup>{d}</sup>" for d in decades]
    axis: Figure = {
        "type": "log",
        "title": {"text": plain(title)},
        "range": [first - 0.4, last],
        "tickvals": [10.0**first, *(10.0**d for d in decades)],
        "ticktext": ["exactly 0", *powers],
    }
    return axis, 10.0**first


def absolute_errors(values: Values, standard: Values) -> list[float | None]:
    """Return the distance from the standard at each sample; None if either is unknown."""
    return [
        None if a is None or b is None else abs(a - b)
        for a, b in zip(values, standard, strict=True)
    ]


def _taken(values: Values, kept: Sequence[int], scale: float) -> list[float | None]:
    # JSON has no NaN and no infinity; both mean here that there is nothing to draw.
    taken = (values[k] if k < len(values) else None for k in kept)
    return [
        float(f"{scale * v:.{DIGITS}g}") if v is not None and math.isfinite(v) else None
        for v in taken
    ]


def _ticks(axis: Axis) -> Figure:
    if axis.unit == "°" and axis.values and max(axis.values) - min(axis.values) > math.pi:
        return {"dtick": 90}
    return {}
