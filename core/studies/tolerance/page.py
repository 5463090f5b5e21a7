"""The page of a study: one HTML file in the look of a run's report, with its style sheet and
script.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from ...harness.labels import notes, number, output_label, signs
from ...harness.record import Outcome, Record
from ...report.axis import Axis, driver_axis
from ...report.figures import Figure
from ...report.page_parts import environment, figure_parts
from ...unit_text import with_unit
from .conformance import Capability
from .histogram_figure import LIMIT, histogram_figure
from .limit_words import interval, limit_notes, percent
from .results import Envelope, Gradient, Numbers, SweepResults

_HERE = Path(__file__).parent

# Bars of a tornado diagram: what is left out is smaller than all of these.
MOST_BARS = 15
# Digits of a drawn number: one more than is told where a curve is pointed at.
DIGITS = 7


@dataclass(frozen=True)
class OutputView:
    """An output as the page has it, in display units: its figures by name, and its gradients, the
    largest effect first.
    """

    name: str
    unit: str
    scale: float
    envelope: Envelope
    figure: str
    spread: str
    tornado: str
    histogram: str
    gradients: Sequence[Gradient]
    limit: Capability | None

    def shown(self, value: float | None) -> str:
        """A value in display units."""
        return scaled_number(self.scale, value)

    @property
    def limits(self) -> dict[str, float]:
        """The limits in display units, by their names."""
        ends = (None, None) if self.limit is None else (self.limit.low, self.limit.high)
        return {
            name: float(f"{self.scale * value:.{DIGITS}g}")
            for name, value in zip(("low limit", "high limit"), ends, strict=True)
            if value is not None
        }

    def ends(self) -> tuple[str, str, str]:
        """The least, the most, and the largest standard deviation, over all samples."""
        least, most, spread = (
            [value for value in values if value is not None]
            for values in (self.envelope.min, self.envelope.max, self.envelope.standard_deviation)
        )
        return (
            self.shown(min(least, default=None)),
            self.shown(max(most, default=None)),
            self.shown(max(spread, default=None)),
        )


def page(results: SweepResults) -> str:
    """The page as HTML text."""
    axis = _axis(results)
    figures: dict[str, Figure] = {}
    outputs: list[OutputView] = []
    for index, (name, envelope) in enumerate(results.outputs.items()):
        mine = sorted(
            (each for each in results.gradients if each.output == name), key=effect, reverse=True
        )
        unit, scale = results.shown_unit(envelope.unit)
        limit = next((each for each in results.limits if each.output == name), None)
        view = OutputView(
            name,
            unit,
            scale,
            envelope,
            f"envelope-{index}",
            f"spread-{index}",
            f"tornado-{index}",
            f"histogram-{index}" if envelope.histogram else "",
            mine,
            limit,
        )
        figures[view.figure] = envelope_figure(view, axis, about_nominal=False)
        figures[view.spread] = envelope_figure(view, axis, about_nominal=True)
        figures[view.tornado] = tornado_figure(view)
        if envelope.histogram:
            figures[view.histogram] = histogram_figure(
                view.name, unit, scale, envelope.histogram, view.limits
            )
        outputs.append(view)

    def shown(unit: str, value: float | None) -> str:
        return scaled_number(results.shown_unit(unit)[1], value)

    def shown_unit(unit: str) -> str:
        return results.shown_unit(unit)[0]

    return (
        environment(_HERE)
        .get_template("sweep.html")
        .render(
            results=results,
            headline=headline(results),
            signs=signs(results.run),
            notes=notes(results.run),
            outputs=outputs,
            axis=axis,
            circumstances={
                key: value for key, value in results.run.items() if key not in ("cases", "engines")
            },
            effect=effect,
            slopes=partial(slopes, results),
            shown=shown,
            shown_unit=shown_unit,
            limit_notes=limit_notes(results),
            percent=percent,
            interval=interval,
            **figure_parts(figures, drivers={"sweep": axis.shown}),
        )
    )


def headline(results: SweepResults) -> str:
    """The study in one sentence."""
    said = f"{results.partial or results.samples} variants of {results.case}"
    said += ", partial: the sweep was stopped" if results.partial else ""
    said += (
        f", {results.unsolved} without a solution somewhere" if results.unsolved else ", all solved"
    )
    if results.checked:
        off = len(results.deviating)
        said += f"; {len(results.checked)} checked with {results.check_engine}, " + (
            f"{off} deviate" if off else "none deviates"
        )
        said += f", {results.unjudged} not judged" if results.unjudged else ""
        said += f"; {results.partly_judged}" if results.partly_judged else ""
    return said


def slopes(results: SweepResults, view: OutputView, each: Gradient) -> dict[str, str]:
    """Return the numbers of a gradient and their unit, in units of the file."""
    its, factor = results.shown_unit(results.unit_of(each.coordinate))
    names = ("at_design", "largest", "error")
    found = {name: scaled_number(view.scale / factor, getattr(each, name)) for name in names}
    return {**found, "unit": f"({view.unit})/({its})"}


def scaled_number(scale: float, value: float | None) -> str:
    """Return a number times a factor, to three digits; a dash if there is none."""
    return number(None if value is None else scale * value)


def effect(gradient: Gradient) -> float:
    """The size of a bar: the largest gradient times what its coordinate varies by [unit of the
    output].
    """
    return abs(gradient.largest or 0.0) * gradient.scale


def _axis(results: SweepResults) -> Axis:
    record = Record(
        case=results.case,
        truth="",
        engine="",
        mode="",
        loop="",
        version=None,
        outcome=Outcome.PASS,
        message="",
        driver=results.driver,
    )
    axis = driver_axis(results.run["cases"].get(results.case, {}), [record], ())
    unit, scale = results.shown_driver
    if not unit:
        return axis
    title = axis.title.replace(f"[{axis.unit}]", f"[{unit}]")
    return replace(axis, unit=unit, scale=scale, title=title)


def envelope_figure(view: OutputView, axis: Axis, *, about_nominal: bool) -> Figure:
    """Bands between quantiles, the least and the most, and the nominal design, against the driver;
    or how far they are from it.
    """
    envelope = view.envelope
    traces: list[Figure] = []

    def curve(values: list[float | None], driver: Any = "driver", **options: Any) -> None:
        x, y = (values, driver) if axis.up else (driver, values)
        traces.append({"type": "scatter", "mode": "lines", "x": x, "y": y, **options})

    def taken(values: Numbers) -> list[float | None]:
        some = ((values[k], envelope.nominal[k] if about_nominal else 0.0) for k in axis.kept)
        return [
            None if v is None or at is None else float(f"{view.scale * (v - at):.{DIGITS}g}")
            for v, at in some
        ]

    for low, high, opacity in (("0.01", "0.99", 0.14), ("0.05", "0.95", 0.28)):
        below, above = taken(envelope.quantiles[low]), taken(envelope.quantiles[high])
        there = [
            (a, b, d)
            for a, b, d in zip(below, above, axis.shown, strict=True)
            if a is not None and b is not None
        ]
        around: list[float | None] = [
            *(a for a, _, _ in there),
            *(b for _, b, _ in reversed(there)),
        ]
        ways = [d for _, _, d in there]
        look: Figure = {
            "fill": "toself",
            "line": {"width": 0},
            "hoverinfo": "skip",
            "uid": f"band-{low}",
        }
        curve(around, ways + ways[::-1], **look, fillcolor=f"rgba(0,114,178,{opacity})")
    for name, values in (("least", envelope.min), ("most", envelope.max)):
        curve(
            taken(values),
            name=name,
            line={"width": 1, "color": "#0072B2", "dash": "3px,3px"},
            uid=f"s0-{name}",
        )
    curve(
        taken(envelope.quantiles["0.5"]),
        name="median",
        line={"width": 2, "color": "#0072B2"},
        uid="s0",
    )
    curve(
        taken(envelope.nominal),
        name="nominal",
        line={"width": 1.5, "color": "#D55E00", "dash": "12px,5px"},
        uid="s1",
    )
    if not about_nominal:
        for name, limit in view.limits.items():
            curve([limit, limit], [axis.shown[0], axis.shown[-1]], name=name, line=LIMIT, uid=name)
    what = with_unit(
        output_label(view.name) + (" less nominal" if about_nominal else ""), view.unit
    )
    value_axis: Figure = {"title": {"text": what}, "hoverformat": ".5g"}
    moved_axis: Figure = {"title": {"text": axis.title}, "hoverformat": ".6~g"}
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


def tornado_figure(view: OutputView) -> Figure:
    """Bars by coordinate, the largest on top: what its standard deviation, half width or largest
    offset does to the output.
    """
    bars = view.gradients[:MOST_BARS][::-1]
    lengths = [float(f"{view.scale * effect(each):.{DIGITS}g}") for each in bars]
    names = [each.coordinate for each in bars]
    look: Figure = {
        "type": "bar",
        "orientation": "h",
        "y": names,
        "marker": {"color": "#0072B2"},
        "hovertemplate": "%{x:.3~g}",
    }
    traces = [
        {**look, "x": [sign * length for length in lengths], "uid": f"bars{sign}"}
        for sign in (-1, 1)
    ]
    title = with_unit(f"change of {output_label(view.name)}", view.unit)
    layout: Figure = {
        "barmode": "overlay",
        "xaxis": {"title": {"text": title}, "zeroline": True},
        "yaxis": {"type": "category"},
    }
    return {"data": traces, "layout": layout}
