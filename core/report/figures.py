"""Figures of the report in a part of Plotly's JSON: outputs against the driver, and differences.

`plot.js` draws it: traces of type scatter (lines, markers, closed bands) and bar, axes of type
linear, log and category, shapes of type line and rect. The style sheet has the engines' colours, so
that dark mode and print need no second set of figures. The word "driver" in a trace stands for the
driver's values, which the page inserts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from ..harness.labels import output_label
from ..harness.record import Deviation, OutputSeries
from ..trajectory import QUANTITIES
from ..unit_text import motion_word, with_unit
from .axis import DISPLAY, Axis

Figure: TypeAlias = dict[str, Any]
Values: TypeAlias = Sequence[float | None]

MARKERS = 9  # markers per curve, staggered, so that coincident curves stay distinguishable
# digits: one more than the page shows at the pointer
DIGITS = 10
REFERENCE = "reference"
THIN = 1 / 2000  # a band narrower than this fraction of the curve's range is less than a pixel

# Okabe and Ito (https://jfly.uni-koeln.de/color): told apart by colour-blind readers
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
    """Style of an engine, the same in every figure of a page.

    Attributes:
        measured: whether its values are a recording's, which are points without a line.
    """

    key: str
    name: str
    colour: str
    dash: str
    symbol: str
    measured: bool = False

    @classmethod
    def number(cls, index: int, name: str, *, measured: bool = False) -> Style:
        """Return the style of the index-th engine."""
        k, dash, symbol = (index % len(each) for each in (COLOURS, DASHES, SYMBOLS))
        return cls(f"s{k}", name, COLOURS[k], DASHES[dash], SYMBOLS[symbol], measured)

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


@dataclass(frozen=True)
class OverDriver:
    """Curves over a driver, whose axis is vertical if `axis.up` is not 0."""

    axis: Axis
    traces: list[Figure] = field(default_factory=list[Figure])

    def add(self, values: Values, driver: Any = "driver", **look: Any) -> None:
        """Add a curve, by default a line at the kept samples."""
        x, y = (values, driver) if self.axis.up else (driver, values)
        self.traces.append({"type": "scatter", "mode": "lines", "x": x, "y": y, **look})

    def add_band(self, low: Values, high: Values, **look: Any) -> None:
        """Add the area between two curves, where both are known."""
        ends = [
            (a, b, d)
            for a, b, d in zip(low, high, self.axis.shown, strict=False)
            if a is not None and b is not None
        ]
        ways = [d for *_, d in ends]
        around = [a for a, _, _ in ends] + [b for _, b, _ in reversed(ends)]
        look |= {"fill": "toself", "line": {"width": 0}, "hoverinfo": "skip"}
        self.add(around, ways + ways[::-1], **look)

    def figure(self, title: str, **value_axis: Any) -> Figure:
        """Return the figure with the title of its values."""
        moved_axis: Figure = {"title": {"text": self.axis.title}, "hoverformat": ".6~g"}
        moved_axis |= {"zeroline": True} | ticks(self.axis)
        if self.axis.up < 0:
            moved_axis["autorange"] = "reversed"
        moved, value = ("y", "x") if self.axis.up else ("x", "y")
        layout = {
            f"{moved}axis": moved_axis,
            f"{value}axis": {"title": {"text": title}, **value_axis},
            "hovermode": f"{moved} unified",
        }
        return {"data": self.traces, "layout": layout}


def output_figure(
    output: str,
    axis: Axis,
    curves: Sequence[tuple[Style, OutputSeries]],
    truth: OutputSeries | None,
    band: tuple[OutputSeries, float] | None,
    *,
    measured: bool = False,
) -> Figure:
    """Return all engines' positions against the driver, over the reference.

    Args:
        curves: the engines and their outputs; at least one.
        truth: values of the reference.
        band: the values compared with, and the tolerance; drawn if it is wide enough to be seen.
        measured: whether the reference consists of points, without a line between them.
    """
    unit, scale = DISPLAY.get(curves[0][1].unit, (curves[0][1].unit, 1.0))
    drawn = OverDriver(axis)
    if band is not None and not band_is_thin(*band):
        standard, tolerance = drawn_values(band[0].position, axis.kept, scale), scale * band[1]
        low, high = (
            [None if v is None else v + off for v in standard] for off in (-tolerance, tolerance)
        )
        drawn.add_band(low, high, uid="band", fillcolor="rgba(128,128,128,0.18)", meta=REFERENCE)
    known = [] if truth is None else drawn_values(truth.position, axis.kept, scale)
    of_truth: Figure = {"name": REFERENCE, "uid": REFERENCE, "meta": REFERENCE}
    if known and not measured:
        line: Figure = {"width": 6, "color": "rgba(128,128,128,0.45)"}
        drawn.add(known, line=line, **of_truth)
    for index, (style, series) in enumerate(curves):
        values = drawn_values(series.position, axis.kept, scale)
        named = {"name": style.name, "uid": style.key, "meta": style.name}
        if style.measured:
            drawn.add(values, mode="markers", marker=_marker(style.symbol, style.colour), **named)
            continue
        line = {"width": 2, "color": style.colour, "dash": style.dash}
        drawn.add(values, line=line, **named)
        stride = max(len(curves), len(values) // MARKERS)
        some = slice(index * stride // len(curves), None, stride)
        look = _marks(f"{style.key}-markers", style.name, style.symbol, style.colour)
        drawn.add(values[some], axis.shown[: len(values)][some], **look)
    if known and measured:
        drawn.add(known, mode="markers", marker=MEASURED, **of_truth)
    value_axis: Figure = {"hoverformat": ".9g", "zeroline": True}
    if band is not None:
        value_axis |= _flat_range([series.position for _, series in curves], *band, scale)
    return drawn.figure(with_unit(output_label(output), unit), **value_axis)


def _marks(uid: str, meta: str, *look: Any) -> Figure:
    """Return the look of marks without a line, which have no values at the pointer."""
    marker = _marker(*look)
    return {"mode": "markers", "marker": marker, "hoverinfo": "skip", "uid": uid, "meta": meta}


def _marker(symbol: str, colour: str, size: int = 9, width: float = 1.8) -> Figure:
    return {"size": size, "symbol": symbol, "color": colour, "line": {"width": width}}


MEASURED = _marker("circle-open", "#7f7f7f", 4, 4)
"""Marker of a measured point: a disc, above the curves."""


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


def drawn_values(
    values: Values, kept: Sequence[int], scale: float, digits: int = DIGITS
) -> list[float | None]:
    """Return the kept values for drawing, scaled and rounded."""
    # JSON has neither NaN nor infinity; null stands for a value that cannot be drawn.
    chosen = (values[k] if k < len(values) else None for k in kept)
    return [
        float(f"{scale * v:.{digits}g}") if v is not None and math.isfinite(v) else None
        for v in chosen
    ]


def ticks(axis: Axis) -> Figure:
    """Return the ticks of an axis of angles: quarter turns, if the axis has any."""
    if axis.unit == "°" and axis.values and max(axis.values) - min(axis.values) > math.pi:
        return {"dtick": 90}
    return {}


RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def error_figure(
    motion: str,
    unit: str,
    factor: float,
    axis: Axis,
    curves: Sequence[tuple[Style, Values, Deviation]],
    standard: Values,
) -> Figure:
    """Return the absolute error of each engine per sample on a log axis, with the tolerance and the
    worst sample.

    An error of zero has no place on the axis: the page draws it on a labelled floor,
    `layout.meta.floor`.

    Args:
        unit, factor: unit of the errors on the page, and the factor to it from SI.
        curves: at least one judged engine, each with its deviations.
        standard: the values of the standard.
    """
    traces: list[Figure] = []
    for style, values, _ in curves:
        off = [
            None if a is None or b is None else abs(a - b)
            for a, b in zip(values, standard, strict=True)
        ]
        errors = drawn_values(off, axis.kept, factor)
        # three digits suffice for an error, and keep the page small
        rounded = [None if e is None else float(f"{e:.2e}") for e in errors]
        curve = style.curve("driver", rounded, width=1.2, size=5)
        curve["marker"]["maxdisplayed"] = 3 * MARKERS
        traces.append(curve)
    worst = max((deviation for *_, deviation in curves), key=lambda deviation: deviation.max_abs)
    if worst.worst_step < len(axis.values) and 0 < worst.max_abs < math.inf:
        place = {"x": [axis.scale * axis.values[worst.worst_step]], "y": [factor * worst.max_abs]}
        ring = _marks("worst", "worst", "circle-open", "#7f7f7f", 15, 2)
        traces.append({"type": "scatter", **place, **ring})
    tolerance = factor * worst.tolerance
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
        layout["shapes"] = accepted_field(floor, tolerance)
    return {"data": traces, "layout": layout}


def accepted_field(floor: float, tolerance: float) -> list[Figure]:
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


TIMES = "time per sample [µs]"


@dataclass(frozen=True)
class Past:
    """The result of one engine for a case in one run.

    Attributes:
        run: label of the run on the axis, such as its date; the oldest run comes first.
        engine: name in the report; an engine outside the report's run has another style.
        errors: the largest error over all outputs, in tolerances, by motion; those compared.
        us_per_step: warm time of a sample [us]; None unless all samples were reached.
        bad: whether the result failed or could not be completed.
        version: of the engine.
        steps: changes of level that begin in this run, as text.
    """

    run: str
    engine: str
    errors: Mapping[str, float]
    us_per_step: float | None
    bad: bool = False
    version: str | None = None
    steps: Sequence[str] = ()


@dataclass(frozen=True)
class Effort:
    """The result of one engine at one effort setting.

    Attributes:
        engine: name in the report.
        mode: mode of the engine; each mode has a separate diagram.
        setting: the setting as text, such as "tol 1e-6".
        error: largest position error over all outputs [m].
        us_per_sample: warm time of a sample [us].
    """

    engine: str
    setting: str
    error: float
    us_per_sample: float
    mode: str = "projection"


@dataclass(frozen=True)
class Mark:
    """A change of an engine in a run: a step, or another version."""

    run: str
    text: str
    is_step: bool


def marks(history: Sequence[Past]) -> list[Mark]:
    """Return the changes over the runs, in their order."""
    found, versions = list[Mark](), dict[str, str]()
    for past in history:
        before = versions.get(past.engine)
        if past.version and before and past.version != before:
            found.append(
                Mark(
                    past.run,
                    f"{past.engine}: version {before} → {past.version} since {past.run}",
                    False,
                )
            )
        versions |= {past.engine: past.version} if past.version else {}
        found += [Mark(past.run, f"{past.engine}: {step}", True) for step in past.steps]
    return found


def trend_figures(history: Sequence[Past], styles: Mapping[str, Style]) -> dict[str, Figure]:
    """Return figures over the runs, on log axes: each motion's error in tolerances, and time; empty
    series are left out.

    Failures are red; those without an error are at the tolerance. Dashed lines are steps, dotted
    ones other versions. An error of zero has no place on the axis: the page draws it on a labelled
    floor, as in the error figures.
    """
    runs = list(dict.fromkeys(each.run for each in history))
    drawn = _styles((each.engine for each in history), styles)
    lines = [_line(each) for each in marks(history)]

    def figure(values: Sequence[float | None]) -> Figure:
        known = {
            (each.engine, each.run): _finite(value)
            for each, value in zip(history, values, strict=True)
        }
        # one category per run: on a time axis, the runs of one night would coincide
        curves = [
            style.curve(runs, [known.get((style.name, run)) for run in runs]) for style in drawn
        ]
        return {
            "data": curves,
            "layout": {
                "xaxis": {"type": "category", "zeroline": False, "nticks": 6, "tickangle": -30},
                "hovermode": "x unified",
                "shapes": lines,
            },
        }

    made: dict[str, Figure] = {}
    for motion in QUANTITIES:
        each = figure([past.errors.get(motion) for past in history])
        if _has_values(each) or (motion == "position" and any(past.bad for past in history)):
            each = with_error_axis(each, f"largest {motion} error [tolerances]", 1.0)
            floor = each["layout"]["meta"]["floor"]
            each["layout"]["shapes"] = [*accepted_field(floor, 1.0), *lines]
            failures = (_failures(history, style, motion) for style in drawn)
            each["data"] += [trace for trace in failures if trace["x"]]
            made[f"{motion}-error"] = each
    times = figure([past.us_per_step for past in history])
    drawn_times = [value for trace in times["data"] for value in trace["y"] if value]
    times["layout"]["yaxis"] = ticked_axis(TIMES, drawn_times) | _decade(drawn_times)
    return made | ({"time": times} if _has_values(times) else {})


def _has_values(figure: Figure) -> bool:
    return any(y is not None for trace in figure["data"] for y in trace["y"])


def _line(mark: Mark) -> Figure:
    """Return the line of a change, from bottom to top."""
    look = (
        {"width": 1.5, "dash": "dash", "color": "var(--warn)"}
        if mark.is_step
        else {"width": 1.5, "dash": "dot", "color": "var(--soft)"}
    )
    ends = {"x0": mark.run, "x1": mark.run, "yref": "paper", "y0": 0, "y1": 1}
    return {"type": "line", **ends, "line": look}


def _failures(history: Sequence[Past], style: Style, motion: str) -> Figure:
    """Return the marks of an engine's failures in a motion; among positions, also of those without
    an error.
    """
    over = {
        past.run: error if math.isfinite(error) else 1.0
        for past in history
        if past.engine == style.name
        for error in [past.errors.get(motion, 0.0)]
        if error > 1.0
    }
    untold = {
        past.run: 1.0
        for past in history
        if past.engine == style.name
        and past.bad
        and motion == "position"
        and max(past.errors.values(), default=0.0) <= 1.0
    }
    found = over | untold
    look = _marks("failed", style.name, 15, "x-open", "var(--fail)", 2.5)
    return {"type": "scatter", "x": [*found], "y": [*found.values()], **look}


def ticked_axis(title: str, values: Sequence[float]) -> Figure:
    """Return a log axis for values above zero, with ticks at 1, 2 and 5 of every decade, or over
    many decades only at 1.
    """
    span = max(values, default=1.0) / min(values, default=1.0)
    return {
        "type": "log",
        "title": {"text": title},
        "tickformat": "~g",
        "hoverformat": ".3~g",
        "dtick": "D2" if span < 1e3 else 1,
    }


def _decade(values: Sequence[float]) -> Figure:
    """Return the range of a log axis for values within a decade: ten percent over the whole page
    would look like a step.
    """
    low, high = (math.log10(end(values, default=1.0)) for end in (min, max))
    middle = 0.5 * (low + high)
    return {"range": [middle - 0.5, middle + 0.5]} if high - low < 0.9 else {}


def precision_figure(efforts: Sequence[Effort], styles: Mapping[str, Style]) -> Figure:
    """Return the work-precision diagram: error against time of each engine, with a point for each
    setting, joined in the order of time.
    """
    traces: list[Figure] = []
    for style in _styles((each.engine for each in efforts), styles):
        mine = sorted(
            (each for each in efforts if each.engine == style.name),
            key=lambda each: each.us_per_sample,
        )
        curve = style.curve(
            [_finite(each.us_per_sample) for each in mine],
            [_finite(each.error) for each in mine],
        )
        hover = {
            "text": [each.setting for each in mine],
            "hovertemplate": "%{text}: %{x:.3~g} µs, %{customdata:.3~g} m",
        }
        traces.append(curve | hover)
    times = [value for trace in traces for value in trace["x"] if value]
    side = ticked_axis(TIMES, times)
    layout = {"xaxis": side, "hovermode": "closest"}
    return with_error_axis({"data": traces, "layout": layout}, "largest position error [m]")


def with_error_axis(figure: Figure, title: str, *within: float) -> Figure:
    """Return the figure with a vertical axis for errors, which holds these values too."""
    positive = [value for trace in figure["data"] for value in trace["y"] if value]
    positive += within
    side, floor = log_axis(title, min(positive, default=1.0), max(positive, default=1.0))
    return {
        "data": figure["data"],
        "layout": {**figure["layout"], "yaxis": side, "meta": {"floor": floor}},
    }


def _styles(engines: Iterable[str], styles: Mapping[str, Style]) -> list[Style]:
    """Return a style for each engine: the page's style, or a further one for an engine missing from
    the page's run.
    """
    drawn: list[Style] = []
    for name in dict.fromkeys(engines):
        further = sum(style.name not in styles for style in drawn)
        drawn.append(styles[name] if name in styles else Style.number(len(styles) + further, name))
    return drawn


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
