"""Hardpoints on a sheet of a spreadsheet file, see `rows`."""

from __future__ import annotations

from pathlib import Path

from ...io.document import fault, shown
from ...io.workbook import one_sheet, read_sheets
from .head import HEAD
from .rows import read_rows, table_in
from .table import HardpointTable

# Largest number of points, and as many other rows.
MOST_ROWS = 20_000


def read_spreadsheet(file: Path, wanted: str | None) -> HardpointTable:
    """Return the points by name.

    Args:
        wanted: name of the sheet; None for the only sheet with a table.

    Raises:
        CaseError: the file is no readable workbook, no sheet or several sheets have a head, or a
            row is at odds with the head.
    """
    sheets = read_sheets(file, wanted, MOST_ROWS)
    tables = [sheet for sheet in sheets if table_in(file, sheet.rows) is not None]
    if sheets and not tables:
        names = ", ".join(shown(sheet.name) for sheet in sheets)
        raise fault(
            file,
            "",
            f"found no head on the sheets {names}, expected {','.join(HEAD)}; write it above the"
            " points",
        )
    sheet = one_sheet(file, tables, "--sheet NAME")
    return read_rows(file, f"Sheet {shown(sheet.name)}:", sheet.rows, {})
