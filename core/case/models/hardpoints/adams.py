"""Hardpoints of Adams/Car: the [HARDPOINT] blocks of its subsystem, template and assembly files
(TeimOrbit format).

A block has the columns {hardpoint_name symmetry x_value y_value z_value}. It holds the left point
of a 'left/right' pair. Rows below a line (VARIANTS) are of other designs; the reader takes the
nominal rows above it. Adams/Car has x rearward, y to the right and z up. The unit is in the block
[UNITS]; a block cut out of its file has none.
"""

from __future__ import annotations

import re
from pathlib import Path

from ....errors import MOST_NAMED, remedy, shortened
from ...io.document import fault, shown
from .table import Hardpoint, HardpointTable, number, require_name, twice

BLOCK = "[HARDPOINT]"
COLUMNS = ("hardpoint_name", "symmetry", "x_value", "y_value", "z_value")
LEFT, RIGHT = ("left/right", "left", "single"), "right"

_SECTION = re.compile(r"\[\s*([A-Za-z_]+)\s*\]")
_SUBSECTION = re.compile(r"\(\s*([A-Za-z_]+)\s*\)")
_FIELD = re.compile(r"'([^']*)'|(\S+)")


def read_adams(file: Path, text: str) -> HardpointTable:
    """Return the points of the left side and of the middle, by name.

    Raises:
        CaseError: there is no such block, or one of its rows is incomplete.
    """
    points: dict[str, Hardpoint] = {}
    unit: str | None = None
    section, sections, right = "", dict[str, int](), 0
    inner, variants = "", dict[str, list[str]]()
    columns = COLUMNS
    for k, line in enumerate(text.splitlines(), 1):
        row, where = line.strip(), f"line {k}"
        if not row or row.startswith(("$", "!")):
            continue
        if head := _SECTION.fullmatch(row):
            section, inner = head.group(1).upper(), ""
            sections.setdefault(section, 0)
            columns = COLUMNS
            continue
        if section == "HARDPOINT" and (found := _SUBSECTION.fullmatch(row)):
            inner = found.group(1).upper()
            continue
        sections[section] = sections.get(section, 0) + 1
        if section == "UNITS" and (found := re.fullmatch(r"LENGTH\s*=(.*)", row, re.IGNORECASE)):
            unit = found.group(1).strip().removeprefix("'").removesuffix("'").strip()
        elif section == "HARDPOINT" and row.startswith("{"):
            columns = tuple(row.strip("{}").split())
            if sorted(columns) != sorted(COLUMNS):
                raise fault(
                    file,
                    where,
                    f"found the columns {shown(row)}, expected {{{' '.join(COLUMNS)}}}; correct"
                    " them",
                )
        elif section == "HARDPOINT":
            name, symmetry, point = _row(file, where, row, columns)
            if inner:
                variants.setdefault(inner, []).append(f"{name} in {where}")
            elif symmetry == RIGHT:
                right += 1
            elif name in points:
                raise twice(file, where, name, points[name].where)
            else:
                points[name] = point
    if not points:
        raise fault(
            file,
            "",
            f"found no row in a block {BLOCK}, expected hardpoints; give a subsystem file of"
            " Adams/Car",
        )
    left_out = [
        f"[{name}] ({rows} rows)"
        for name, rows in sections.items()
        if name not in ("HARDPOINT", "UNITS", "") and rows
    ]
    left_out += [f"({name}): {shortened(rows, MOST_NAMED)}" for name, rows in variants.items()]
    left_out += [f"{right} points of the right side"] * bool(right)
    return HardpointTable(file, "Adams/Car", points, unit, "rearward,right,up", None, left_out)


def _row(file: Path, where: str, row: str, columns: tuple[str, ...]) -> tuple[str, str, Hardpoint]:
    fields = [(quoted or bare).strip() for quoted, bare in _FIELD.findall(row)]
    if len(fields) != len(columns):
        raise fault(
            file,
            where,
            f"found {len(fields)} fields, expected {len(columns)}: {' '.join(columns)}; complete"
            " the row",
        )
    cells = dict(zip(columns, fields, strict=True))
    name, symmetry = cells["hardpoint_name"], cells["symmetry"].lower()
    require_name(file, where, name)
    if symmetry not in (*LEFT, RIGHT):
        raise fault(
            file,
            where,
            f"{name}: found symmetry {shown(symmetry)}, expected a side;"
            f" {remedy(symmetry, (*LEFT, RIGHT))}",
        )
    x, y, z = (number(file, f"{where}: {name}: {axis}", cells[axis]) for axis in COLUMNS[2:])
    return name, symmetry, Hardpoint((x, y, z), where)
