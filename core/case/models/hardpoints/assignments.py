"""Hardpoints in assignments, as scripts and lists of parameters have them: `lca_front = [1, 2, 3]`,
`UCA_FL.x = 123.4`. Nothing is evaluated: assignments of anything but numbers are left out.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...io.document import fault
from ...units import LENGTHS
from .forms import axis_of, is_number, one_unit
from .rows import remark
from .table import HardpointTable, length_name
from .tree import Leaf, table_of

# As many that a text is one of assignments.
FEWEST = 3
MOST_LINES = 20_000
_NUMBER = r"[-+\u2212]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_ASSIGNED = re.compile(
    r"\s*(?:(?:const|let|var|static|final|double|set)\s+)*"
    r"[\"']?([A-Za-z_][\w.\- ]*(?:[\[({][\"']\w+[\"'][\])}])*)[\"']?\s*=(?!=)\s*(.+)"
)
_KEY = re.compile(r"""[\[({]["'](\w+)["'][\])}]""")
_VECTOR = re.compile(
    rf"(?:[\w.]+\s*\(\s*)?[\[({{]?\s*({_NUMBER})\s*[,;\s]\s*({_NUMBER})\s*[,;\s]\s*({_NUMBER})"
    r"\s*[\])}]?\s*\)?\s*(?:'|\.T)?\s*[;,]?\s*"
)
_SCALAR = re.compile(rf"({_NUMBER})\s*\*?\s*([A-Za-z\"]+)?\s*[;,]?\s*")
_COMMENT = re.compile(r"\s*(?:%|//|#).*")
_UNIT = re.compile(r"[\[(]\s*([A-Za-z]+)\s*[\])]")


def is_assignments(lines: Sequence[tuple[str, str]]) -> bool:
    """Return whether most lines of a text, without comments, assign something."""
    assigned = sum(_ASSIGNED.fullmatch(line) is not None for _, line in lines[:MOST_LINES])
    return assigned >= FEWEST and 2 * assigned >= len(lines[:MOST_LINES])


def read_assignments(
    file: Path,
    lines: Sequence[tuple[str, str]],
    said: dict[str, str],
    wanted: str | None,
) -> HardpointTable:
    """Return the points of assignments.

    Args:
        lines: places and texts of the lines.
        said: facts from comments: unit, axes, template.
        wanted: section of the names, such as `front` in `front.lca_front`, if several have points.

    Raises:
        CaseError: no points, several units, or points of several suspensions.
    """
    found: list[Leaf] = []
    left_out: list[str] = []
    units: dict[str, str] = {}
    for where, line in lines:
        assigned = _ASSIGNED.fullmatch(line)
        if assigned is None:
            if fact := remark([line.strip()]):
                said.setdefault(*fact)
            elif line.strip():
                left_out.append(where)
            continue
        keys = tuple(each.strip() for each in _KEY.sub(r".\1", assigned[1]).split(".") if each)
        comment = _COMMENT.search(assigned[2])
        text = assigned[2][: comment.start()] if comment else assigned[2]
        value: Any = text.strip().rstrip(";").strip("\"'")
        unit = ""
        if vector := _VECTOR.fullmatch(text):
            value = list(vector.groups())
        elif (scalar := _SCALAR.fullmatch(text)) and not (
            scalar[2] and length_name(scalar[2]) not in LENGTHS
        ):
            value, unit = scalar[1], scalar[2] or ""
        if comment and (stated := _UNIT.search(comment[0])):
            unit = unit or stated[1]
        last = keys[-1] if keys else ""
        coordinate = is_number(value) and (axis_of(last) or last.lower() in ("x", "y", "z"))
        if (isinstance(value, list) or coordinate) and length_name(unit) in LENGTHS:
            units.setdefault(length_name(unit), where)
        found.append(Leaf(keys or ("",), value, f"{where} ({'.'.join(keys)})"))
    unit = one_unit(file, units)
    facts = [Leaf((key,), value, key) for key, value in said.items()]
    if unit and length_name(said.get("unit", unit)) != unit:
        problem = f"found {unit}, and {said['unit']} in a comment, expected one unit"
        raise fault(file, units[unit], f"{problem}; correct either")
    facts += [Leaf(("unit",), unit, "unit")] if unit and "unit" not in said else []
    return table_of(file, "Assigned", [*found, *facts], wanted, left_out)
