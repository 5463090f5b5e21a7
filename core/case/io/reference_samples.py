"""Samples of a reference: from a table beside the case file, or from rows in it; and its columns,
with units and the outputs that they hold.

A table may have titles above its head, remarks below, and comments, such as `# signs: iso8855`. A
head is the name of an output, or `OUTPUT.velocity` or `OUTPUT.acceleration`, with or without a
unit: `toe [deg]`; units may also stand in a row below.
"""

from __future__ import annotations

import math
import re
from array import array
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, takewhile
from pathlib import Path

import numpy as np

from ...errors import brief, remedy
from ...trajectory import Array
from ..case import PER_TRAVEL, Quantity
from ..curves import Printed
from ..units import Convert, FileUnits, Unit, si_of
from .document import LARGEST, SMALLEST, fault, number_or_nan, read_text, shown
from .readers import WORKBOOKS
from .schema import ReferenceKeys
from .table import (
    DELIMITERS,
    LARGEST_FILE,
    Cell,
    Table,
    find_decimal_sign,
    is_number,
    is_unit_row,
    numeral,
    one_sheet,
    read_sheets,
    require_unit,
    text_table,
    trim,
    unit_of_head,
)

# A line for each sample of the largest sweep, and as many other lines.
MOST_LINES = 2_000_000
# Titles, settings of a rig and heads stand above the first numbers.
MOST_ABOVE = 1000
COLUMNS, ROWS = "reference.columns", "reference.rows"
"""Places of a table in a case file."""
RATES: Mapping[str, str] = {"": "", ".velocity": "/s", ".acceleration": "/s^2"}
"""Endings of the columns of a quantity and of its rates, with their part of the unit."""
_SIGNS = re.compile(r"\"?\s*#\s*signs:\s*(\w+)")


@dataclass(frozen=True)
class Samples:
    """Columns by name, and their numbers.

    Attributes:
        header: place of the names.
        places: of the rows, for messages.
        numbers: shape (rows, columns), NaN for gaps.
        printed: digits of the numbers, by column.
        table: the table that they are from, with the driver values in its column `first`.
        signs: sign convention named in a comment.
        left_out: comments, titles above the head, rows without numbers below it, and remarks beside
            rows.
    """

    file: Path
    header: str
    columns: Sequence[str]
    places: Sequence[str]
    numbers: Array
    printed: Sequence[Printed]
    table: Table
    first: int
    signs: str
    left_out: Sequence[str]

    @property
    def key(self) -> str:
        """Key of the rows in a case file; empty in a file of their own."""
        return ROWS if self.header == COLUMNS else ""

    def driver_value(self, k: int) -> str:
        """Return the driver value of a row as written."""
        rows = self.table.rows()
        return next(str(cells[self.first]) for place, cells in rows if place == self.places[k])


def read_table(file: Path, sheet: str | None, option: str, above: str | None = None) -> Table:
    """Read the table of a reference or a recording.

    Args:
        sheet: name of the sheet of a workbook; None for the only sheet with cells.
        option: the option to choose a sheet, for messages.
        above: the last line of a text that is above the table, if it has one, in small letters.

    Raises:
        CaseError: the file is unreadable, too large, or has no such sheet.
    """
    if file.suffix.lower() in WORKBOOKS:
        return one_sheet(file, read_sheets(file, sheet, MOST_LINES), option)
    if sheet is not None:
        problem = f"found the sheet {shown(sheet)} of a file that is no workbook (.xlsx)"
        raise fault(file, "sheet", f"{problem}, expected none; leave it out")
    text = read_text(file, LARGEST_FILE, "thin out the samples", of_spreadsheet=True)
    lines = text.splitlines()
    if len(lines) > MOST_LINES:
        raise fault(
            file,
            "",
            f"found {len(lines)} lines, expected a row for each sample of the sweep; thin out the"
            " samples",
        )
    last = next((k for k, line in enumerate(lines, 1) if line.strip().lower() == above), 0)
    lines[:last] = [""] * last
    return text_table(file, lines, ("#",), _delimiter)


def _delimiter(table: Table) -> str:
    """Return the most frequent sign of the first line that has one, or a blank if numbers stand
    above it; titles may stand above the head.
    """
    for line in table.lines:
        most = max(DELIMITERS, key=line.count)
        if most in line:
            return most
        if len(words := line.split()) > 1 and all(map(is_number, words)):
            return " "
    return ","


