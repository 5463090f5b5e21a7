"""Figures of the report, as Plotly JSON: outputs against the driver, and each engine's error.

The page's style sheet colours the traces, so that dark mode and print need no second set of figures. Samples at the driver's
values refer to them by the word "driver"; the page puts the values in.
"""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..record import Deviation, OutputSeries, Record

Figure: TypeAlias = dict[str, Any]
Values: TypeAlias = Sequence[float | None]

SAMPLES = 2000  # a screen shows no more; longer series are thinned, the worst samples always kept
MARKERS = 9  # per curve, staggered, so that coincident curves stay tellable
THIN = 1 / 2000  # a band narrower than this part of the curve's range is less than a pixel

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")  # Okabe and Ito: told apart by colour-blind readers
DASHES = ("solid", "12px,5px", "3px,3px", "12px,4px,3px,4px", "7px,7px")
SYMBOLS = ("circle-open", "square-open", "diamond-open", "triangle-up-open", "x-open", "cross-open", "star-open")

_LABELS = {"half_track_change": "half-track change", "wheelbase_change": "wheel-base change"}
_DISPLAY = {"m": ("mm", 1e3), "rad": ("°", 180 / math.pi), "s": ("s", 1.0)}
_DRIVER_UNITS = {"point_coordinate": "m", "joint_displacement": "m", "joint_angle": "rad", "time": "s"}


def engine_name(record: Record) -> str:
    """The engine, with its mode unless it is projection: the same engine in another mode is another product."""
    return record.engine if record.mode == "projection" else f"{record.engine} · {record.mode}"


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
        return cls(f"s{k}", name, COLOURS[k], DASHES[index % len(DASHES)], SYMBOLS[index % len(SYMBOLS)])


@dataclass(frozen=True)
class Moved:
    """A driver, or time, at the samples: in SI, and what makes display units of that."""

    name: str
    unit: str
    scale: float
    values: list[float]

    @classmethod
    def of(cls, name: str, driver: Mapping[str, Any], values: list[float]) -> Moved:
        """What is known of a driver, its type above all, and its values."""
        unit, scale = _DISPLAY.get(_DRIVER_UNITS.get(driver.get("type", ""), ""), ("", 1.0))
        return cls(name.replace("_", " "), unit, scale, values)

    def at(self, step: int) -> str:
        """The value at a sample, in words."""
        if step >= len(self.values):
            return ""
        value = f"{self.scale * self.values[step]:+.4g}".replace("-", "\N{MINUS SIGN}")
        return f"{self.name} {value}{self.unit}" if self.unit == "°" else f"{self.name} {value} {self.unit}".rstrip()


@dataclass(frozen=True)
class Axis(Moved):
    """The axis of what is swept: its kept samples and their values as displayed.

    Attributes:
        title: as written beside the outputs' figures, with the sense of the motion.
        kept: indices of the samples drawn.
        vertical: drawn upwards against the outputs, as wheel travel is.
        further: the drivers that move besides, or while time is swept, and how, in words.
    """

    title: str
    kept: list[int]
    vertical: bool
    further: list[tuple[Moved, str]]

    def at(self, step: int) -> str:
        """The values of all drivers at a sample, in words."""
        return ", ".join(filter(None, (super().at(step), *(moved.at(step) for moved, _ in self.further))))

    @property
    def besides(self) -> str:
        """A sentence that names the drivers in `further`; empty where there are none."""
        named = [f"{moved.name} ({how})" if how else moved.name for moved, how in self.further]
        return f"{'Driven' if self.unit == 's' else 'Also driven'}: {', '.join(named)}." if named else ""

    @property
    def label(self) -> str:
        """Name and unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def shown(self) -> list[float]:
        """The kept values in display units."""
        return [self.scale * self.values[k] for k in self.kept]


def driver_axis(facts: Mapping[str, Any], records: Sequence[Record], worst: Iterable[int]) -> Axis:
    """The axis of what is swept.

    Args:
        facts: what is known of the case: its "driver" (name, type, point and direction), its "motions" by name; may be empty.
        records: the records of one case.
        worst: samples that thinning must keep.
    """
    series = next((record.driver for record in records if record.driver), dict[str, list[float]]())
    driver, motions = facts.get("driver", {}), facts.get("motions", {})
    key = driver.get("name") or next(iter(series), "driver")
    swept = Moved.of(key, driver, series.get(key, []))
    further = [
        (Moved.of(name, motions.get(name, {}), values), motions.get(name, {}).get("motion", {}).get("type", ""))
        for name, values in series.items()
        if name != key
    ]
    name, unit, values = swept.name, swept.unit, swept.values
    vertical = driver.get("type") == "point_coordinate"
    title = f"{name} [{unit}]" if unit else name
    if vertical and "wheel" in driver.get("point", "") and driver.get("direction", (0, 0, 0))[2] > 0.9:
        name, title = "wheel travel", f"rebound \N{LEFTWARDS ARROW}  wheel travel [{unit}]  \N{RIGHTWARDS ARROW} jounce"
    return Axis(name, unit, swept.scale, values, title, _kept(len(values), worst), vertical, further)


def _kept(count: int, worst: Iterable[int]) -> list[int]:
    if count <= SAMPLES:
        return list(range(count))
    even = (round(k * (count - 1) / (SAMPLES - 1)) for k in range(SAMPLES))
    return sorted({*even, *(step for step in worst if step < count)})


def output_label(name: str) -> str:
    """An output's name as suspension engineers write it."""
    return _LABELS.get(name, name.replace("_", " "))


