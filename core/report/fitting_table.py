"""A table for consoles of any width."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Console, ConsoleOptions, RenderResult
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

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
