"""Sheets of spreadsheet files (.xlsx, .xlsm), read by openpyxl: the values computed by the
spreadsheet program, not the formulas.
"""

from __future__ import annotations

import io
import warnings
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from ...errors import MOST_NAMED, KincheckError, brief, remedy, shortened
from ...extras import library
from .document import fault, read_bytes, shown
from .foreign import ARCHIVE, EXCEL, MOST_MEMBERS, binary, members, recognised

WORKBOOKS = (".xlsx", ".xlsm")
Cell: TypeAlias = str | float
"""A cell of a spreadsheet: a number or a text, empty for an empty cell."""
Row: TypeAlias = tuple[str, Sequence[Cell]]
"""Place of a row for messages, and its cells."""

LARGEST_FILE = 64_000_000
# A sheet is compressed about ten times; a far larger ratio is an attack on the memory.
MOST_BYTES = 128_000_000
# Some microseconds for each: a cell has four tags. Styles take ten times as long.
MOST_TAGS, MOST_TAGS_ELSEWHERE = 4_000_000, 400_000
CHUNK = 1_000_000
# A sheet can have 16384 columns and a million rows; a table of points or curves has far fewer.
MOST_COLUMNS, MOST_COLUMNS_OF_TEXT = 1000, 100_000
MOST_ROWS = 1_048_576
MOST_CELLS = 1_000_000
"""Of a sheet, those of blank rows and columns among them."""
LESS = "take out what is not the table, or save it as CSV"


@dataclass(frozen=True)
class Sheet:
    """The rows of a sheet with any text or number.

    Attributes:
        name: name of the sheet, for messages and to choose it.
    """

    name: str
    rows: Sequence[Row]


