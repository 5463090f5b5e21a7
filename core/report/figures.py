"""Figures of the report in a part of Plotly's JSON: outputs against the driver, and differences.

`plot.js` draws it: traces of type scatter (lines, markers, closed bands) and bar, axes of type
linear, log and category, shapes of type line and rect. The style sheet has the engines' colours, so
that dark mode and print need no second set of figures. The word "driver" in a trace stands for the
driver's values, which the page inserts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..harness.labels import output_label
from ..harness.record import OutputSeries
from ..notebook_view import COLOURS
from ..unit_text import with_unit
from .axis import DISPLAY, Axis

Figure: TypeAlias = dict[str, Any]
Values: TypeAlias = Sequence[float | None]

MARKERS = 9  # markers per curve, staggered, so that coincident curves stay distinguishable
# digits: one more than the page shows at the pointer
DIGITS = 10
THIN = 1 / 2000  # a band narrower than this fraction of the curve's range is less than a pixel

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
    """Style of an engine, the same in every figure of a page."""

    key: str
    name: str
    colour: str
    dash: str
    symbol: str

    @classmethod
    def number(cls, index: int, name: str) -> Style:
        """Return the style of the index-th engine."""
        k = index % len(COLOURS)
        return cls(
            f"s{k}", name, COLOURS[k], DASHES[index % len(DASHES)], SYMBOLS[index % len(SYMBOLS)]
        )

    def curve(
        self, x: Any, y: Sequence[float | None], *, width: float = 1.8, size: int = 8
    ) -> Figure:
        """Return the trace of a curve with markers, with these sizes of line and markers."""
        return {
            "type": "scatter",
            "mode": "lines+markers",
            "x": x,
            "y": y,
            "name": self.name,
            "uid": self.key,
            "meta": self.name,
            "line": {"width": width, "color": self.colour, "dash": self.dash},
            "marker": {"size": size, "symbol": self.symbol, "color": self.colour},
        }


def output_figure(
    output: str,
    axis: Axis,
    curves: Sequence[tuple[Style, OutputSeries]],
    truth: OutputSeries | None,
    band: tuple[OutputSeries, float] | None,
) -> Figure:
    """Return all engines' positions against the driver, over the reference.

    Args:
        curves: the engines and their outputs; at least one.
        truth: values of the reference.
        band: the values compared with, and the tolerance; drawn if it is wide enough to be seen.
    """
    unit, scale = DISPLAY.get(curves[0][1].unit, (curves[0][1].unit, 1.0))
    traces: list[Figure] = []

    def curve(values: Sequence[float | None], driver: Any = "driver", **options: Any) -> Figure:
        x, y = (values, driver) if axis.up else (driver, values)
        return {"type": "scatter", "x": x, "y": y, **options}

    if band is not None and not band_is_thin(*band):
        standard, tolerance = taken(band[0].position, axis.kept, scale), scale * band[1]
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
        values = taken(truth.position, axis.kept, scale)
        line = {"width": 6, "color": "rgba(128,128,128,0.45)"}
        traces.append(
            curve(
                values, mode="lines", line=line, name="reference", uid="reference", meta="reference"
            )
        )
    for index, (style, series) in enumerate(curves):
        values = taken(series.position, axis.kept, scale)
        line = {"width": 2, "color": style.colour, "dash": style.dash}
        traces.append(
            curve(
                values,
                mode="lines",
                line=line,
                name=style.name,
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
        "title": {"text": with_unit(output_label(output), unit)},
        "hoverformat": ".9g",
        "zeroline": True,
    }
    if band is not None:
        value_axis |= _flat_range([series.position for _, series in curves], *band, scale)
    return {"data": traces, "layout": layout_over(axis, value_axis)}


def layout_over(axis: Axis, value_axis: Figure) -> Figure:
    """Return the layout of curves over a driver, whose axis is vertical if `axis.up` is not 0."""
    moved_axis: Figure = {
        "title": {"text": axis.title},
        "hoverformat": ".6~g",
        "zeroline": True,
    } | ticks(axis)
    if axis.up < 0:
        moved_axis["autorange"] = "reversed"
    moved, value = ("y", "x") if axis.up else ("x", "y")
    return {
        f"{moved}axis": moved_axis,
        f"{value}axis": value_axis,
        "hovermode": f"{moved} unified",
    }


def _flat_range(
    curves: Sequence[Values], standard: OutputSeries, tolerance: float, scale: float
) -> Figure:
    """Return the range of an axis for curves that vary by less than the tolerance: round-off drawn
    over the whole figure would look like a motion.
    """
    known = [v for curve in [*curves, standard.position] for v in curve if v is not None]
    finite = [v for v in known if math.isfinite(v)]
    if not finite or max(finite) - min(finite) >= tolerance:
        return {}
    middle = 0.5 * (max(finite) + min(finite))
    return {"range": [scale * (middle - 2 * tolerance), scale * (middle + 2 * tolerance)]}


def band_is_thin(standard: OutputSeries, tolerance: float) -> bool:
    """Return whether the tolerance band would be hidden behind the line."""
    known = [v for v in standard.position if v is not None]
    return not known or 2 * tolerance < THIN * (max(known) - min(known))


def taken(values: Values, kept: Sequence[int], scale: float) -> list[float | None]:
    """Return the kept values for drawing, scaled and rounded."""
    # JSON has neither NaN nor infinity; null stands for a value that cannot be drawn.
    taken = (values[k] if k < len(values) else None for k in kept)
    return [
        float(f"{scale * v:.{DIGITS}g}") if v is not None and math.isfinite(v) else None
        for v in taken
    ]


def ticks(axis: Axis) -> Figure:
    """Return the ticks of an axis of angles: quarter turns, if the axis has any."""
    if axis.unit == "°" and axis.values and max(axis.values) - min(axis.values) > math.pi:
        return {"dtick": 90}
    return {}
