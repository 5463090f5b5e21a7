"""Figures from several runs: errors and times over earlier runs, and error against time at several
efforts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from ..trajectory import QUANTITIES
from .error_figure import accepted, log_axis
from .figures import Figure, Style

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
                "shapes": lines,
            },
        }

    made: dict[str, Figure] = {}
    for motion in QUANTITIES:
        errors = {(each.engine, each.run): each.errors.get(motion) for each in history}
        each = figure({where: _finite(error) for where, error in errors.items()})
        if _has_values(each) or (motion == "position" and any(past.bad for past in history)):
            each = floored(each, f"largest {motion} error [tolerances]", 1.0)
            floor = each["layout"]["meta"]["floor"]
            each["layout"]["shapes"] = [*accepted(floor, 1.0), *lines]
            failures = (_failures(history, style, motion) for style in drawn)
            each["data"] += [trace for trace in failures if trace["x"]]
            made[f"{motion}-error"] = each
    times = figure({(each.engine, each.run): _finite(each.us_per_step) for each in history})
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
    return {
        "type": "scatter",
        "mode": "markers",
        "x": [*found],
        "y": [*found.values()],
        "hoverinfo": "skip",
        "uid": "failed",
        "meta": style.name,
        "marker": {"size": 15, "symbol": "x-open", "color": "var(--fail)", "line": {"width": 2.5}},
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
    side = ticked_axis(TIMES, times)
    layout = {"xaxis": side, "hovermode": "closest"}
    return floored({"data": traces, "layout": layout}, "largest position error [m]")


def floored(figure: Figure, title: str, *within: float) -> Figure:
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
