"""The trends of a history as one HTML page for offline use."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any, cast

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from ..case.io.atomic_files import write
from ..harness.labels import known, number
from ..history.queries import History
from .figure_data import trend_figures
from .figures import Figure, Style
from .page_model import Plot
from .report import packed
from .trends import trends

_HERE = Path(__file__).parent


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
    figures: dict[str, Figure] = {}
    cases: list[tuple[str, list[Style], list[Plot]]] = []
    for place, (case, each) in enumerate(sorted(by_case.items()), 1):
        plots: list[Plot] = []
        for what, figure in trend_figures(each, styles).items():
            plots.append(
                Plot(f"{what}-{place}", f"{what} of each engine on {case}, by run, log axis", "")
            )
            figures[plots[-1].figure] = figure
        cases.append(
            (case, [styles[name] for name in dict.fromkeys(past.engine for past in each)], plots)
        )
    environment = Environment(
        loader=FileSystemLoader(_HERE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # which the macros use
    cast("dict[str, Any]", environment.filters).update(number=number, known=known)
    return environment.get_template("history.html").render(
        title=title,
        runs=len(history.runs),
        cases=cases,
        css=(_HERE / "report.css").read_text("utf-8"),
        script=(_HERE / "report.js").read_text("utf-8"),
        data=packed(json.dumps({"drivers": {}, "figures": figures, "scenes": {}}, allow_nan=False)),
        plotlyjs=packed(plotly.get_plotlyjs()),
    )
