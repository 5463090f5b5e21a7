"""The trends of a history as one HTML page for offline use."""

from __future__ import annotations

from pathlib import Path

from ..case.io.atomic_files import write
from ..history.queries import History
from .figure_data import Mark, marks, trend_figures
from .figures import Figure, Style
from .page_model import Plot
from .page_parts import environment, figure_parts
from .trends import trends


def write_plot(history: History, path: Path, *, title: str) -> None:
    """Write the page: errors and time of each engine on each case, over the runs.

    Raises:
        KincheckError: the file cannot be written.
    """
    write("--plot", path, page(history, title=title).encode())


def page(history: History, *, title: str) -> str:
    """Return the page as HTML text."""
    by_case = trends(history)
    names = dict.fromkeys(past.engine for each in by_case.values() for past in each)
    styles = {name: Style.number(index, name) for index, name in enumerate(names)}
    figures: dict[str, Figure] = {}
    cases: list[tuple[str, list[Style], list[Plot], list[Mark]]] = []
    for place, (case, each) in enumerate(sorted(by_case.items()), 1):
        plots: list[Plot] = []
        for what, figure in trend_figures(each, styles).items():
            plots.append(
                Plot(
                    f"{what}-{place}",
                    f"{what.replace('-', ' ')} of each engine on {case}, by run, log axis",
                    "",
                )
            )
            figures[plots[-1].figure] = figure
        drawn = [styles[name] for name in dict.fromkeys(past.engine for past in each)]
        cases.append((case, drawn, plots, marks(each)))
    return (
        environment()
        .get_template("history.html")
        .render(title=title, runs=len(history.runs), cases=cases, **figure_parts(figures))
    )
