"""Hardpoints in a text table: a head `name,x,y,z`, then a row a point; commas, semicolons or tabs
between.

The head may say the unit, `name,x [mm],y [mm],z [mm]`, and so may a row of units below it; so may a
comment, `# units: mm`; others say the axes, `# axes: rearward,right,up`, and the template, `#
template: mcpherson`. Spreadsheets
have dialects: a line `sep=;`, titles above the head, further columns, separators at the end of a
line, a decimal comma.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ....errors import brief
from ...io.document import decimal, fault, shown
from ...units import LENGTHS
from .decimal_sign import find_decimal_sign
from .table import Hardpoint, HardpointTable, length_name, number

HEAD = ("name", "x", "y", "z")
DELIMITERS = ";\t,"
Row = tuple[str, str]
"""Place and text of a line."""

_ALSO = {"point": "name", "hardpoint": "name", "hardpoint_name": "name"} | {
    name: axis for axis in "xyz" for name in (f"loc_{axis}", f"{axis}_value")
}
_COLUMN = re.compile(r"([a-z]+)\s*(?:[\[(_]\s*([a-z]+)\s*[\])]?)?")
_UNIT = re.compile(r"[\[(]?\s*([a-z]+)\s*[\])]?", re.IGNORECASE)
_REMARK = re.compile(r"#\s*(unit|axes|template)s?\s*[:=]\s*([^;\t]+)", re.IGNORECASE)
_SEPARATOR = re.compile(r"\"?sep=(.)\"?", re.IGNORECASE)


@dataclass(frozen=True)
class _Head:
    """The head of a table.

    Attributes:
        columns: places of name, x, y and z among the fields.
        names: names of all fields, as in the file.
        unit: unit of the coordinates, if the head says it.
    """

    columns: Sequence[int]
    names: Sequence[str]
    unit: str | None

    @property
    def others(self) -> list[str]:
        """Names of the further columns."""
        return [name for k, name in enumerate(self.names) if name and k not in self.columns]


def read_plain(file: Path, text: str) -> HardpointTable:
    """Return the points by name.

    Raises:
        CaseError: no such head, or a row that does not match it.
    """
    said: dict[str, str] = {}
    rows: list[Row] = []
    delimiters = DELIMITERS
    for k, line in enumerate(text.splitlines(), 1):
        if found := _REMARK.match(line.strip()):
            said[found.group(1).lower()] = found.group(2).strip()
        elif not rows and (found := _SEPARATOR.fullmatch(line.strip(" \r"))):
            delimiters = found.group(1)
        elif line.strip(f" \r{DELIMITERS}") and not line.lstrip().startswith("#"):
            rows.append((f"line {k}", line))
    if not rows:
        raise fault(
            file, "", f"is empty, expected a table of hardpoints; begin it with {','.join(HEAD)}"
        )
    titles, head, delimiter = _head(file, rows, delimiters)
    body = [
        (where, _complete(file, where, _cells(file, where, line, delimiter), head, delimiter))
        for where, line in rows[len(titles) + 1 :]
    ]
    unit = head.unit
    if unit is None and body and (below := _units(body[0][1])):
        unit, body = below, body[1:]
    if unit and said.get("unit", unit) != unit:
        raise fault(
            file,
            rows[len(titles)][0],
            f"found coordinates in {unit}, and {said['unit']} in a comment, expected one unit;"
            " correct either",
        )
    points = _points(file, body, "," if delimiter == "," else ".,")
    if not points:
        raise fault(
            file, "", "found a head and no row, expected hardpoints; the file was cut: save it anew"
        )
    left_out = [f"{where} ({brief(line.strip())})" for where, line in titles]
    left_out += [f"column {brief(name)}" for name in head.others]
    return HardpointTable(
        file,
        "CSV",
        points,
        unit or said.get("unit"),
        said.get("axes"),
        said.get("template"),
        left_out,
    )


def _points(
    file: Path, body: Sequence[tuple[str, Sequence[str]]], grouping: str
) -> dict[str, Hardpoint]:
    places: list[tuple[str, list[Row]]] = []
    points: dict[str, Hardpoint] = {}
    lines: dict[str, str] = {}
    for where, (name, *cells) in body:
        if not name or not name.isprintable():
            raise fault(
                file,
                where,
                f"found the name {name!r}, expected printable characters; name the point",
            )
        if name in lines:
            raise fault(
                file,
                where,
                f"{name}: given before, in {lines[name]}, expected once; remove one of them",
            )
        lines[name] = where
        places.append(
            (
                name,
                [
                    (f"{where}: {name}: {axis}", cell)
                    for axis, cell in zip("xyz", cells, strict=True)
                ],
            )
        )
    sign = find_decimal_sign(file, [cell for _, cells in places for cell in cells], grouping)
    for name, cells in places:
        x, y, z = (number(file, where, cell, sign) for where, cell in cells)
        points[name] = Hardpoint((x, y, z), lines[name])
    return points


def _cells(file: Path, where: str, line: str, delimiter: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
    except csv.Error as error:
        raise fault(file, where, f"not valid CSV: {error}; correct the line") from None


def _head(file: Path, rows: Sequence[Row], delimiters: str) -> tuple[Sequence[Row], _Head, str]:
    """Return the lines above the head, the head, and the sign between fields."""
    for k, (where, line) in enumerate(rows):
        for delimiter in sorted(delimiters, key=line.count, reverse=True):
            cells = _cells(file, where, line, delimiter)
            if head := _as_head(file, where, cells):
                return rows[:k], head, delimiter
            if sum(map(_is_number, cells)) >= 3:  # a point
                break
        else:
            continue
        break
    where, line = rows[0]
    raise fault(
        file,
        where,
        f"found {shown(line.strip())}, expected the head {','.join(HEAD)}; write it above the"
        " points",
    )


def _is_number(cell: str) -> bool:
    try:
        decimal(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _as_head(file: Path, where: str, cells: Sequence[str]) -> _Head | None:
    """Return the head of these fields; None if they are none.

    Raises:
        CaseError: two columns of one name, or coordinates in several units.
    """
    columns: dict[str, int] = {}
    units: set[str | None] = set()
    for k, cell in enumerate(cells):
        found = _COLUMN.fullmatch(cell.lower())
        plain = _ALSO.get(cell.lower())
        column, unit = (plain, None) if plain or not found else found.groups()
        if column not in HEAD:
            continue
        if column in columns:
            raise fault(
                file,
                where,
                f"found the column {shown(column)} twice, expected it once; take out the one that"
                " is no coordinate",
            )
        columns[column] = k
        units |= {unit} if column != "name" else set()
    if len(columns) < len(HEAD):
        return None
    if len(units) > 1:
        raise fault(
            file,
            where,
            f"found {shown(','.join(cells))}, expected one unit for x, y and z; write it with each"
            " or with none",
        )
    return _Head([columns[each] for each in HEAD], cells, units.pop())


def _units(cells: Sequence[str]) -> str | None:
    """Return the unit in a row of units below the head; None if the row is of a point."""
    found = [_UNIT.fullmatch(cell) for cell in cells[1:]]
    names = {length_name(each.group(1)) if each else "" for each in found}
    return names.pop() if len(names) == 1 and names <= LENGTHS.keys() else None


def _complete(
    file: Path, where: str, cells: Sequence[str], head: _Head, delimiter: str
) -> list[str]:
    """Return name, x, y and z of a row.

    A decimal comma between commas makes a field of its own. It cannot be told from a value of a
    further column, if the row may be shorter or longer than the head.
    """
    filled = len(cells)
    while filled and not cells[filled - 1]:
        filled -= 1
    headed = {k for k, name in enumerate(head.names) if name}
    surplus = any(cell and k not in headed for k, cell in enumerate(cells))
    exact = delimiter != "," or not head.others or len(cells) == len(head.names)
    if surplus or not exact or max(head.columns) >= filled:
        expected = [name for name in head.names if name]
        comma = "; a decimal comma needs semicolons between the fields" if delimiter == "," else ""
        raise fault(
            file,
            where,
            f"found {filled} fields, expected {len(expected)}: {', '.join(map(brief, expected))};"
            f" complete the row{comma}",
        )
    return [cells[k] for k in head.columns]
