"""Reports of commands, printed and written."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TextIO

import msgspec
from rich.text import Text

from ...case.io.atomic_files import Content
from ...errors import refuse
from ...harness.record import to_json
from ...report import terminal
from ...report.sections import Report, page
from ...report.terminal import FittingTable


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
    encoded = to_json(results)
    if out is not None:
        contents += [
            (out / f"{report.name}.json", encoded),
            (out / f"{report.name}.html", page(report).encode()),
            *((out / name, text.encode()) for name, text in beside.items()),
        ]
    written = terminal.deliver(contents, encoded, json, partial(print_report, report))
    refuse([*problems, *written])


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
