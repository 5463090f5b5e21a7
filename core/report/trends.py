"""Trends of a history for the report: errors and times of each engine and case over the runs."""

from __future__ import annotations

from ..harness.labels import displayed, motion_unit, product
from ..history.queries import Entry, History, unit_of
from ..history.steps import steps
from ..history.store import RunRow
from .figures import Past, Style, marks, trend_figures
from .page_model import Plot
from .regressions import step_says
from .sections import Diagram, Report, Section
from .sections import page as page_of

HOW = (
    "Errors are in tolerances: above the dotted line is a failure, with a red cross; exactly zero"
    " is drawn on the lowest line",
    "Upright lines: dashed, a step; dotted, another version",
    "Point at a figure to read its values",
)
"""How the diagrams of a history are read."""


def trends(history: History) -> dict[str, list[Past]]:
    """Return the results of each engine by case, in the order of the runs."""
    found: dict[str, list[Past]] = {}
    place = {run: k for k, run in enumerate(history.runs)}
    begun: dict[tuple[str, str, str, int], list[str]] = {}
    for step in steps(history):
        begun.setdefault((*step.pair, step.first), []).append(step_says(step))
    for (case, engine, mode), entries in history.pairs.items():
        name = product(engine, mode)
        for entry in entries:
            errors = dict[str, float]()
            for deviations in entry.errors.values():
                for motion, deviation in deviations.items():
                    errors[motion] = max(errors.get(motion, 0.0), deviation.ratio)
            found.setdefault(case, []).append(
                Past(
                    run_name(history.runs[entry.run]),
                    name,
                    errors,
                    entry.us_per_step,
                    entry.outcome.bad,
                    entry.version,
                    begun.get((case, engine, mode, entry.run), ()),
                )
            )
    names = {run_name(row): place[row.id] for row in history.runs.values()}
    return {case: sorted(each, key=lambda past: names[past.run]) for case, each in found.items()}


def run_name(row: RunRow) -> str:
    """Return the label of a run on an axis: its date and its number, since a minute may have
    several runs.
    """
    return f"{row.started[:16].replace('T', ' ')} #{row.id}"


def largest_errors(entry: Entry, row: RunRow, newest: RunRow) -> dict[str, float]:
    """Return the largest errors of the outputs by unit, that of the case's file in the newest run:
    of values, velocities and accelerations.
    """
    found: dict[str, float] = {}
    facts = newest.circumstances.get("cases", {}).get(entry.case, {})
    for name, deviations in entry.errors.items():
        for quantity, deviation in deviations.items():
            si = motion_unit(unit_of(row, entry.case, name), quantity)
            unit, factor = displayed(si, facts) if si else ("1", 1.0)
            found[unit] = max(found.get(unit, 0.0), factor * deviation.max_abs)
    return found


def page(history: History, title: str) -> str:
    """Return the page as HTML text: errors and time of each engine on each case, over the runs."""
    by_case = trends(history)
    names = dict.fromkeys(past.engine for each in by_case.values() for past in each)
    styles = {name: Style.number(index, name) for index, name in enumerate(names)}
    found: list[Section] = []
    for place, (case, each) in enumerate(sorted(by_case.items()), 1):
        drawn = [styles[name] for name in dict.fromkeys(past.engine for past in each)]
        diagrams = [
            Diagram(
                Plot(
                    f"{what}-{place}",
                    f"{what.replace('-', ' ')} of each engine on {case}, by run, log axis",
                    "",
                ),
                figure,
                drawn,
            )
            for what, figure in trend_figures(each, styles).items()
        ]
        said = [mark.text for mark in marks(each)]
        nothing = [] if diagrams else ["No engine has solved it in these runs."]
        found.append(Section(case, said, nothing, (), 0, (), diagrams))
    runs = len(history.runs)
    facts = [f"{runs} run{'s' * (runs != 1)}, oldest first", *HOW]
    return page_of(Report("history", title, facts, found, linked=True))
