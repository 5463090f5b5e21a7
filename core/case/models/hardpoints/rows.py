"""Hardpoints in rows of cells, from a text or a spreadsheet: a head `name,x,y,z`, then a row for
each point; or columns instead of rows.

The reader leaves out and lists titles above the head, further columns, a row of units, and rows
without a point. Rows above the head give facts: `units: mm`, `axes: rearward,right,up`, `template:
mcpherson`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from ....errors import brief
from ...io.decimal_sign import find_decimal_sign
from ...io.document import fault, shown
from ...io.workbook import Cell, Row, one_sheet, read_sheets
from ...units import LENGTHS
from .forms import with_head
from .head import HEAD, Head, as_head, turned, upright, written
from .roles import compact
from .table import Hardpoint, HardpointTable, length_name, number, require_name, twice
from .templates import ROLES

_UNIT = re.compile(r"[\[(]?\s*([a-z]+)\s*[\])]?", re.IGNORECASE)
# Largest number of points on a sheet, and as many other rows.
MOST_ROWS = 20_000
_REMARK = re.compile(r"(#?)\s*(unit|axes|template)s?\s*[:=,]+\s*(.+)", re.IGNORECASE)


def read_rows(
    file: Path,
    tool: str,
    rows: Sequence[Row],
    said: Mapping[str, str],
    delimiter: str = "",
) -> HardpointTable:
    """Return the points by name.

    Args:
        tool: program of the format.
        rows: rows with filled cells.
        said: facts from comments: unit, axes, template.
        delimiter: the separator of the fields of a text.

    Raises:
        CaseError: no such head, or a row at odds with the head.
    """
    found = table_in(file, rows)
    if found is None:
        where, cells = rows[0]
        raise fault(
            file,
            where,
            f"found {shown(written(cells))}, expected the head {','.join(HEAD)}; write it above"
            " the points, or a name and x, y, z alone in each row",
        )
    rows, place = found
    head = as_head(file, *rows[place])
    assert head is not None  # `upright` has found the head there
    facts = dict(said)
    left_out: list[str] = []
    for where, cells in rows[:place]:
        if fact := remark(cells):
            facts.setdefault(*fact)
        else:
            left_out.append(f"{where} ({brief(written(cells).strip(','))})")
    body = list(rows[place + 1 :])
    unit = head.unit
    if unit is None and body and (below := _units(body[0][1], head)):
        unit, body = below, body[1:]
    if unit and length_name(facts.get("unit", unit)) != length_name(unit):
        raise fault(
            file,
            rows[place][0],
            f"found coordinates in {unit}, and {facts['unit']} in a comment, expected one unit;"
            " correct either",
        )
    notes = [row for row in body if _is_note(row[1], head)]
    for where, cells in body:
        if as_head(file, where, cells):
            raise fault(
                file,
                where,
                "found a second head, expected one table (of the front, or of the rear); keep one",
            )
    points = _points(
        file,
        [
            (where, _complete(file, where, cells, head, delimiter))
            for where, cells in body
            if not _is_note(cells, head)
        ],
        "," if delimiter == "," else ".,",
    )
    if not points:
        raise fault(
            file, "", "found a head and no row, expected hardpoints; the file was cut: save it anew"
        )
    left_out += [f"{where} ({brief(written(cells).strip(','))})" for where, cells in notes]
    left_out += [f"column {brief(name)}" for name in head.others]
    return HardpointTable(
        file,
        tool,
        points,
        unit or facts.get("unit"),
        facts.get("axes"),
        facts.get("template"),
        left_out,
    )


def table_in(file: Path, rows: Sequence[Row]) -> tuple[Sequence[Row], int] | None:
    """Return the rows with a head, and its index; None for rows of no known form.

    Raises:
        CaseError: two columns of one name, coordinates in several units, or a row at odds with its
            form.
    """
    if (found := upright(file, rows)) is not None:
        return found
    if any(as_head(file, *row) for row in rows):  # below a point
        return None
    return with_head(file, rows) or with_head(file, turned(rows))


def remark(cells: Sequence[Cell], *, comment: bool = False) -> tuple[str, str] | None:
    """Return the fact in a row, and its value; None without a fact.

    A spreadsheet divides a comment at its commas. A title `units: mm` is in one cell or two.

    Args:
        comment: whether the row must be a comment.
    """
    text = written([cell for cell in cells if cell != ""])
    found = _REMARK.fullmatch(text)
    if found is None or (comment and not found.group(1)):
        return None
    return found.group(2).lower(), found.group(3).strip()


def _points(
    file: Path, body: Sequence[tuple[str, Sequence[Cell]]], grouping: str
) -> dict[str, Hardpoint]:
    places: list[tuple[str, list[tuple[str, Cell]]]] = []
    points: dict[str, Hardpoint] = {}
    lines: dict[str, str] = {}
    for where, (cell, *cells) in body:
        name = written([cell])
        require_name(file, where, name)
        if name in lines:
            raise twice(file, where, name, lines[name])
        lines[name] = where
        places.append(
            (
                name,
                [
                    (f"{where}: {name}: {axis}", each)
                    for axis, each in zip("xyz", cells, strict=True)
                ],
            )
        )
    texts = [(where, cell) for _, cells in places for where, cell in cells if isinstance(cell, str)]
    sign = find_decimal_sign(file, texts, grouping)
    for name, cells in places:
        x, y, z = (number(file, where, cell, sign) for where, cell in cells)
        points[name] = Hardpoint((x, y, z), lines[name])
    return points


def _units(cells: Sequence[Cell], head: Head) -> str | None:
    """Return the unit in a row of units below the head; None if the row is of a point."""
    found = [
        _UNIT.fullmatch(cell) if isinstance(cell, str) else None
        for k, cell in enumerate(cells)
        if cell != "" and k != head.columns[0]
    ]
    names = {length_name(each.group(1)) if each else "" for each in found}
    return names.pop() if len(found) >= 3 and len(names) == 1 and names <= LENGTHS.keys() else None


def _is_note(cells: Sequence[Cell], head: Head) -> bool:
    """Return whether a row is a note: it lacks coordinates, and its name is no role's name in any
    template.
    """
    name, *coordinates = (cells[k] if k < len(cells) else "" for k in head.columns)
    lacking = any(cell == "" for cell in coordinates)
    return lacking and not (isinstance(name, str) and compact(name) in ROLES)


def _complete(
    file: Path, where: str, cells: Sequence[Cell], head: Head, delimiter: str
) -> list[Cell]:
    """Return name, x, y and z of a row.

    If commas separate the fields, a decimal comma splits a number into two fields. The second is
    indistinguishable from a value of a further column if rows may be shorter or longer than the
    head.
    """
    filled = len(cells)
    while filled and cells[filled - 1] == "":
        filled -= 1
    headed = {k for k, name in enumerate(head.names) if name} | set(head.columns)
    surplus = delimiter and any(cell != "" and k not in headed for k, cell in enumerate(cells))
    exact = delimiter != "," or not head.others or len(cells) == len(head.names)
    if surplus or not exact or max(head.columns) >= filled:
        expected = [name or HEAD[0] for k, name in enumerate(head.names) if k in headed]
        comma = "; a decimal comma needs semicolons between the fields" if delimiter == "," else ""
        raise fault(
            file,
            where,
            f"found {filled} fields, expected {len(expected)}: {', '.join(map(brief, expected))};"
            f" complete the row{comma}",
        )
    return [cells[k] for k in head.columns]


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