def read_sheets(file: Path, wanted: str | None, most_rows: int) -> list[Sheet]:
    """Return the sheets of a workbook with filled cells, or the wanted one alone.

    Args:
        wanted: name of a sheet.
        most_rows: largest number of rows of a sheet.

    Raises:
        CaseError: openpyxl is missing, the file is no workbook, has no such sheet, or is too large.
    """
    try:
        openpyxl = library("a spreadsheet", "openpyxl", "xlsx")
    except KincheckError as error:
        raise fault(file, "", f"{error}; or save the sheet as CSV") from None
    data = read_bytes(file, LARGEST_FILE, "take out what is not the table")
    _require_workbook(file, data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about styles and extensions; values need neither
            written = openpyxl.load_workbook(io.BytesIO(data), read_only=True, keep_links=False)
            names = [sheet.title for sheet in written.worksheets]
            if wanted is not None and wanted not in names:
                raise fault(
                    file,
                    "sheet",
                    f"found no sheet {shown(wanted)}, expected one of the file;"
                    f" {remedy(wanted, names)}",
                )
            computed: Any = None
            sheets: list[Sheet] = []
            for name in names if wanted is None else [wanted]:
                rows, formulas = _rows(file, written[name], most_rows)
                if formulas:
                    computed = computed or openpyxl.load_workbook(
                        io.BytesIO(data), read_only=True, data_only=True, keep_links=False
                    )
                    values, _ = _rows(file, computed[name], most_rows)
                    rows = _computed(rows, values)
                if rows:
                    sheets.append(Sheet(name, rows))
            return sheets
    except KincheckError:
        raise
    except Exception as error:  # zip, XML and openpyxl raise many errors for a damaged file
        what = brief(f"{type(error).__name__}: {error}".strip().replace("\n", " "))
        raise fault(
            file, "", f"is no readable workbook ({what}); save it anew as .xlsx, or as CSV"
        ) from None


def require_narrow(file: Path, lines: Iterable[tuple[str, str]], delimiter: str) -> None:
    """Refuse a line of a text table with more columns than people write.

    Args:
        lines: each with its place.

    Raises:
        CaseError: there is one.
    """
    for where, line in lines:
        if line.count(delimiter) >= MOST_COLUMNS_OF_TEXT:
            problem = f"found more than {MOST_COLUMNS_OF_TEXT} columns, expected a table"
            raise fault(file, where, f"{problem}; take out what is not the table")


def one_sheet(file: Path, sheets: Sequence[Sheet], option: str) -> Sheet:
    """Return the only sheet.

    Args:
        option: the option to choose a sheet, for the message.

    Raises:
        CaseError: there are several sheets, or none.
    """
    if not sheets:
        raise fault(file, "", "found no sheet with cells, expected a table; save the workbook anew")
    if len(sheets) > 1:
        names = shortened([brief(shown(sheet.name)) for sheet in sheets], MOST_NAMED)
        raise fault(
            file, "", f"found tables on the sheets {names}, expected one; choose it by {option}"
        )
    return sheets[0]


def _require_workbook(file: Path, data: bytes) -> None:
    """Refuse a file unless it is a zip archive of reasonable unpacked size."""
    what, advice = recognised(data)
    if not data:
        raise fault(file, "", "is empty, expected a workbook (.xlsx); save the workbook anew")
    if what not in (EXCEL, ARCHIVE):
        what = what or ("another binary file" if binary(data) else "a text")
        advice = advice or "save it as .xlsx, or name a table of text .csv"
        raise fault(file, "", f"found {what}, expected a workbook (.xlsx); {advice}")
    try:
        problem = _too_much(data)
    except _DAMAGED as error:
        raise fault(
            file, "", f"is a damaged workbook ({error}); save it anew as .xlsx, or as CSV"
        ) from None
    if problem:
        raise fault(file, "", f"{problem}; {LESS}")


_DAMAGED = (
    *(zipfile.BadZipFile, zlib.error, ValueError, NotImplementedError, OSError, EOFError),
    RuntimeError,  # a password
)


def _too_much(data: bytes) -> str:
    """Return why an archive would take too long to read; empty if not."""
    if (count := members(data)) > MOST_MEMBERS:
        return f"has {count} parts, expected {MOST_MEMBERS} at most"
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        size = sum(each.file_size for each in archive.infolist())
        if size > MOST_BYTES:
            return f"unpacks to {size} bytes, expected {MOST_BYTES} at most"
        tags = 0
        for each in archive.infolist():
            elsewhere = 0
            with archive.open(each) as part:
                for chunk in iter(lambda: part.read(CHUNK), b""):
                    elsewhere += chunk.count(b"<")
            if each.filename.startswith(("xl/worksheets/", "xl/sharedStrings")):
                tags, elsewhere = tags + elsewhere, 0
            for found, most in ((tags, MOST_TAGS), (elsewhere, MOST_TAGS_ELSEWHERE)):
                if found > most:
                    return f"has {found} tags in {each.filename}, expected {most} at most"
    return ""


def _rows(file: Path, sheet: Any, most: int) -> tuple[list[Row], bool]:
    """Return the rows with filled cells, and whether any cell is a formula."""
    rows: list[Row] = []
    formulas = False
    read = 0
    sheet.reset_dimensions()  # the dimensions in a workbook are often wrong
    for k, cells in enumerate(sheet.iter_rows(), 1):
        read += len(cells)
        filled = any(cell.value is not None for cell in cells)
        wide = filled and any(cell.value is not None for cell in cells[MOST_COLUMNS:])
        for found, limit, what in (
            (wide * (MOST_COLUMNS + 1), MOST_COLUMNS, "columns"),
            (len(rows) + filled, most, "rows"),
            (k, MOST_ROWS, "rows, blank ones among them"),
            (read, MOST_CELLS, "cells, blank ones among them"),
        ):
            if found > limit:
                problem = f"found more than {limit} {what}, expected a table; {LESS}"
                raise fault(file, f"sheet {shown(sheet.title)}", problem)
        if not filled:
            continue
        formulas = formulas or any(cell.data_type == "f" for cell in cells)
        rows.append((f"row {k}", _trimmed([_cell(cell.value) for cell in cells])))
    return rows, formulas


def _computed(rows: Sequence[Row], values: Sequence[Row]) -> list[Row]:
    """Return rows with the values of formulas; a formula without a value stays a formula."""
    known = dict(values)
    return [
        (
            where,
            [
                found if isinstance(cell, str) and cell.startswith("=") and found != "" else cell
                for cell, found in zip(
                    cells, _filled(known.get(where, ()), len(cells)), strict=True
                )
            ],
        )
        for where, cells in rows
    ]


def _filled(cells: Sequence[Cell], count: int) -> Iterator[Cell]:
    yield from cells[:count]
    yield from [""] * (count - len(cells))


def _trimmed(cells: list[Cell]) -> list[Cell]:
    """Return cells without empty cells at the end."""
    while cells and cells[-1] == "":
        cells.pop()
    return cells


def _cell(value: Any) -> Cell:
    """Return a number or a text. Dates and truth values become texts: they are no numbers."""
    if value is None:
        return ""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return str(getattr(value, "text", value)).strip()
