"""Hardpoints in a text table: a head `name,x,y,z`, then a row a point; commas, semicolons or tabs
between.

The head may say the unit, `name,x [mm],y [mm],z [mm]`; so may a comment, `# units: mm`, and another
one says the axes, `# axes: rearward,right,up`.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

from ...io.document import fault, shown
from .table import Hardpoint, HardpointTable, number

HEAD = ("name", "x", "y", "z")
_COLUMN = re.compile(r"([a-z]+)\s*(?:[\[(_]\s*([a-z]+)\s*[\])]?)?")
_REMARK = re.compile(r"#\s*(unit|axes)s?\s*[:=]\s*(.+)", re.IGNORECASE)


def read_plain(file: Path, text: str) -> HardpointTable:
    """The points by name.

    Raises:
        CaseError: no such head, or a row that does not match it.
    """
    said: dict[str, str] = {}
    rows: list[tuple[str, str]] = []
    for k, line in enumerate(text.splitlines(), 1):
        if found := _REMARK.match(line.strip()):
            said[found.group(1).lower()] = found.group(2).strip()
        elif line.strip() and not line.lstrip().startswith("#"):
            rows.append((f"line {k}", line))
    if not rows:
        raise fault(
            file, "", f"is empty, expected a table of hardpoints; begin it with {','.join(HEAD)}"
        )
    delimiter = max(",;\t", key=rows[0][1].count)
    where, head = rows[0]
    unit = _head(file, where, _cells(file, where, head, delimiter))
    if unit and said.get("unit", unit) != unit:
        raise fault(
            file,
            where,
            f"found coordinates in {unit}, and {said['unit']} in a comment, expected one unit;"
            " correct either",
        )
    points: dict[str, Hardpoint] = {}
    for where, line in rows[1:]:
        cells = _cells(file, where, line, delimiter)
        if len(cells) != len(HEAD):
            raise fault(
                file,
                where,
                f"found {len(cells)} fields, expected {len(HEAD)}: {', '.join(HEAD)}; complete"
                " the row",
            )
        name, *numbers = cells
        if not name or not name.isprintable():
            raise fault(
                file,
                where,
                f"found the name {name!r}, expected printable characters; name the point",
            )
        if name in points:
            raise fault(
                file,
                where,
                f"{name}: given before, in {points[name].where}, expected once; remove one of them",
            )
        x, y, z = (
            number(file, f"{where}: {name}: {axis}", cell)
            for axis, cell in zip("xyz", numbers, strict=True)
        )
        points[name] = Hardpoint((x, y, z), where)
    if not points:
        raise fault(
            file, "", "found a head and no row, expected hardpoints; the file was cut: save it anew"
        )
    return HardpointTable(file, "CSV", points, unit or said.get("unit"), said.get("axes"))


def _cells(file: Path, where: str, line: str, delimiter: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
    except csv.Error as error:
        raise fault(file, where, f"not valid CSV: {error}; correct the line") from None


def _head(file: Path, where: str, cells: list[str]) -> str | None:
    """The unit that the head gives, if it does."""
    found = [_COLUMN.fullmatch(cell.lower()) for cell in cells]
    names = tuple(each.group(1) if each else "" for each in found)
    if names != HEAD:
        raise fault(
            file,
            where,
            f"found {shown(','.join(cells))}, expected the head {','.join(HEAD)}; write it above"
            " the points",
        )
    units = {each.group(2) for each in found[1:] if each}
    if len(units) > 1:
        raise fault(
            file,
            where,
            f"found {shown(','.join(cells))}, expected one unit for x, y and z; write it with each"
            " or with none",
        )
    return units.pop()
