"""Suspensions of Project Chrono: the JSON files of its vehicle models
(data/vehicle/**/suspension/*.json).

Points are relative to the subsystem, in metres, x forward, y left, z up; the file gives the left
side (Chrono::Vehicle manual).
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from ...io.document import fault, parse, shown
from ...io.typed_tables import as_table
from .table import Hardpoint, HardpointTable, number

WHEEL_CENTER = "Spindle/COM"
"""The centre of mass of the spindle: Chrono places the wheel there."""

TOE, CAMBER = "Toe Angle (deg)", "Camber Angle (deg)"
"""Angles of the wheel at design; positive: toe-in, top outboard. ChDoubleWishbone.cpp turns the
spindle by them about z, then about x."""

# An unclosed text or comment matches to the end of the line or file. Without a match, the search
# would start anew at every quote and every /*.
_STRING_OR_COMMENT = re.compile(r'"(?:\\.|[^"\\\n])*+"?|//[^\n]*|/\*.*?(?:\*/|\Z)', re.DOTALL)


def without_comments(text: str) -> str:
    """Return JSON without Chrono's comments; lines and columns stay the same."""

    def blank(found: re.Match[str]) -> str:
        part = found.group()
        return part if part.startswith('"') else re.sub(r"[^\n]", " ", part)

    return _STRING_OR_COMMENT.sub(blank, text)


def is_chrono(tables: Mapping[str, Any]) -> bool:
    """Return whether the tables of a JSON file are of a vehicle model of Chrono."""
    sections = [cast("dict[str, Any]", each) for each in tables.values() if isinstance(each, dict)]
    return (
        "Template" in tables
        or isinstance(tables.get("Type"), str)
        or any(key.startswith("Location") for section in sections for key in section)
    )


def read_chrono(file: Path, text: str) -> HardpointTable:
    """Return the points of a suspension, named "Section/Key" as in the file.

    Raises:
        CaseError: not JSON, no suspension, or an invalid point.
    """
    tables = parse(file, without_comments(text))
    kind = tables.get("Type", "Suspension")
    if kind != "Suspension":
        raise fault(
            file,
            "Type",
            f'found {shown(kind)}, expected "Suspension"; give the JSON file of a suspension',
        )
    template = tables.get("Template")
    if template is not None and not isinstance(template, str):
        raise fault(
            file,
            "Template",
            f"found {shown(template)}, expected the name of a suspension template; correct the"
            " value",
        )
    points: dict[str, Hardpoint] = {}
    left_out: list[str] = []
    toe, camber = (math.radians(number(file, key, tables.pop(key, 0.0))) for key in (TOE, CAMBER))
    for section, content in tables.items():
        if section in ("Name", "Type", "Template"):
            continue
        if not isinstance(content, dict):
            left_out.append(section)
            continue
        others: list[str] = []
        for key, value in as_table(file, section, cast("object", content)).items():
            name = f"{section}/{key}"
            if key.startswith("Location") or name == WHEEL_CENTER:
                points[name] = Hardpoint(_point(file, name, value), name)
            else:
                others.append(key)
        if others:
            left_out.append(f"{section} ({', '.join(others)})")
    if not points:
        raise fault(
            file,
            "",
            'found no key "Location ...", expected the points of a suspension; give a suspension'
            " file of Chrono",
        )
    return HardpointTable(
        file, "Project Chrono", points, "m", "forward,left,up", template, left_out, toe, camber
    )


def _point(file: Path, key: str, value: object) -> tuple[float, float, float]:
    numbers = cast("list[object]", value) if isinstance(value, list) else []
    if len(numbers) != 3:
        raise fault(
            file,
            key,
            f"found {shown(cast('object', value))}, expected three numbers [x, y, z]; correct the"
            " point",
        )
    x, y, z = (number(file, key, each) for each in numbers)
    return x, y, z