@dataclass(frozen=True)
class Layout:
    """The head of a table.

    Attributes:
        where: place of the head.
        heads: its texts, with the units of a row of units.
        rows: texts of the head and of the row of units, which may stand again below.
        body: index of the first row below, among all rows of the table.
    """

    where: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    body: int


def layout_of(table: Table) -> Layout:
    """Return the head of a table: the last row of texts above the numbers, or the last but one if
    units stand below it. If it names columns twice, or none, the row above it names their groups.

    Raises:
        CaseError: the table is empty.
    """
    first = list[tuple[str, Sequence[Cell]]]()
    all_numbers: int | None = None
    for where, cells in islice(table.rows(), MOST_ABOVE):
        first.append((where, trim(cells)))
        headed = any(_count_filled(row) > 1 and not _count_numbers(row) for _, row in first[:-1])
        # below a head, a lone number is a sample with gaps
        if _count_numbers(cells) == _count_filled(cells) > (0 if headed else 1):
            all_numbers = len(first) - 1
            break
    most_numbers = (
        k for k, (_, cells) in enumerate(first) if 2 * _count_numbers(cells) > _count_filled(cells)
    )
    several = (k + 1 for k, (_, cells) in enumerate(first) if _count_filled(cells) > 1)
    body = all_numbers
    if body is None:
        body = next(most_numbers, next(several, min(1, len(first))))
    above = [row for row in first[:body] if _count_filled(row[1]) > 1] or first[: max(body, 1)]
    if not above:
        raise fault(
            table.file,
            "",
            "found no samples, expected a line of column names and rows of numbers; add them",
        )
    texts = [[str(cell).strip() for cell in cells] for _, cells in above]
    units = texts.pop() if len(texts) > 1 and is_unit_row(texts[-1]) else []
    where, heads = above[len(texts) - 1][0], texts[-1]
    named = [*filter(None, heads)]
    if len(texts) > 1 and (len({*named}) < len(named) or "" in heads):
        heads = [f"{a} {b}".strip() for a, b in zip(*_group_names(texts[-2], heads), strict=True)]
    rows = [texts[-1], *[units] * bool(units)]
    units = [unit.strip("[]() ") for unit in units] + [""] * len(heads)
    heads = [f"{a} [{b}]" if a and b else a for a, b in zip(heads, units, strict=False)]
    return Layout(where, heads, rows, max(body, 1))


