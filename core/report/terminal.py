"""Output of commands: text and tables on the terminal, and the same data as JSON for programs."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, TextIO

import msgspec
from rich.console import Console, ConsoleOptions, RenderResult
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from ..case.io.atomic_files import Content, to_standard_output, write, write_all
from ..errors import KincheckError
from ..harness.record import to_json

# Wider than any table [characters].
UNBOUNDED = 100_000
# Shortest line that text is wrapped to [characters].
READABLE = 30
INDENT, GAP = 2, 2


class FittingTable(Table):
    """A table without rules that breaks no word.

    If the console is too narrow for all columns, each row is a block: its first cell, and below it
    the others with their heads. A number in the first cell has its head, too.
    """

    def __init__(self, *, title: str | None = None) -> None:
        super().__init__(
            box=None,
            pad_edge=False,
            header_style="bold",
            title=title,
            title_justify="left",
            title_style="bold",
        )

    def natural_width(self, console: Console, options: ConsoleOptions) -> int:
        """Return the width of the table without wrapped text [characters]."""
        return self._width(console, options, UNBOUNDED)

    def _width(self, console: Console, options: ConsoleOptions, readable: int) -> int:
        """Return the width of the table with text wrapped to a number of characters."""
        width = self._extra_width
        for column in self.columns:
            found = self._measure_column(console, options.update_width(UNBOUNDED), column)
            wrapped = max(found.minimum, readable)
            width += found.maximum if column.no_wrap else min(found.maximum, wrapped)
        return width

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        if self._width(console, options, READABLE) <= options.max_width:
            yield from super().__rich_console__(console, options)
            return
        if self.title:
            yield Text(str(self.title), "bold")
        yield from self._blocks(options.max_width)

    def _blocks(self, width: int) -> Iterator[Text | Padding]:
        """Yield the lines of each row."""
        heads = [_text(column.header).plain.replace("\n", " ") for column in self.columns]
        for number, cells in enumerate(zip(*(each.cells for each in self.columns), strict=True)):
            style = self.rows[number].style or ""
            first, *others = map(_text, cells)
            if first and self.columns[0].justify == "right":
                yield Text.assemble((f"{heads[0]} ", "dim"), first, style=style)
            elif first:
                yield Text.assemble(first, style=style)
            line = Text(style=style)
            for head, cell in zip(heads[1:], others, strict=True):
                if not cell.plain:
                    continue
                item = Text.assemble((f"{head} " if head else "", "dim"), cell)
                if line and line.cell_len + GAP + item.cell_len > width - INDENT:
                    yield Padding(line, (0, 0, 0, INDENT), expand=False)
                    line = Text(style=style)
                line = Text.assemble(line, " " * GAP if line else "", item, style=style)
            if line:
                yield Padding(line, (0, 0, 0, INDENT), expand=False)


def _text(cell: object) -> Text:
    return cell if isinstance(cell, Text) else Text(str(cell))


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


def console(file: IO[str]) -> Console:
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


def table_without_heads(rows: Sequence[Sequence[str]]) -> FittingTable:
    """Return rows with equal numbers of cells as a table without heads that fits the console."""
    table = columns(*[""] * max(map(len, rows), default=0))
    table.show_header = False
    for row in rows:
        table.add_row(*map(Text, row))
    return table


def indent_table(table: FittingTable) -> Padding:
    """Return the table, indented below a line of text."""
    return Padding(table, (0, 0, 0, 2), expand=False)


@contextmanager
def with_json(found: msgspec.Struct | Mapping[str, Any], json: str | None) -> Generator[Console]:
    """Write the answer as JSON to a file, or for "-" to standard output, then print in the block
    on the console of `page`: the reader of the tables may end early.

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
    yield page(json)
    if problem:
        raise problem


def deliver(
    contents: Sequence[tuple[Path, Content]],
    encoded: bytes,
    json: str | None,
    show: Callable[[TextIO], None],
) -> list[str]:
    """Write files, print, and return the problems in writing.

    The reader of what is printed may end early, so the files come first, and a document on
    standard output last.

    Args:
        encoded: document of the option --json.
        json: its file, or "-" for standard output, which then holds nothing else.
        show: prints.
    """
    named = [(Path(json), encoded)] if json not in (None, "-") else []
    problems = write_all([*contents, *named])
    show(sys.stderr if json == "-" else sys.stdout)
    if json == "-":
        to_standard_output(encoded)
    return problems
