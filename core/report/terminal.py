"""Output of commands: text and tables on the terminal, and the same data as JSON for programs."""

from __future__ import annotations

import os
import sys
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, TextIO

import msgspec
from rich.console import Console
from rich.padding import Padding
from rich.text import Text

from ..case.io.atomic_files import to_standard_output, write
from ..errors import KincheckError
from ..harness.record import to_json
from .fitting_table import FittingTable

# Width for a log or a pipe, unless the environment variable COLUMNS sets it: they have no width,
# and must not break the lines of a table.
LOG_WIDTH = 200


class _Console(Console):
    """A console whose reader may end early: it drops further output, and the command still exits
    with the status of its results.
    """

    def on_broken_pipe(self) -> None:
        self.quiet = True
        print_no_more(self.file)


def print_no_more(file: IO[str]) -> None:
    """Drop further output of a stream: the interpreter would report it as an error at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), file.fileno())


def console(file: TextIO) -> Console:
    """Return a console for unchanged text: rich would read square brackets and colons in names as
    colours and emoji.
    """
    return _Console(
        file=file,
        width=None if file.isatty() or os.environ.get("COLUMNS", "").isdigit() else LOG_WIDTH,
        highlight=False,
        markup=False,
        emoji=False,
    )


def page(json: str | None) -> Console:
    """Return the console for tables: standard output, unless the JSON goes there."""
    return console(sys.stderr if json == "-" else sys.stdout)


def columns(*heads: str, title: str | None = None) -> FittingTable:
    """Return a table without rules that fits the console.

    Args:
        heads: heads of the columns. A column whose head begins with ">" is right-aligned and never
            wrapped.
    """
    table = FittingTable(title=title)
    for head in heads:
        right = head.startswith(">")
        # a Text, since rich reads a string as mark-up, in which [red] is a colour
        table.add_column(
            Text(head.removeprefix(">")),
            justify="right" if right else "left",
            overflow="fold",
            no_wrap=right,
        )
    return table


def unheaded(rows: Sequence[Sequence[str]]) -> FittingTable:
    """Return rows with equal numbers of cells as a table without heads that fits the console."""
    table = columns(*[""] * max(map(len, rows), default=0))
    table.show_header = False
    for row in rows:
        table.add_row(*map(Text, row))
    return table


def indented(table: FittingTable) -> Padding:
    """Return the table, indented below a line of text."""
    return Padding(table, (0, 0, 0, 2), expand=False)


@contextmanager
def with_json(found: msgspec.Struct | Mapping[str, Any], json: str | None) -> Generator[None]:
    """Write the answer as JSON to a file, or for "-" to standard output, then print in the block:
    the reader of the tables may end early.

    Raises:
        KincheckError: the file cannot be written; after the block.
    """
    problem: KincheckError | None = None
    try:
        if json == "-":
            to_standard_output(to_json(found))
        elif json is not None:
            write("--json", Path(json), to_json(found))
    except KincheckError as error:
        problem = error
    yield
    if problem:
        raise problem


def listed(names: Sequence[str]) -> str:
    """Return the names as one text."""
    return ", ".join(names) or "none"
