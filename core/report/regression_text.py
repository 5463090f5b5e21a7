"""The changes since another run as text and tables for a terminal."""

from __future__ import annotations

from typing import TextIO

from rich.console import Console
from rich.text import Text

from ..case.io.escape import visible
from ..harness.labels import product
from ..history.regression.findings import WHY, Kind, Regressions
from . import terminal
from .regression_labels import LONGEST, headline, loose_says, pairs, rows, step_says


def print_regressions(found: Regressions, file: TextIO) -> None:
    """Print the changes, the worst first."""
    console = terminal.console(file)
    _print_line(console, headline(found), "bold")
    if found.changes:
        _print_line(console, f"changed: {', '.join(map(str, found.changes))}")
    elif found.against is not None:
        _print_line(console, "neither versions nor machine nor commit changed")
    for kind in Kind:
        _print_kind(console, found, kind)
    steps = [
        f"{product(each.engine, each.mode)} on {each.case}: {step_says(each)}"
        for each in found.steps
    ]
    _print_list(console, "steps in the history that still stand", steps)
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
