"""Figures from several runs: errors and times over earlier runs, and error against time at several
efforts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from .error_figure import log_axis
from .figures import Figure, Style

TIMES = "time per sample [µs]"


@dataclass(frozen=True)
class Past:
    """The result of one engine for a case in one run.

    Attributes:
        run: label of the run on the axis, such as its date; the oldest run comes first.
        engine: name in the report; an engine outside the report's run has another style.
        max_error: largest position error over all outputs [m]; None if nothing was compared.
        us_per_step: warm time of a sample [us]; None unless all samples were reached.
    """

    run: str
    engine: str
    max_error: float | None
    us_per_step: float | None


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


def trend_figures(history: Sequence[Past], styles: Mapping[str, Style]) -> dict[str, Figure]:
    """Return figures of error and time of each engine over the runs, on log axes; empty series are
    left out.

    An error of zero has no place on the axis: the page draws it on a labelled floor, as in the
    error figures.
    """
    runs = list(dict.fromkeys(each.run for each in history))
    drawn = _styles((each.engine for each in history), styles)

    def figure(values: Mapping[tuple[str, str], float | None]) -> Figure:
        # one category per run: on a time axis, the runs of one night would coincide
        curves = [
            style.curve(runs, [values.get((style.name, run)) for run in runs]) for style in drawn
        ]
        return {
            "data": curves,
            "layout": {
                "xaxis": {"type": "category", "zeroline": False, "nticks": 6, "tickangle": -30},
                "hovermode": "x unified",
            },
        }

    errors = figure({(each.engine, each.run): _finite(each.max_error) for each in history})
    times = figure({(each.engine, each.run): _finite(each.us_per_step) for each in history})
    drawn_times = [value for trace in times["data"] for value in trace["y"] if value]
    times["layout"]["yaxis"] = ticked_axis(TIMES, drawn_times) | _decade(drawn_times)
    made = {"error": floored(errors), "time": times}
    return {
        what: each
        for what, each in made.items()
        if any(y is not None for trace in each["data"] for y in trace["y"])
    }


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
    return floored(
        {"data": traces, "layout": {"xaxis": ticked_axis(TIMES, times), "hovermode": "closest"}}
    )


def floored(figure: Figure) -> Figure:
    """Return the figure with a vertical log axis for errors."""
    positive = [value for trace in figure["data"] for value in trace["y"] if value]
    side, floor = log_axis(
        "largest position error [m]", min(positive, default=1.0), max(positive, default=1.0)
    )
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
