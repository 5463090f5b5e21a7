"""Sheets of spreadsheet files (.xlsx, .xlsm), read by openpyxl: values as the spreadsheet program
computed them, not formulas.
"""

from __future__ import annotations

import io
import warnings
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from ...errors import MOST_NAMED, KincheckError, brief, remedy, shortened
from ...extras import library
from .document import fault, read_bytes, shown
from .foreign import ARCHIVE, EXCEL, binary, recognised

WORKBOOKS = (".xlsx", ".xlsm")
Cell: TypeAlias = str | float
"""A text, empty for an empty cell, or a number of a spreadsheet."""
Row: TypeAlias = tuple[str, Sequence[Cell]]
"""Place of a row for messages, and its cells."""

LARGEST_FILE = 64_000_000
# A sheet is compressed about ten times; far more is made to fill memory.
MOST_BYTES = 512_000_000
# A sheet can have 16384 columns; a table of so many is none of points or of curves.
MOST_COLUMNS = 1000


@dataclass(frozen=True)
class Sheet:
    """The rows of a sheet that are not blank.

    Attributes:
        name: its name, for messages and to choose it.
    """

    name: str
    rows: Sequence[Row]


def read_sheets(file: Path, wanted: str | None, most_rows: int) -> list[Sheet]:
    """Return the sheets of a workbook that have cells, or the wanted one alone.

    Args:
        wanted: name of a sheet.
        most_rows: rows of a sheet at most.

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
            warnings.simplefilter("ignore")  # of styles and extensions that no value needs
            written = openpyxl.load_workbook(io.BytesIO(data), read_only=True)
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
                        io.BytesIO(data), read_only=True, data_only=True
                    )
                    values, _ = _rows(file, computed[name], most_rows)
                    rows = _computed(rows, values)
                if rows:
                    sheets.append(Sheet(name, rows))
            return sheets
    except KincheckError:
        raise
    except Exception as error:  # whatever a damaged file makes of zip, XML and openpyxl
        what = brief(f"{type(error).__name__}: {error}".strip().replace("\n", " "))
        raise fault(
            file, "", f"is no readable workbook ({what}); save it anew as .xlsx, or as CSV"
        ) from None


def one_sheet(file: Path, sheets: Sequence[Sheet], option: str) -> Sheet:
    """Return the only one of some sheets.

    Args:
        option: what chooses a sheet, for the message.

    Raises:
        CaseError: there are several, or none.
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
    """Refuse a file that is no zip archive, or one that unpacks to an unreasonable size."""
    what, advice = recognised(data)
    if not data:
        raise fault(file, "", "is empty, expected a workbook (.xlsx); save the workbook anew")
    if what not in (EXCEL, ARCHIVE):
        what = what or ("another binary file" if binary(data) else "a text")
        advice = advice or "save it as .xlsx, or name a table of text .csv"
        raise fault(file, "", f"found {what}, expected a workbook (.xlsx); {advice}")
    try:
        size = sum(each.file_size for each in zipfile.ZipFile(io.BytesIO(data)).infolist())
    except (zipfile.BadZipFile, ValueError, NotImplementedError, OSError) as error:
        raise fault(
            file, "", f"is a damaged workbook ({error}); save it anew as .xlsx, or as CSV"
        ) from None
    if size > MOST_BYTES:
        raise fault(
            file,
            "",
            f"unpacks to {size} bytes, expected {MOST_BYTES} at most; take out what is not the"
            " table",
        )


def _rows(file: Path, sheet: Any, most: int) -> tuple[list[Row], bool]:
    """Return the rows that are not blank, and whether any cell is a formula."""
    rows: list[Row] = []
    formulas = False
    sheet.reset_dimensions()  # programs that write workbooks often state wrong ones
    for k, cells in enumerate(sheet.iter_rows(), 1):
        if all(cell.value is None for cell in cells):
            continue
        wide = any(cell.value is not None for cell in cells[MOST_COLUMNS:])
        if wide or len(rows) == most:
            many = f"{MOST_COLUMNS} columns" if wide else f"{most} rows"
            raise fault(
                file,
                f"sheet {shown(sheet.title)}",
                f"found more than {many}, expected a table; take out what is not the table",
            )
        formulas = formulas or any(cell.data_type == "f" for cell in cells)
        rows.append((f"row {k}", _trimmed([_cell(cell.value) for cell in cells])))
    return rows, formulas


def _computed(rows: Sequence[Row], values: Sequence[Row]) -> list[Row]:
    """Return rows with the values of formulas; a formula without a value stays as it is."""
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
    """Return cells without the empty ones at the end."""
    while cells and cells[-1] == "":
        cells.pop()
    return cells


def _cell(value: Any) -> Cell:
    """Return a number or a text. Dates and truth values are texts, so that none counts as a
    number.
    """
    if value is None:
        return ""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return str(getattr(value, "text", value)).strip()
