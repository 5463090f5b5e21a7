"""The head of a table of hardpoints, `name,x,y,z`: its place among rows of cells, its columns and
its unit.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from ...io.document import fault, shown
from ...io.workbook import Cell, Row
from ...units import LENGTHS
from .forms import is_number
from .table import length_name

HEAD = ("name", "x", "y", "z")
_NAMES = ("name", "point", "points", "hardpoint", "hardpoints", "hardpoint_name", "point_name")
_COLUMN = re.compile(
    r"(?:(?:loc|coord|coordinate|pos|position)[_ ])?([xyz])"
    r"(?:[-_ ]?(?:value|coord|coordinate|pos|position|koordinate))?"
    r"(?:\s*[\[(_/,]\s*([a-z]+)\s*[\])]?|\s+(?:in\s+)?([a-z]+))?"
)


@dataclass(frozen=True)
class Head:
    """The head of a table.

    Attributes:
        columns: indices of name, x, y and z among the fields.
        names: names of all fields, as in the file.
        unit: unit of the coordinates, if the head gives it.
    """

    columns: Sequence[int]
    names: Sequence[str]
    unit: str | None

    @property
    def others(self) -> list[str]:
        """The names of the further columns."""
        return [name for k, name in enumerate(self.names) if name and k not in self.columns]


def upright(file: Path, rows: Sequence[Row]) -> tuple[Sequence[Row], int] | None:
    """Return the rows, or the columns if these have the head, and the index of the head."""
    for each in (rows, turned(rows)):
        if (place := head_place(file, each)) is not None:
            return each, place
    return None


def head_place(file: Path, rows: Sequence[Row]) -> int | None:
    """Return the index of the head among rows; None without a head above the first point.

    Raises:
        CaseError: two columns of one name, or coordinates in several units.
    """
    for k, (where, cells) in enumerate(rows):
        if as_head(file, where, cells):
            return k
        if sum(map(is_number, cells)) >= 3:  # a point
            return None
    return None


def turned(rows: Sequence[Row]) -> list[Row]:
    """Return the columns of rows as rows."""
    columns = zip_longest(*(cells for _, cells in rows), fillvalue="")
    return [
        (f"column {k}", cells)
        for k, cells in enumerate(columns, 1)
        if any(cell != "" for cell in cells)
    ]


def as_head(file: Path, where: str, cells: Sequence[Cell]) -> Head | None:
    """Return the head of these fields; None if they are not a head.

    Raises:
        CaseError: two columns of one name, or coordinates in several units.
    """
    columns: dict[str, int] = {}
    units: set[str | None] = set()
    texts = [cell if isinstance(cell, str) else "" for cell in cells]
    if sum(text.lower() == "x" for text in texts) > 2:  # a column of the coordinates' names
        return None
    for k, text in enumerate(texts):
        column, unit = _column(text.lower())
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
    if not {"x", "y", "z"} <= columns.keys():
        return None
    if "name" not in columns:  # the only column before the coordinates, under any name, or beside
        before = [*range(min(columns.values()))]
        if len(before) != 1:
            before = [k for k in range(4) if k not in columns.values()]
            if before[0] != 3 or any(texts[3:]):  # below no name, at the end
                return None
        columns["name"] = before[0]
    if len(units) > 1:
        raise fault(
            file,
            where,
            f"found {shown(','.join(texts))}, expected one unit for x, y and z; write it with each"
            " or with none",
        )
    return Head([columns[each] for each in HEAD], texts, units.pop())


def _column(text: str) -> tuple[str, str | None]:
    """Return the column and the unit of a name in the head; empty for a further column."""
    if text in _NAMES or text.replace(" ", "_") in _NAMES:
        return "name", None
    if (found := _COLUMN.fullmatch(text)) is None:
        return "", None
    axis, unit, bare = found.groups()
    if bare is not None and length_name(bare) not in LENGTHS:
        return "", None
    return axis, unit or bare


def written(cells: Sequence[Cell]) -> str:
    """Return cells as a text, separated by commas."""
    return ",".join(cell if isinstance(cell, str) else f"{cell:.15g}" for cell in cells)