def plain(text: str) -> str:
    """Text that Plotly shows as it is; it would take tags in it, links too, for mark-up."""
    return html.escape(text, quote=False)


def motion_unit(unit: str, motion: str) -> str:
    """The unit of a motion's derivative, e.g. m/s for a velocity in m."""
    return unit + {"position": "", "velocity": "/s", "acceleration": "/s²"}[motion]


def output_figure(
    output: str, axis: Axis, curves: Sequence[tuple[Style, OutputSeries]], truth: OutputSeries | None, tolerance: float | None
) -> Figure:
    """All engines' positions against the driver, over the reference and its band where that is wide enough to be seen."""
    unit, scale = _DISPLAY.get((truth or curves[0][1]).unit, ((truth or curves[0][1]).unit, 1.0))
    traces: list[Figure] = []

    def curve(values: Sequence[float | None], driver: Any = "driver", **options: Any) -> Figure:
        x, y = (values, driver) if axis.vertical else (driver, values)
        return {"type": "scatter", "x": x, "y": y, **options}

    if truth is not None:
        values = _taken(truth.position, axis.kept, scale)
        if tolerance is not None and not band_is_thin(truth, tolerance):
            known = [(v, d) for v, d in zip(values, axis.shown, strict=False) if v is not None]
            around = [v - scale * tolerance for v, _ in known] + [v + scale * tolerance for v, _ in reversed(known)]
            there = [d for _, d in known]
            look: Figure = {"mode": "lines", "fill": "toself", "line": {"width": 0}, "hoverinfo": "skip", "uid": "band"}
            traces.append(curve(around, there + there[::-1], **look, fillcolor="rgba(128,128,128,0.18)", meta="reference"))
        line = {"width": 6, "color": "rgba(128,128,128,0.45)"}
        traces.append(curve(values, mode="lines", line=line, name="reference", uid="reference", meta="reference"))
    for index, (style, series) in enumerate(curves):
        values = _taken(series.position, axis.kept, scale)
        line = {"width": 2, "color": style.colour, "dash": style.dash}
        traces.append(curve(values, mode="lines", line=line, name=plain(style.name), uid=style.key, meta=style.name))
        stride = max(len(curves), len(values) // MARKERS)
        some = range(index * stride // len(curves), len(values), stride)
        marker = {"size": 9, "symbol": style.symbol, "color": style.colour, "line": {"width": 1.8}}
        look = {"mode": "markers", "marker": marker, "hoverinfo": "skip", "uid": f"{style.key}-markers", "meta": style.name}
        traces.append(curve([values[k] for k in some], [axis.shown[k] for k in some], **look))
    value_axis: Figure = {"title": {"text": plain(f"{output_label(output)} [{unit}]")}, "hoverformat": ".9g", "zeroline": True}
    moved_axis: Figure = {"title": {"text": plain(axis.title)}, "hoverformat": ".6~g", "zeroline": True} | _ticks(axis)
    sides = {"xaxis": value_axis, "yaxis": moved_axis} if axis.vertical else {"xaxis": moved_axis, "yaxis": value_axis}
    return {"data": traces, "layout": {**sides, "hovermode": "y unified" if axis.vertical else "x unified"}}


def band_is_thin(truth: OutputSeries, tolerance: float) -> bool:
    """Whether the tolerance band would be hidden behind the line."""
    known = [v for v in truth.position if v is not None]
    return not known or 2 * tolerance < THIN * (max(known) - min(known))


def error_figure(motion: str, unit: str, axis: Axis, curves: Sequence[tuple[Style, Values, Deviation]], standard: Values) -> Figure:
    """Absolute error of each engine per sample on a log axis, with the tolerance and the worst sample.

    An error of zero has no place on the axis: the page draws it on a labelled floor, `layout.meta.floor`.

    Args:
        unit: of the errors.
        curves: the engines that were judged, and their deviations; at least one.
        standard: what they were judged against.
    """
    traces: list[Figure] = []
    for style, values, _ in curves:
        errors = _taken(absolute_errors(values, standard), axis.kept, 1.0)
        # Four digits are more than an error deserves, and keep the page small.
        rounded = [None if e is None else float(f"{e:.3e}") for e in errors]
        line = {"width": 1.2, "color": style.colour, "dash": style.dash}
        marker = {"size": 5, "symbol": style.symbol, "color": style.colour, "maxdisplayed": 3 * MARKERS}
        look = {"name": plain(style.name), "uid": style.key, "meta": style.name, "line": line, "marker": marker}
        traces.append({"type": "scatter", "mode": "lines+markers", "x": "driver", "y": rounded, **look})
    worst = max((deviation for *_, deviation in curves), key=lambda deviation: deviation.max_abs)
    if worst.worst_step < len(axis.values) and 0 < worst.max_abs < math.inf:
        place = {"x": [axis.scale * axis.values[worst.worst_step]], "y": [worst.max_abs], "hoverinfo": "skip"}
        ring = {"size": 15, "symbol": "circle-open", "color": "#7f7f7f", "line": {"width": 2}}
        traces.append({"type": "scatter", "mode": "markers", **place, "marker": ring, "uid": "worst", "meta": "worst"})
    tolerance = worst.tolerance
    positive = [e for trace in traces for e in trace["y"] if e]
    ends = positive + ([tolerance] if tolerance else [])
    low = math.floor(math.log10(min(positive, default=(tolerance or 1e-9) * 1e-6))) - 1
    high = math.ceil(math.log10(max(ends, default=1.0))) + 0.5
    stride = max(1, math.ceil((high - low) / 6))
    decades = range(low + 1, math.floor(high) + 1, stride)
    layout: Figure = {
        "xaxis": {"title": {"text": plain(axis.label)}, "hoverformat": ".6~g", "zeroline": False} | _ticks(axis),
        "yaxis": {
            "type": "log",
            "title": {"text": plain(f"{motion} error [{unit}]")},
            "range": [low - 0.4, high],
            "tickvals": [10.0**low, *(10.0**d for d in decades)],
            "ticktext": ["exactly 0", *(f"10<sup>\N{MINUS SIGN}{-d}</sup>" if d < 0 else f"10<sup>{d}</sup>" for d in decades)],
        },
        "hovermode": "x unified",
        "meta": {"floor": 10.0**low},
    }
    if tolerance:
        line = {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": tolerance, "y1": tolerance}
        below = {"type": "rect", "xref": "paper", "x0": 0, "x1": 1, "y0": 10.0 ** (low - 1), "y1": tolerance, "layer": "below"}
        layout["shapes"] = [
            {**below, "line": {"width": 0}, "fillcolor": "rgba(0,158,115,0.07)"},
            {**line, "line": {"width": 1.5, "dash": "dot", "color": "#7f7f7f"}},
        ]
    return {"data": traces, "layout": layout}


def absolute_errors(values: Values, standard: Values) -> list[float | None]:
    """Distance from what was compared with at each sample; None where either is not known."""
    return [None if a is None or b is None else abs(a - b) for a, b in zip(values, standard, strict=True)]


def _taken(values: Values, kept: Sequence[int], scale: float) -> list[float | None]:
    # JSON has no NaN and no infinity; both mean here that there is nothing to draw.
    taken = (values[k] if k < len(values) else None for k in kept)
    return [scale * v if v is not None and math.isfinite(v) else None for v in taken]


def _ticks(axis: Axis) -> Figure:
    if axis.unit == "°" and axis.values and max(axis.values) - min(axis.values) > math.pi:
        return {"dtick": 90}
    return {}
