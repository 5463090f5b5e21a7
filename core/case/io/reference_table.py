"""Samples of a reference from a table beside the case file: a CSV file of a spreadsheet, or a sheet
of a workbook.

Commas, semicolons, tabs or blanks separate the fields. But for commas, the decimal sign may be a
comma. The reader skips titles above the head, and comments, such as `# signs: iso8855`.
"""

from __future__ import annotations

import csv
import math
import re
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import chain
from pathlib import Path
from typing import TypeAlias

from ..printed import Printed
from .column_units import is_unit_row
from .decimal_sign import find_decimal_sign
from .document import LARGEST, SMALLEST, decimal, fault, read_text, shown
from .reference_samples import ROWS, Samples, check_width
from .workbook import WORKBOOKS, Cell, Row, one_sheet, read_sheets, require_narrow

LARGEST_FILE = 64_000_000
# A line for each sample of the largest sweep, and as many other lines.
MOST_LINES = 2_000_000
_SIGNS = re.compile(r"\"?\s*#\s*signs:\s*(\w+)")
_BLANKS, _BEFORE_UNIT = re.compile(r"\s+"), re.compile(r"\s+(?=[\[(])")
_NUMBERS = re.compile(r"\s*[-+]?[\d.]+\S*(?:\s+[-+]?[\d.]+\S*)+\s*")
_SEPARATOR = re.compile(r"\"?sep=([;\t,])\"?", re.IGNORECASE)

_GAPS = ("", "nan", "+nan", "-nan")

Choose: TypeAlias = Callable[[Path, str, Sequence[str]], Sequence[int]]
"""Choice of columns, see `from_table`."""


def every_column(_file: Path, _where: str, heads: Sequence[str]) -> Sequence[int]:
    """Return the indices of all columns."""
    return range(len(heads))


def from_table(
    file: Path,
    sheet: str | None,
    option: str,
    choose: Choose = every_column,
    *,
    gaps: bool = False,
    above: str = "",
) -> Samples:
    """Read the samples of a table.

    Args:
        sheet: name of the sheet of a workbook; None for the only sheet with cells.
        option: the option to choose a sheet, for messages.
        choose: returns the indices of the columns to read, from the place of their heads and the
            heads.
        gaps: whether empty cells and NaN are gaps, which become NaN, and no errors.
        above: the line of a text that ends what stands above the table, if there is one.

    Raises:
        CaseError: the file is unreadable, or is no table of numbers.
    """
    if file.suffix.lower() in WORKBOOKS:
        return _of_sheet(file, sheet, option, choose, gaps=gaps)
    if sheet is not None:
        problem = f"found the sheet {shown(sheet)} of a file that is no workbook (.xlsx)"
        raise fault(file, "sheet", f"{problem}, expected none; leave it out")
    text = read_text(file, LARGEST_FILE, "thin out the samples", of_spreadsheet=True)
    lines = text.splitlines()
    ends = [k for k, line in enumerate(lines) if above and line.strip().lower() == above]
    lines[: ends[0] + 1 if ends else 0] = [""] * (ends[0] + 1 if ends else 0)
    if len(lines) > MOST_LINES:
        raise fault(
            file,
            "",
            f"found {len(lines)} lines, expected a row for each sample of the sweep; thin out the"
            " samples",
        )
    signs = next((found[1] for line in lines if (found := _SIGNS.match(line))), "")
    # blank comment lines, not drop them: the reader's line numbers are then the file's
    lines = ["" if line.lstrip('" \t').startswith("#") else line for line in lines]
    delimiter = _delimiter(lines)
    require_narrow(file, ((f"line {k}", line) for k, line in enumerate(lines, 1)), delimiter)
    if delimiter == " ":
        lines = [_BLANKS.sub(" ", _BEFORE_UNIT.sub("", line.strip())) for line in lines]
    reader = csv.reader(lines, delimiter=delimiter, skipinitialspace=True, strict=True)
    rows = (
        (f"line {reader.line_num}", trimmed) for cells in reader if (trimmed := _trimmed(cells))
    )
    try:
        if delimiter == ",":
            return _samples(file, _below_titles(rows), signs, choose, lines, gaps=gaps)
        return _with_sign(file, [*_below_titles(rows)], signs, choose, gaps=gaps)
    except csv.Error as error:
        raise fault(
            file, f"line {reader.line_num}", f"not valid CSV: {error}; correct the line"
        ) from None


def _of_sheet(
    file: Path, wanted: str | None, option: str, choose: Choose, *, gaps: bool
) -> Samples:
    """Read the samples of the wanted sheet of a workbook, or of its only sheet with cells."""
    sheet = one_sheet(file, read_sheets(file, wanted, MOST_LINES), option)
    comments = [str(cells[0]) for _, cells in sheet.rows]
    signs = next((found[1] for text in comments if (found := _SIGNS.match(text))), "")
    rows = [
        row
        for row, text in zip(sheet.rows, comments, strict=True)
        if not text.startswith("#") or _filled(row[1]) > 1
    ]
    return _with_sign(file, [*_below_titles(rows)], signs, choose, gaps=gaps)