def _group_names(above: Sequence[str], heads: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the names of groups, each over the blank cells behind it, and the heads below."""
    width = max(len(above), len(heads))
    groups, below = ([*row, *[""] * (width - len(row))] for row in (above, heads))
    for k in range(1, width):
        groups[k] = groups[k] or (groups[k - 1] if below[k] else "")
    return groups, below


def _count_filled(cells: Sequence[Cell]) -> int:
    return sum(cell != "" for cell in cells)


def _count_numbers(cells: Sequence[Cell]) -> int:
    return sum(map(is_number, cells))


def samples_of(
    table: Table,
    wanted: Sequence[int] | None = None,
    *,
    remarks: bool = False,
    gaps: bool = False,
) -> Samples:
    """Return the samples of a table: a head and rows of numbers; a row of units may stand between.

    Args:
        wanted: indices of the columns to read, the driver first; None for all.
        remarks: whether rows without a number are remarks, or the head again, and no faults; the
            caller tells those left out.
        gaps: whether empty cells and "nan" are gaps, and no faults.

    Raises:
        CaseError: a row lacks a number, or has a text in place of one, or a second head follows.
    """
    file, layout = table.file, layout_of(table)
    names = layout.heads
    wanted = range(len(names)) if wanted is None else wanted
    every = [*wanted] == [*range(len(names))]
    sign = "." if table.delimiter == "," else _decimal_sign(table, layout, wanted)
    places, numbers, left_out = list[str](), array("d"), [*_above(table, layout)]
    printed = [Printed() for _ in wanted]
    for place, cells in islice(table.rows(), layout.body, None):
        cells = trim(cells)
        first = cells[wanted[0]] if wanted[0] < len(cells) else ""
        is_remark = remarks and not is_number(first) and _is_remark(file, place, cells, layout)
        if is_remark or not (every or any(cells[n] != "" for n in wanted if n < len(cells))):
            left_out.append(_shown_row(place, cells))
            continue
        if beside := cells[len(names) :]:
            left_out.append(_shown_row(place, beside))
        if gaps:
            cells = [*cells, *[""] * (len(names) - len(cells))]
        width = len(cells)
        surplus = any(map(is_number, cells[len(names) :])) or (every and width > len(names))
        if (width < len(names) if every else width <= max(wanted)) or surplus:
            expected = f"{len(names)} ({', '.join(names)})"
            raise fault(
                file, place, f"found {width} numbers, expected {expected}; complete the row"
            )
        # convert at once: the cells of a large file as texts would take many times its size
        for column, n in zip(printed, wanted, strict=True):
            if gaps and str(cells[n]).lower().lstrip("+-") in ("", "nan"):
                column.add("")
                numbers.append(math.nan)
                continue
            text = numeral(cells[n], sign)
            column.add(text)
            numbers.append(_number(file, f"{place}, column {names[n]}", cells[n], text))
        places.append(place)
    if not places:
        raise fault(
            file,
            "",
            "found column names only, expected rows of numbers, one for each sample; add them",
        )
    comments = [*table.comments, *(str(cells[0]) for _, cells in table.sheet)]
    signs = next((said[1] for text in comments if (said := _SIGNS.match(text))), "")
    return Samples(
        *(file, layout.where, [names[n] for n in wanted], places),
        np.array(numbers).reshape(len(places), len(wanted)),
        *(printed, table, wanted[0], signs, left_out),
    )


def _above(table: Table, layout: Layout) -> Iterator[str]:
    """Yield comments, and rows above the head that name no groups of columns."""
    yield from (brief(text) for text in table.comments if not _SIGNS.match(text))
    for place, cells in takewhile(lambda row: row[0] != layout.where, table.rows()):
        if not any(head.startswith(str(cells[0])) for head in layout.heads):
            yield _shown_row(place, cells)


def _shown_row(place: str, cells: Sequence[Cell]) -> str:
    return f"{place} ({brief(', '.join(map(str, filter(None, cells))))})"


def _is_remark(file: Path, place: str, cells: Sequence[Cell], layout: Layout) -> bool:
    """Return whether a row has no number: a remark, or the head or its units again.

    Raises:
        CaseError: it is another head, so that another table follows.
    """
    texts = [str(cell).strip() for cell in cells]
    if _count_numbers(cells) or any(
        text.startswith(("=", "#N", "#R", "#V", "#D")) for text in texts
    ):
        return False
    if (
        texts in layout.rows
        or 2 * _count_filled(cells) <= len(layout.heads)
        or _count_filled(cells) == 1
    ):
        return not texts or texts[0].lower().lstrip("+-") != "nan"
    raise fault(
        file,
        place,
        f"found {shown(', '.join(texts))}, a row without numbers that is not the head"
        f" {shown(', '.join(layout.rows[0]))}, expected one table; keep one, or take the row out",
    )


def _decimal_sign(table: Table, layout: Layout, wanted: Sequence[int]) -> str:
    texts = [
        (place, cell)
        for place, cells in islice(table.rows(), layout.body, None)
        if _count_numbers(cells)
        for cell in (cells[n] for n in wanted if n < len(cells))
        if isinstance(cell, str) and cell
    ]
    return find_decimal_sign(table.file, texts)


def _number(file: Path, where: str, cell: object, text: str) -> float:
    number = number_or_nan(text)
    if not abs(number) <= LARGEST:
        raise fault(
            file,
            where,
            f"found {shown(cell)}, expected a finite number, at most {LARGEST:g}; correct it or"
            " leave the column out",
        )
    return number if abs(number) >= SMALLEST else 0.0  # far below any tolerance


def inline_table(file: Path, keys: ReferenceKeys, outputs: Sequence[Quantity]) -> Table:
    """Return the table of the rows in a case file.

    Raises:
        CaseError: there are no rows, or one of them is empty.
    """
    if keys.rows is None:
        raise fault(
            file,
            "reference",
            "found neither file nor rows, expected one of them; name a CSV file or give the rows",
        )
    own = (output.name for output in outputs if not output.name.endswith(PER_TRAVEL))
    for k, row in enumerate(keys.rows):
        if not row:  # no blank line, as a table of text may have
            raise fault(file, f"{ROWS}[{k}]", "found no numbers; complete the row or take it out")
    rows = [(f"{ROWS}[{k}]", [*map(repr, row)]) for k, row in enumerate(keys.rows)]
    head = (COLUMNS, keys.columns or ["driver", *own])
    return Table(file, delimiter=",", sheet=[head, *rows])


@dataclass(frozen=True)
class Column:
    """A column of a reference.

    Attributes:
        place: its index.
        unit: its unit in the file, in words.
        convert: conversion of its numbers to SI.
    """

    place: int
    unit: str
    convert: Convert


@dataclass(frozen=True)
class Columns:
    """The columns of a reference.

    Attributes:
        driver: the unit of the driver values, in the first column.
        name: name of the first column.
        of: columns by OUTPUT, OUTPUT.velocity and OUTPUT.acceleration.
    """

    driver: Unit
    name: str
    of: Mapping[str, Column]


def known_columns(outputs: Iterable[Quantity]) -> dict[str, str]:
    """Return the SI unit of each possible column of outputs, by name."""
    return {
        output.name + ending: output.unit + time
        for output in outputs
        for ending, time in RATES.items()
    }


def driver_unit(samples: Samples, default: Unit) -> tuple[str, Unit]:
    """Return the name of the first column, and the unit of the driver values in it.

    Args:
        default: unit without one in the head.

    Raises:
        CaseError: the unit is unknown, or of something else.
    """
    text = samples.columns[0]
    name, unit = unit_of_head(samples.file, samples.header, text)
    if not unit:
        return text, default
    return name, require_unit(samples.file, samples.header, text, unit, si_of(default))


def read_columns(
    samples: Samples, driver: Unit, units: FileUnits, outputs: Sequence[Quantity]
) -> Columns:
    """Return the columns of a reference of a case file.

    Args:
        driver: unit of the driver values, unless the head gives another one.
        units: of the case file.

    Raises:
        CaseError: a column is unknown or given twice, or a unit is not the output's.
    """
    file, where, known = samples.file, samples.header, known_columns(outputs)
    first, driver = driver_unit(samples, driver)
    heads = [
        (name, unit) if name in known else (text, unit)
        for text in samples.columns[1:]
        for name, unit in [unit_of_head(file, where, text, known)]
    ]
    counts = Counter(name for name, _ in heads)
    if not heads:
        names = ", ".join(output.name for output in outputs)
        raise fault(file, where, f"found no column of an output, expected some of {names}; add one")
    if first in known:
        raise fault(
            file,
            where,
            f"found {first!r} first, the name of an output, expected the driver values; put their"
            " column first, or name it otherwise",
        )
    for name in counts:
        if counts[name] > 1:
            raise fault(
                file, where, f"found the column {name!r} twice, expected it once; remove one"
            )
        if name not in known:
            raise fault(
                file,
                where,
                f"found the column {shown(name)}, expected outputs of the case;"
                f" {remedy(name, known)}",
            )
        require_positions(samples, name, counts)
    of = {
        name: column_of(samples, k, unit, known[name], units)
        for k, (name, unit) in enumerate(heads, 1)
    }
    return Columns(driver, first, of)


def column_of(samples: Samples, k: int, unit: str, si: str, units: FileUnits) -> Column:
    """Return a column.

    Args:
        k: its index.
        unit: its unit, from the head; empty for the default.
        si: the SI unit of its values.
        units: the default units.

    Raises:
        CaseError: the unit is unknown, or of something else.
    """
    if not unit:
        return Column(k, *units.of(si.removesuffix("^2").removesuffix("/s")))
    found = require_unit(samples.file, samples.header, samples.columns[k], unit, si)
    return Column(k, found.name, found.convert)


def require_positions(samples: Samples, name: str, names: Collection[str]) -> None:
    """Refuse a derivative without the column of its positions.

    Raises:
        CaseError: it has none.
    """
    stem = name.removesuffix(".velocity").removesuffix(".acceleration")
    if stem not in names:
        raise fault(
            samples.file,
            samples.header,
            f"found {name!r} alone, expected its positions too; add the column {stem!r}",
        )
