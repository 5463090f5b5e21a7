"""Forms of tables of hardpoints without a head `name,x,y,z`: a coordinate in each row, or rows of a
name and three numbers. They become rows below such a head.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...io.column_units import split_head
from ...io.document import decimal, fault, shown
from ...io.workbook import Cell, Row
from ...units import LENGTHS
from .roles import compact
from .table import length_name, twice
from .templates import ROLES

FEWEST = 3
"""Fewest rows to recognise a form."""
_AXIS = re.compile(
    r"(?P<name>.*[^\s_.\-\[(:])(?:[\s_.\-\[(:]+(?P<axis>[xyzXYZ])|(?<=[a-z0-9])(?P<bare>[XYZ]))[\])]?"
)
_AXIS_FIRST = re.compile(r"(?P<axis>[xyzXYZ])[\s_.\-:]+(?P<name>.+)")


def is_number(value: object) -> bool:
    """Return whether a value is a number, or a text of one with either decimal sign."""
    if not isinstance(value, str):
        return isinstance(value, int | float) and not isinstance(value, bool)
    try:
        decimal(value.replace(",", ".").replace("\u2212", "-"))
    except ValueError:
        return False
    return True


def axis_of(name: str) -> tuple[str, str] | None:
    """Return the name of a point and the coordinate in a name such as `lca_front_x`, `UCA_FL.x` or
    `x_lca_front`; None for another name.
    """
    name = name.strip()
    found = _AXIS.fullmatch(name) or _AXIS_FIRST.fullmatch(name)
    if found is None:
        return None
    parts = found.groupdict()
    return parts["name"].strip(), (parts["axis"] or parts["bare"]).lower()


def with_head(file: Path, rows: Sequence[Row]) -> tuple[Sequence[Row], int] | None:
    """Return rows with the head `name,x,y,z`, and its index; None for rows of another form. Rows
    without a point stand above the head.

    Raises:
        CaseError: a row has several numbers for a coordinate, or a point lacks one.
    """
    return _coordinates(file, rows) or _plain(file, rows)


def _coordinates(file: Path, rows: Sequence[Row]) -> tuple[Sequence[Row], int] | None:
    """Return the points of rows with one coordinate each."""
    found = [(row, _coordinate(row[1])) for row in rows]
    points: dict[str, dict[str, tuple[str, Cell]]] = {}
    units: dict[str, str] = {}
    others: list[Row] = []
    for (where, cells), coordinate in found:
        if coordinate is None:
            others.append((where, cells))
            continue
        name, axis, values, unit = coordinate
        if len(values) > 1:
            raise fault(
                file,
                where,
                f"found {len(values)} numbers for {name} {axis}, expected one; keep the numbers of"
                " one design (a decimal comma needs semicolons between the fields)",
            )
        place = points.setdefault(name, {})
        if axis in place:
            raise twice(file, where, f"{name} {axis}", place[axis][0])
        place[axis] = (where, values[0])
        if unit:
            units.setdefault(length_name(unit), where)
    if len(found) - len(others) < FEWEST or not any(len(place) == 3 for place in points.values()):
        return None
    unit = one_unit(file, units) or _unit_above(others)
    body: list[Row] = []
    for name, place in points.items():
        if len(place) == 3:
            body.append((place["x"][0], [name, *(place[axis][1] for axis in "xyz")]))
        elif compact(name) in ROLES:
            missing = " and ".join(axis for axis in "xyz" if axis not in place)
            where, _ = next(iter(place.values()))
            raise fault(file, where, f"found {name} without {missing}, expected all three; add it")
        else:
            others += [(where, [f"{name} {axis}"]) for axis, (where, _) in place.items()]
    head = ["name", *(f"{axis} [{unit}]" if unit else axis for axis in "xyz")]
    return [*others, ("the head", head), *body], len(others)


def one_unit(file: Path, units: Mapping[str, str]) -> str:
    """Return the only unit; empty without any.

    Args:
        units: places of coordinates by their unit.

    Raises:
        CaseError: there are several units.
    """
    for first, (other, where) in zip(units, [*units.items()][1:], strict=False):
        raise fault(
            file,
            where,
            f"found {shown(other)}, and {shown(first)} above, expected one unit; write all"
            " coordinates in one",
        )
    return next(iter(units), "")


def _coordinate(cells: Sequence[Cell]) -> tuple[str, str, list[Cell], str] | None:
    """Return name, axis, numbers and unit of a row of a coordinate; None for another row."""
    filled = [cell for cell in cells if cell != ""]
    if len(filled) < 2 or not isinstance(filled[0], str) or is_number(filled[0]):
        return None
    name, rest = filled[0], filled[1:]
    if isinstance(rest[0], str) and rest[0].lower() in ("x", "y", "z"):
        split, rest = (name, rest[0].lower()), rest[1:]
    else:
        split = axis_of(split_head(name)[0])
    values = [cell for cell in rest if is_number(cell)]
    if split is None or not values or not is_number(rest[0]):
        return None
    after = rest[len(values)] if len(rest) > len(values) else split_head(name)[1]
    unit = after.strip("[]() ") if isinstance(after, str) else ""
    return (*split, values, unit if length_name(unit) in LENGTHS else "")


def _unit_above(rows: Sequence[Row]) -> str:
    """Return the unit in a head such as `parameter, value [mm]`; empty without one."""
    for _, cells in rows:
        for cell in cells:
            if isinstance(cell, str) and length_name(unit := split_head(cell)[1]) in LENGTHS:
                return unit
    return ""


def _plain(file: Path, rows: Sequence[Row]) -> tuple[Sequence[Row], int] | None:
    """Return rows of a name and three numbers, or of three numbers and a name."""
    body: list[Row] = []
    others: list[Row] = []
    for where, cells in rows:
        filled = [cell for cell in cells if cell != ""]
        numbers = [k for k, cell in enumerate(filled) if is_number(cell)]
        if not numbers:
            others.append((where, cells))
        elif len(filled) == 4 and numbers in ([1, 2, 3], [0, 1, 2]):
            first = numbers[0]
            body.append((where, [filled[3 if first == 0 else 0], *filled[first : first + 3]]))
        elif len(filled) == len(numbers) == 3:
            raise fault(
                file,
                where,
                f"found {shown(', '.join(map(str, filled)))}, three numbers without a name,"
                " expected the name of the point too; write name,x,y,z in each row",
            )
        else:
            return None
    if len(body) < FEWEST:
        return None
    return [*others, ("the head", ["name", "x", "y", "z"]), *body], len(others)
