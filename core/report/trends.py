"""Trends of a history for the report: errors and times of each engine and case over the runs."""

from __future__ import annotations

from ..harness.labels import motion_unit, product
from ..history.queries import Entry, History, unit_of
from ..history.steps import steps
from ..history.store import RunRow
from .figure_data import Past
from .regression_labels import step_says


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
            found.setdefault(case, []).append(
                Past(
                    run_name(history.runs[entry.run]),
                    name,
                    in_tolerances(entry),
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


def in_tolerances(entry: Entry) -> dict[str, float]:
    """Return the largest error of the outputs in tolerances, by motion."""
    found: dict[str, float] = {}
    for deviations in entry.errors.values():
        for motion, deviation in deviations.items():
            found[motion] = max(found.get(motion, 0.0), deviation.ratio)
    return found


def largest_errors(entry: Entry, case: str, row: RunRow) -> dict[str, float]:
    """Return the largest errors of the outputs by unit: of values, velocities and accelerations."""
    found: dict[str, float] = {}
    for name, deviations in entry.errors.items():
        for quantity, deviation in deviations.items():
            unit = motion_unit(unit_of(row, case, name), quantity) or "1"
            found[unit] = max(found.get(unit, 0.0), deviation.max_abs)
    return found
