"""Diagrams of the benchmark of engines, as Plotly JSON for the script of the run's report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from ...harness.standard import STANDARD
from ...report.figures import Figure, Style, precision_figure, ticked_axis
from ...report.page_model import Plot
from ...report.sections import Diagram
from .engines import Bench, effort
from .precision import Entry
from .size import Size


def precision_diagram(found: Bench, case: str, mode: str) -> Diagram:
    """Return error against time for the engines of one mode on a case, with the floor of each
    simulator.
    """
    entries = [entry for entry in found.entries if (entry.case, entry.mode) == (case, mode)]
    efforts = [each for entry in entries for each in effort(entry)]
    styles, floors = _styles(each.engine for each in efforts), ""
    for floor in found.floors:
        finest = [entry for entry in entries if entry.engine == floor.engine and effort(entry)]
        if (floor.case, floor.mode) == (case, mode) and finest:
            (best,) = effort(finest[-1])
            name = f"{best.engine}: floor"
            efforts.append(
                replace(
                    best,
                    engine=name,
                    setting=f"floor of {best.setting}",
                    us_per_sample=floor.us_per_sample,
                )
            )
            own = next(style for style in styles if style.name == best.engine)
            styles.append(replace(own, name=name, symbol="x-thin-open", dash="3px,3px"))
            floors = " A cross is a simulator's floor: a lower bound, not a solver."
    drawn = [each for each in efforts if each.us_per_sample > 0.0]
    caption = f"Left is faster, down is more accurate; a point is one effort.{floors}"
    plot = Plot(
        f"{case}-{mode}", f"{case}, {mode}: error against time per sample, both log axes", caption
    )
    return Diagram(plot, precision_figure(drawn, {style.name: style for style in styles}), styles)


def size_diagram(family: str, sizes: Sequence[Size]) -> Diagram:
    """Return time against the number of loops."""
    timed = [
        (each.engine, each.loops, each.us_per_sample.median)
        for each in sizes
        if each.us_per_sample is not None
    ]
    caption = f"A {family}; time of one driver value, position, velocity and acceleration."
    plot = Plot(
        family.replace(" ", "-"),
        f"{family}: time per sample against their number, both log axes",
        caption,
    )
    return _against(plot, family.rpartition(" ")[2], "time per sample [µs]", timed)


def batch_diagram(found: Bench) -> Diagram:
    """Return time against batch size."""
    timed = [(STANDARD, each.variants, each.us_per_sample.median) for each in found.batches]
    caption = "Variants of all hardpoints, solved together on one core; time by sample and variant."
    plot = Plot("batch", "time per sample against variants in a batch, both log axes", caption)
    return _against(plot, "variants in a batch", "time per sample and variant [µs]", timed)


def stage_diagram(found: Bench) -> Diagram:
    """Return the stages of the first use, with empty and with filled cache side by side."""
    processes = [each for each in found.processes if each.stages]
    styles = _styles(name for name in processes[0].stages)
    bars: list[Figure] = [
        {
            "type": "bar",
            "orientation": "h",
            "name": style.name,
            "uid": style.key,
            "meta": style.name,
            "x": [each.stages[style.name].median for each in processes],
            "y": [each.what.rpartition(", ")[2] for each in processes],
            "marker": {"color": style.colour},
            "hovertemplate": "%{x:.3f} s",
        }
        for style in styles
    ]
    layout: Figure = {
        "barmode": "stack",
        "xaxis": {"title": {"text": "time [s]"}},
        "yaxis": {"autorange": "reversed"},
    }
    plot = Plot(
        "stages", "stages of the native engine's first use", "Medians over fresh processes."
    )
    return Diagram(plot, {"data": bars, "layout": layout}, styles)


def entries_of(found: Bench) -> list[tuple[str, str, list[Entry]]]:
    """Return the comparable entries by case and mode."""
    keys = dict.fromkeys((entry.case, entry.mode) for entry in found.entries)
    return [
        (*key, [entry for entry in found.entries if (entry.case, entry.mode) == key])
        for key in keys
    ]


def _against(
    plot: Plot, x_title: str, y_title: str, points: Sequence[tuple[str, int, float]]
) -> Diagram:
    styles = _styles(name for name, *_ in points)
    curves: list[Figure] = []
    for style in styles:
        mine = [(x, y) for name, x, y in points if name == style.name]
        x, y = ([each[k] for each in mine] for k in range(2))
        curves.append(style.curve(x, y) | {"hovertemplate": "%{x}: %{y:.3~g} µs"})
    axes: Figure = {
        "xaxis": ticked_axis(x_title, [x for _, x, _ in points]),
        "yaxis": ticked_axis(y_title, [y for *_, y in points]),
    }
    return Diagram(plot, {"data": curves, "layout": {**axes, "hovermode": "closest"}}, styles)


def _styles(names: Iterable[str]) -> list[Style]:
    return [Style.number(index, name) for index, name in enumerate(dict.fromkeys(names))]
