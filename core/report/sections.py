"""Reports of tables and diagrams, on the terminal, as JSON and as a page: measurements of kincheck
itself, and comparisons of designs.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import msgspec
from rich.text import Text

from ..case.io.atomic_files import Content, to_standard_output, write_all
from ..errors import KincheckError
from ..harness.record import to_json
from . import terminal
from .figures import Figure, Style
from .fitting_table import FittingTable
from .page_model import Plot
from .page_parts import environment, figure_parts, style_sheet


@dataclass(frozen=True)
class Diagram:
    """A figure, its caption, and the styles of its curves."""

    plot: Plot
    figure: Figure
    styles: Sequence[Style]


@dataclass(frozen=True)
class Section:
    """One table of a report, with its conclusions.

    Attributes:
        verdict: the conclusions as sentences.
        notes: the method of measurement.
        columns: headings; the first `labels` of them head words, the others numbers.
        diagrams: diagrams above the table, only on the page; those with the same styles side by
            side.
        links: file that belongs to each row, beside the page; empty for none.
    """

    title: str
    verdict: Sequence[str]
    notes: Sequence[str]
    columns: Sequence[str]
    labels: int
    rows: Sequence[Sequence[str]]
    diagrams: Sequence[Diagram] = ()
    links: Sequence[str] = ()


@dataclass(frozen=True)
class Report:
    """Results for readers. `name` is also the name of its files."""

    name: str
    headline: str
    facts: Sequence[str]
    sections: Sequence[Section]


def deliver(
    report: Report,
    results: msgspec.Struct,
    *,
    out: Path | None,
    json: str | None,
    beside: Mapping[str, str] = {},
    files: Sequence[tuple[Path, Content]] = (),
    problems: Sequence[str] = (),
) -> None:
    """Print the tables and write the requested files.

    Args:
        out: folder for NAME.json, NAME.html and the files beside them.
        json: a file, or "-" for standard output, which then holds nothing else.
        beside: further texts by file name.
        files: further files.
        problems: earlier problems, to raise with those of the files.

    Raises:
        KincheckError: a file cannot be written, or there are earlier problems.
    """
    contents: list[tuple[Path, Content]] = [*files]
    if json not in (None, "-"):
        contents.append((Path(json), to_json(results)))
    if out is not None:
        contents += [
            (out / f"{report.name}.json", to_json(results)),
            (out / f"{report.name}.html", page(report).encode()),
            *((out / name, text.encode()) for name, text in beside.items()),
        ]
    problems = [
        *problems,
        *write_all(contents),
    ]  # before printing, since the reader of the tables may end early
    print_report(report, sys.stderr if json == "-" else sys.stdout)
    if json == "-":
        to_standard_output(to_json(results))
    if problems:
        raise KincheckError("\n".join(problems))


def print_report(report: Report, file: TextIO) -> None:
    """Print the tables, each with its verdict and notes."""
    console = terminal.console(file)
    console.print(Text(report.headline, style="bold"), soft_wrap=True)
    console.print(Text(" · ".join(report.facts)), soft_wrap=True)
    for section in report.sections:
        if not (section.rows or section.verdict):  # diagrams, for the page
            continue
        table = FittingTable()
        for column, heading in enumerate(section.columns):
            table.add_column(Text(heading), justify="left" if column < section.labels else "right")
        for row in section.rows:
            table.add_row(*(Text(cell) for cell in row))
        console.print()
        console.print(Text(section.title, style="bold"))
        if section.rows:
            console.print(table)
        for sentence in section.verdict:
            console.print(Text(f"- {sentence}"), soft_wrap=True)
        for note in section.notes:
            console.print(Text(f"  {note}", style="dim"), soft_wrap=True)


def page(report: Report) -> str:
    """Return the report as one HTML file in the style of a run's report."""
    figures = {
        diagram.plot.figure: diagram.figure
        for section in report.sections
        for diagram in section.diagrams
    }
    parts = figure_parts(figures) if figures else {"css": style_sheet()}
    return (
        environment()
        .get_template("bench.html")
        .render(report=report, scripted=bool(figures), **parts)
    )
