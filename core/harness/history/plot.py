"""The trends of a history as one HTML page that opens offline."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from ..reporting.figures import Figure, Style
from ..reporting.measures import trend_figures
from ..reporting.report import packed
from ..writing import write
from .series import History
from .trends import trends

_HERE = Path(__file__).parent
_LOOK = _HERE.parent / "reporting"


def write_plot(history: History, path: Path, *, title: str) -> None:
    """Write the page: error and time of each engine on each case, over the runs.

    Raises:
        KincheckError: the file cannot be written.
    """
    write("--plot", path, page(history, title=title).encode())


def page(history: History, *, title: str) -> str:
    """The page as HTML text."""
    plotly: Any = importlib.import_module("plotly.offline")  # no types; and not for a list
    by_case = trends(history)
    names = dict.fromkeys(past.engine for each in by_case.values() for past in each)
    styles = {name: Style.number(index, name) for index, name in enumerate(names)}
    figures: list[Figure] = []
    cases: list[tuple[str, list[tuple[int, str]]]] = []
    for case, each in sorted(by_case.items()):
        places: list[tuple[int, str]] = []
        for what, figure in trend_figures(each, styles).items():
            places.append((len(figures), f"{what} of each engine on {case}, by run, log axis"))
            figures.append(_grounded(figure))
        cases.append((case, places))
    environment = Environment(
        loader=FileSystemLoader([_HERE, _LOOK]), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    return environment.get_template("history.html").render(
        title=title,
        runs=len(history.runs),
        cases=cases,
        css=(_LOOK / "report.css").read_text("utf-8"),
        data=packed(json.dumps(figures, allow_nan=False)),
        plotlyjs=packed(plotly.get_plotlyjs()),
    )


def _grounded(figure: Figure) -> Figure:
    """The figure with errors of exactly zero on the floor that its axis has for them."""
    floor = figure["layout"].get("meta", {}).get("floor")
    if floor is None:
        return figure
    data = [trace | {"y": [floor if value == 0 else value for value in trace["y"]]} for trace in figure["data"]]
    return {"data": data, "layout": figure["layout"]}
