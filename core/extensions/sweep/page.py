"""The page of a study: one HTML file with the style sheet and script of a run's report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path

from ...harness.labels import notes, output_label, signs
from ...harness.record import Outcome, Record
from ...report.axis import Axis, driver_axis
from ...report.figures import Figure, OverDriver, drawn_values
from ...report.sections import environment, figure_parts
from ...unit_text import with_unit
from .conformance import Capability, Histogram
from .results import Envelope, Gradient, Numbers, SweepResults
from .tables import (
    effect,
    headline,
    interval,
    limit_notes,
    other_yield,
    percent,
    scaled_number,
    without_gradients,
)

DIGITS = 7
"""Digits of a drawn number: one more than the page shows when the reader points at a curve."""


BLUE = "#0072B2"
LIMIT: Figure = {"width": 1.5, "color": "#CC79A7", "dash": "8px,3px,2px,3px"}
"""Look of a specification limit."""
# Bars of a tornado diagram: the largest effects.
MOST_BARS = 15


@dataclass(frozen=True)
class OutputView:
    """An output as the page shows it, in display units: its number, and its gradients, the largest
    effect first.
    """

    index: int
    name: str
    unit: str
    scale: float
    envelope: Envelope
    gradients: Sequence[Gradient]
    limit: Capability | None

    def shown(self, value: float | None) -> str:
        """Return a value in display units."""
        return scaled_number(self.scale, value)

    @property
    def limits(self) -> dict[str, float]:
        """The limits in display units, by name."""
        ends = (None, None) if self.limit is None else (self.limit.low, self.limit.high)
        return {
            name: float(f"{self.scale * value:.{DIGITS}g}")
            for name, value in zip(("low limit", "high limit"), ends, strict=True)
            if value is not None
        }

    def figures(self, axis: Axis) -> Iterator[tuple[str, Figure]]:
        """Yield the figures by name."""
        yield f"envelope-{self.index}", envelope_figure(self, axis, about_nominal=False)
        yield f"spread-{self.index}", envelope_figure(self, axis, about_nominal=True)
        yield f"tornado-{self.index}", tornado_figure(self)
        if self.envelope.histogram:
            yield f"histogram-{self.index}", histogram_figure(self, self.envelope.histogram)


def page(results: SweepResults) -> str:
    """Return the page as HTML text."""
    axis = _axis(results)
    outputs = [_view(results, index, name) for index, name in enumerate(results.outputs)]

    def shown(unit: str, value: float | None) -> str:
        return scaled_number(results.shown_unit(unit)[1], value)

    figures = {name: figure for view in outputs for name, figure in view.figures(axis)}
    return (
        environment(Path(__file__).parent)
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
            shown_unit=results.shown_unit,
            limit_notes=limit_notes(results),
            without_gradients=without_gradients(results),
            other_yield=other_yield(results),
            percent=percent,
            interval=interval,
            **figure_parts(figures, drivers={"sweep": axis.shown}),
        )
    )


def slopes(results: SweepResults, view: OutputView, each: Gradient) -> dict[str, str]:
    """Return the numbers of a gradient, and their unit, in units of the file."""
    its, factor = results.shown_unit(results.unit_of(each.coordinate))
    names = ("at_design", "largest")
    found = {name: scaled_number(view.scale / factor, getattr(each, name)) for name in names}
    return {**found, "unit": f"({view.unit})/({its})"}


def _view(results: SweepResults, index: int, name: str) -> OutputView:
    envelope = results.outputs[name]
    gradients = [each for each in results.gradients if each.output == name]
    limit = next((each for each in results.limits if each.output == name), None)
    gradients.sort(key=effect, reverse=True)
    unit, scale = results.shown_unit(envelope.unit)
    return OutputView(index, name, unit, scale, envelope, gradients, limit)


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
    """Return the quantile bands, minimum, maximum and nominal design against the driver.

    Args:
        about_nominal: show the differences from the nominal design.
    """
    envelope, drawn = view.envelope, OverDriver(axis)

    def shown(values: Numbers) -> list[float | None]:
        if about_nominal:
            pairs = zip(values, envelope.nominal, strict=True)
            values = [None if None in (v, at) else v - at for v, at in pairs]  # pyright: ignore
        return drawn_values(values, axis.kept, view.scale, DIGITS)

    def add(name: str, values: Numbers, uid: str, width: float, colour: str, **dash: str) -> None:
        line = {"width": width, "color": colour, **dash}
        drawn.add(shown(values), name=name, line=line, uid=uid)

    for low, high, opacity in (("0.01", "0.99", 0.14), ("0.05", "0.95", 0.28)):
        ends = (shown(envelope.quantiles[each]) for each in (low, high))
        drawn.add_band(*ends, uid=f"band-{low}", fillcolor=f"rgba(0,114,178,{opacity})")
    add("least", envelope.min, "s0-least", 1, BLUE, dash="3px,3px")
    add("most", envelope.max, "s0-most", 1, BLUE, dash="3px,3px")
    add("median", envelope.quantiles["0.5"], "s0", 2, BLUE)
    add("nominal", envelope.nominal, "s1", 1.5, "#D55E00", dash="12px,5px")
    if not about_nominal:
        ends = [axis.shown[0], axis.shown[-1]]
        for name, limit in view.limits.items():
            drawn.add([limit, limit], ends, name=name, line=LIMIT, uid=name)
    name = output_label(view.name) + (" less nominal" if about_nominal else "")
    return drawn.figure(with_unit(name, view.unit), hoverformat=".5g")


def tornado_figure(view: OutputView) -> Figure:
    """Return a bar for each coordinate, the largest on top.

    A bar is the output's change by the coordinate's standard deviation, or by its largest offset
    if one coordinate at a time varies.
    """
    bars = view.gradients[:MOST_BARS][::-1]
    lengths = [float(f"{view.scale * effect(each):.{DIGITS}g}") for each in bars]
    names = [each.coordinate for each in bars]
    look: Figure = {
        "type": "bar",
        "orientation": "h",
        "y": names,
        "marker": {"color": BLUE},
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


def histogram_figure(view: OutputView, found: Histogram) -> Figure:
    """Return bars of the counts of variants by output value at one sample, with the limits."""
    pairs = [*pairwise(view.scale * edge for edge in found.edges)]
    bars: Figure = {
        "type": "bar",
        "x": [float(f"{0.5 * (low + high):.7g}") for low, high in pairs],
        "y": found.counts,
        "width": [float(f"{high - low:.7g}") for low, high in pairs],
        "name": "variants",
        "marker": {"color": BLUE},
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
        for which, limit in view.limits.items()
    ]
    title = with_unit(output_label(view.name), view.unit)
    sides: Figure = {
        "xaxis": {"title": {"text": title}, "hoverformat": ".5g"},
        "yaxis": {"title": {"text": "variants"}, "rangemode": "tozero"},
    }
    return {"data": [bars, *lines], "layout": {**sides, "hovermode": "closest"}}
