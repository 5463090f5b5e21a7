"""Trends of a history for the report: errors and times of each engine and case over the runs."""

from __future__ import annotations

from ..harness.labels import motion_unit, product
from ..history.queries import Entry, History, unit_of
from ..history.store import RunRow
from .figure_data import Past


def trends(history: History) -> dict[str, list[Past]]:
    """Return the results of each engine by case, in the order of the runs."""
    found: dict[str, list[Past]] = {}
    place = {run: k for k, run in enumerate(history.runs)}
    for (case, engine, mode), entries in history.pairs.items():
        name = product(engine, mode)
        for entry in entries:
            row = history.runs[entry.run]
            found.setdefault(case, []).append(
                Past(run_name(row), name, largest_length(entry, case, row), entry.us_per_step)
            )
    names = {run_name(row): place[row.id] for row in history.runs.values()}
    return {case: sorted(each, key=lambda past: names[past.run]) for case, each in found.items()}


def run_name(row: RunRow) -> str:
    """Return the label of a run on an axis: its date and its number, since a minute may have
    several runs.
    """
    return f"{row.started[:16].replace('T', ' ')} #{row.id}"


def largest_length(entry: Entry, case: str, row: RunRow) -> float | None:
    """Return the largest position error of the outputs in metres [m]; None without any."""
    return largest_errors(entry, case, row).get("m")


def largest_errors(entry: Entry, case: str, row: RunRow) -> dict[str, float]:
    """Return the largest errors of the outputs by unit: of values, velocities and accelerations."""
    found: dict[str, float] = {}
    for name, deviations in entry.errors.items():
        for quantity, deviation in deviations.items():
            unit = motion_unit(unit_of(row, case, name), quantity) or "1"
            found[unit] = max(found.get(unit, 0.0), deviation.max_abs)
    return found
