"""Samples of a reference from a table beside the case file: a CSV file of a spreadsheet, or a sheet
of a workbook.

Commas, semicolons or tabs separate the fields. With semicolons or tabs the decimal sign may be a
comma. The reader skips titles above the head, and comments, such as `# signs: iso8855`.
"""

from __future__ import annotations

import csv
import math
import re
from array import array
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path

from ..printed import Printed
from .decimal_sign import find_decimal_sign
from .document import LARGEST, SMALLEST, decimal, fault, read_text, shown
from .reference_samples import ROWS, ReferenceKeys, Samples, check_width, only_beside
from .workbook import WORKBOOKS, Cell, Row, one_sheet, read_sheets

LARGEST_FILE = 64_000_000
# A line for each sample of the largest sweep, and as many other lines.
MOST_LINES = 2_000_000
_SIGNS = re.compile(r"\"?\s*#\s*signs:\s*(\w+)")
_SEPARATOR = re.compile(r"\"?sep=([;\t,])\"?", re.IGNORECASE)


def from_table(case_file: Path, keys: ReferenceKeys) -> Samples:
    """Read the samples of the table beside a case file.

    Raises:
        CaseError: the file is unreadable or lies elsewhere, or is no table of numbers.
    """
    file = only_beside(case_file, keys)
    if file.suffix.lower() in WORKBOOKS:
        return _of_sheet(file, keys.sheet)
    if keys.sheet is not None:
        problem = f"found {shown(keys.sheet)}, but {keys.file} is no workbook (.xlsx)"
        raise fault(case_file, "reference.sheet", f"{problem}, expected none; remove it")
    text = read_text(file, LARGEST_FILE, "thin out the samples", of_spreadsheet=True)
    lines = text.splitlines()
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
    reader = csv.reader(lines, delimiter=delimiter, skipinitialspace=True, strict=True)
    rows = ((f"line {reader.line_num}", cells) for cells in reader if cells)
    try:
        if delimiter == ",":
            return _samples(file, rows, signs, lines)
        plain = _below_titles([(where, _trimmed(cells)) for where, cells in rows])
    except csv.Error as error:
        raise fault(
            file, f"line {reader.line_num}", f"not valid CSV: {error}; correct the line"
        ) from None
    return _samples(file, plain, signs, sign=_decimal_sign(file, plain[1:]))


def _of_sheet(file: Path, wanted: str | None) -> Samples:
    """Read the samples of the wanted sheet of a workbook, or of its only sheet with cells."""
    sheet = one_sheet(file, read_sheets(file, wanted, MOST_LINES), 'sheet = "NAME" in [reference]')
    comments = [str(cells[0]) for _, cells in sheet.rows]
    signs = next((found[1] for text in comments if (found := _SIGNS.match(text))), "")
    rows = [
        row
        for row, text in zip(sheet.rows, comments, strict=True)
        if not text.startswith("#") or _filled(row[1]) > 1
    ]
    table = _below_titles(rows)
    return _samples(file, table, signs, sign=_decimal_sign(file, table[1:]))


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
    return ","


def _below_titles(rows: Sequence[Row]) -> Sequence[Row]:
    """Return the rows from the head on, the first row with several cells; all rows without a
    head.
    """
    first = next((k for k, (_, cells) in enumerate(rows) if _filled(cells) > 1), 0)
    return rows[first:]


def _filled(cells: Sequence[Cell]) -> int:
    return sum(cell != "" for cell in cells)


def _trimmed(cells: Sequence[str]) -> list[Cell]:
    """Return cells without surrounding blanks, and without empty cells at the end."""
    found = [cell.strip() for cell in cells]
    while found and not found[-1]:
        found.pop()
    return [*found]


def _decimal_sign(file: Path, rows: Sequence[Row]) -> str:
    """Return the decimal sign of the texts in rows."""
    texts = [
        (where, cell) for where, cells in rows for cell in cells if isinstance(cell, str) and cell
    ]
    return find_decimal_sign(file, texts)


def _samples(
    file: Path,
    rows: Iterable[tuple[str, Sequence[Cell]]],
    signs: str,
    lines: Sequence[str] = (),
    sign: str = ".",
) -> Samples:
    """Return the samples of a head and rows of numbers.

    Args:
        lines: lines of a CSV file, for messages.
        sign: decimal sign of texts.
    """
    samples: Samples | None = None
    numbers: list[tuple[str, Sequence[float]]] = []
    for where, cells in rows:
        if samples is None:
            samples = Samples(
                file,
                where,
                [str(cell).strip() for cell in cells],
                numbers,
                signs=signs,
                lines=lines,
                printed=[Printed() for _ in cells],
            )
            continue
        check_width(samples, where, len(cells))
        # convert at once: the cells of a large file as texts would take many times its size
        found = array(
            "d",
            (
                _number(file, where, name, cell, sign)
                for name, cell in zip(samples.columns, cells, strict=True)
            ),
        )
        numbers.append((where, found))
        for column, cell in zip(samples.printed, cells, strict=True):
            column.add(cell.replace(sign, ".") if isinstance(cell, str) else repr(cell))
    if samples is None:
        raise fault(
            file,
            "",
            "found no samples, expected a line of column names and rows of numbers; add them",
        )
    if not numbers:
        raise fault(file, "", f"found column names only, {ROWS}")
    return samples


def _number(file: Path, where: str, column: str, cell: Cell, sign: str) -> float:
    number = math.nan
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
