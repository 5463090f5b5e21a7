"""The changes since another run as text and tables for a terminal."""

from __future__ import annotations

from typing import TextIO

from rich.console import Console
from rich.text import Text

from ..case.io.escape import visible
from ..history.findings import WHY, Kind, Regressions
from . import terminal
from .regression_labels import (
    LONGEST,
    STEPS,
    headline,
    loose_says,
    pairs,
    passed_by_says,
    rows,
    step_lines,
)


def print_regressions(found: Regressions, file: TextIO) -> None:
    """Print the changes, the worst first."""
    console = terminal.console(file)
    _print_line(console, headline(found), "bold")
    if found.changes:
        _print_line(console, f"changed: {', '.join(map(str, found.changes))}")
    elif found.against is not None:
        _print_line(console, "neither versions nor machine nor commit changed")
    if passed_by := passed_by_says(found):
        _print_line(console, passed_by)
    for kind in Kind:
        _print_kind(console, found, kind)
    for over, title in STEPS.items():
        _print_list(console, title.lower(), step_lines(found.steps, over=over))
    _print_list(console, "tolerances that could be tightened", loose_says(found.loose))


def _print_kind(console: Console, found: Regressions, kind: Kind) -> None:
    group = rows(each for each in found.findings if each.kind is kind)
    if not group:
        return
    style = "bold red" if found.fails(kind) else "bold"
    _print_line(console, "")
    _print_line(console, f"{kind} ({len(pairs(found, kind))}): {WHY[kind]}", style)
    table = terminal.columns("engine", "case", "what")
    for each in group[:LONGEST]:
        table.add_row(*(Text(visible(cell)) for cell in (each.engine, each.where, each.what)))
    console.print(terminal.indented(table))
    _print_rest(console, len(group))


def _print_list(console: Console, title: str, lines: list[str]) -> None:
    if not lines:
        return
    _print_line(console, "")
    _print_line(console, f"{title} ({len(lines)})", "bold")
    for line in lines[:LONGEST]:
        _print_line(console, f"  {line}")
    _print_rest(console, len(lines))


def _print_rest(console: Console, count: int) -> None:
    if count > LONGEST:
        _print_line(console, f"  and {count - LONGEST} more, all in the JSON")


def _print_line(console: Console, line: str, style: str = "") -> None:
    console.print(Text(visible(line), style=style), soft_wrap=True)