def _with_sign(
    file: Path, rows: Sequence[Row], signs: str, choose: Choose, *, gaps: bool
) -> Samples:
    """Read the samples of a table whose decimal sign may be a comma."""
    if not rows:
        return _samples(file, rows, signs, choose, gaps=gaps)
    (where, heads), *body = rows
    wanted = [*choose(file, where, [str(cell).strip() for cell in heads])]
    texts = [
        (place, cell)
        for k, (place, cells) in enumerate(body)
        if k or not is_unit_row(cells)
        for cell in (cells[n] for n in wanted if n < len(cells))
        if isinstance(cell, str) and cell
    ]
    return _samples(file, rows, signs, choose, sign=find_decimal_sign(file, texts), gaps=gaps)


def _delimiter(lines: list[str]) -> str:
    """Return the separator of fields, and blank a line `sep=;`."""
    k = next((k for k, line in enumerate(lines) if line.strip()), None)
    if k is None:
        return ","
    if found := _SEPARATOR.fullmatch(lines[k].strip(" ")):
        lines[k] = ""
        return found[1]
    for line in lines[k:]:  # titles may stand above the head
        counts = {sign: line.count(sign) for sign in ";\t,"}
        if any(counts.values()):
            return max(counts, key=lambda sign: counts[sign])
        if _NUMBERS.fullmatch(line):
            return " "
    return ","


def _below_titles(rows: Iterable[Row]) -> Iterator[Row]:
    """Return the rows from the head on, the first row with several cells; all rows without a
    head.
    """
    above: list[Row] = []
    rest = iter(rows)
    for row in rest:
        above.append(row)
        if _filled(row[1]) > 1:
            return chain(above[-1:], rest)
    return iter(above)


def _filled(cells: Sequence[Cell]) -> int:
    return sum(cell != "" for cell in cells)


def _trimmed(cells: Sequence[str]) -> list[Cell]:
    """Return cells without surrounding blanks, and without empty cells at the end."""
    found = [cell.strip() for cell in cells]
    while found and not found[-1]:
        found.pop()
    return [*found]


def _samples(
    file: Path,
    rows: Iterable[Row],
    signs: str,
    choose: Choose,
    lines: Sequence[str] = (),
    sign: str = ".",
    gaps: bool = False,
) -> Samples:
    """Return the samples of a head and rows of numbers; a row of units may stand between.

    Args:
        lines: lines of a CSV file, for messages.
        sign: decimal sign of texts.
    """
    rest = iter(rows)
    nothing: Row = ("", [])
    where, heads = next(rest, nothing)
    if not heads:
        raise fault(
            file,
            "",
            "found no samples, expected a line of column names and rows of numbers; add them",
        )
    names = [str(cell).strip() for cell in heads]
    wanted = [*choose(file, where, names)]
    numbers: list[tuple[str, Sequence[float]]] = []
    printed = [Printed() for _ in wanted]
    all_columns = wanted == [*range(len(names))]
    for k, (place, cells) in enumerate(rest):
        if k == 0 and is_unit_row(cells):
            units = [*map(str, cells), *[""] * len(names)]
            names = [
                f"{name} [{unit.strip('[]() ')}]" if unit else name
                for name, unit in zip(names, units, strict=False)
            ]
            continue
        if gaps:
            cells = [*cells, *[""] * (len(names) - len(cells))]
        if not all_columns and not any(cells[n] != "" for n in wanted if n < len(cells)):
            continue  # a note
        if all_columns or not max(wanted) < len(cells) <= len(names):
            check_width(file, place, len(cells), names)
        # convert at once: the cells of a large file as texts would take many times its size
        found = array(
            "d", (_number(file, place, names[n], cells[n], sign, gaps=gaps) for n in wanted)
        )
        numbers.append((place, found))
        for column, n in zip(printed, wanted, strict=True):
            cell = cells[n]
            text = cell.replace(sign, ".") if isinstance(cell, str) else repr(cell)
            # a workbook has integers as 5.0
            column.add(text if isinstance(cell, str) else text.removesuffix(".0"))
    if not numbers:
        raise fault(file, "", f"found column names only, {ROWS}")
    first = wanted[:1] == [0]  # messages quote the driver values of the first column
    columns = [names[n] for n in wanted]
    return Samples(
        file, where, columns, numbers, signs=signs, lines=lines if first else (), printed=printed
    )


def _number(
    file: Path, where: str, column: str, cell: Cell, sign: str, *, gaps: bool = False
) -> float:
    number = math.nan
    if gaps and isinstance(cell, str) and cell.lower() in _GAPS:
        return number
    with suppress(ValueError):
        number = decimal(cell.replace(sign, ".")) if isinstance(cell, str) else cell
    if not abs(number) <= LARGEST:
        expected = f"expected a finite number, at most {LARGEST:g}"
        raise fault(
            file,
            f"{where}, column {column}",
            f"found {shown(cell)}, {expected}; correct it or leave the column out",
        )
    return number if abs(number) >= SMALLEST else 0.0  # far below any tolerance
