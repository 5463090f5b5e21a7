"""A table of hardpoints as in its file, and its conversion to metres in the axes of ISO 8855: x
forward, y left, z up.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from ...case.io.document import decimal, fault, shown, unknown_name, usable
from ...case.io.table import UNIT_NAMES, numeral
from ...case.units import LENGTHS, Unit
from ...errors import CaseError
from ...mechanism.mechanism import Vector
from .templates import corner_of

_DIRECTIONS: Mapping[str, tuple[int, float]] = {
    "forward": (0, 1.0),
    "rearward": (0, -1.0),
    "left": (1, 1.0),
    "right": (1, -1.0),
    "up": (2, 1.0),
    "down": (2, -1.0),
}
AXES_IN_USE = (
    "forward,left,up (ISO 8855), rearward,right,up (Adams/Car), forward,right,down (SAE J670), or"
    " what else they are"
)
_NAMED_AXES: Mapping[str, str] = {
    "iso": "forward,left,up",
    "sae": "forward,right,down",
    "adams": "rearward,right,up",
}
_ADVICE: Sequence[tuple[re.Pattern[str], str]] = (
    (
        re.compile(r"[=+@-]?[A-Za-z=]+.*[!(]|=|[+-]?\$?[A-Z]{1,3}\$?\d+"),
        "Write the value of the formula: save the table anew from the spreadsheet program",
    ),
    (re.compile(r"[-+]?\d{1,3}([\s'’]\d{3})+"), "Remove the separators of thousands"),
    (
        re.compile(r"[-+]?[\d.,]+\s*(mm|cm|m|in|inch|ft|\")$"),
        "Leave the unit out, and state it in the head or by --units",
    ),
    (re.compile(r"[\u2010-\u2015]"), "Write the minus sign as a hyphen, -"),
    (re.compile(r"\d{4}-\d\d-\d\d"), "A spreadsheet took the number for a date: type it anew"),
)
"""Remedies for invalid coordinates."""


STATIC_ANGLES = ("static_toe", "static_camber")
Axes: TypeAlias = Sequence[tuple[int, float]]
"""Axis of the case, 0 to 2, and sign of x, y and z of a table."""


@dataclass(frozen=True)
class Hardpoint:
    """Coordinates as in the file, and their place in the file for messages."""

    position: Vector
    where: str


@dataclass(frozen=True)
class HardpointTable:
    """Content of a file of hardpoints.

    Attributes:
        tool: program of the format.
        points: points by their name in the file.
        unit: unit of the coordinates, if file or format define it.
        axes: directions of x, y and z, if file or format define them: "forward,left,up".
        template: template of the points, if the file names it.
        static_toe, static_camber: angles of the wheel at design, if the file gives them [rad].
        left_out: other content, without use for kinematics or a template.
        side: side of the wheel, if the file states it.
        corner: axle and side of the points, if the file tells those of several wheels apart.
        wheel_radius: radius of the loaded wheel, if the file gives it, as "310mm"; without a unit
            in that of the coordinates.
        texts: titles, comments and other texts, for guesses.
        roles: names of points by role, if they are known otherwise than by the names.
        beside: what sections of the file have beside points, if a reader uses it.
    """

    file: Path
    tool: str
    points: Mapping[str, Hardpoint]
    unit: str | None
    axes: str | None
    template: str | None = None
    left_out: Sequence[str] = ()
    static_toe: float = 0.0
    static_camber: float = 0.0
    side: str | None = None
    corner: tuple[str, str] | None = None
    wheel_radius: str | None = None
    texts: Sequence[str] = ()
    roles: Mapping[str, str] = field(default_factory=dict[str, str])
    beside: Mapping[str, Mapping[str, Any]] = field(default_factory=dict[str, Any])


def angles_and_radius(facts: Mapping[str, str]) -> dict[str, Any]:
    """Return the wheel's angles at design [rad] and its radius among the facts of a file, by the
    names of a table's attributes.
    """
    angles = {key: math.radians(float(facts.get(key, 0.0))) for key in STATIC_ANGLES}
    return {**angles, "wheel_radius": facts.get("wheel_radius")}


def wanted_corner(file: Path, said: str) -> tuple[str, str]:
    """Return the axle and the side that --corner states.

    Raises:
        CaseError: it is no corner.
    """
    if (found := corner_of(said)) is None:
        raise unknown_name(file, "--corner", said, ("FL", "FR", "RL", "RR"), "a corner")
    return found


def twice(file: Path, where: str, name: str, before: str) -> CaseError:
    """Return the error of a point or coordinate that a file gives again."""
    return fault(
        file, where, f"{name}: given before, in {before}, expected once. Remove one of them"
    )


def incomplete(file: Path, where: str, name: str, axes: Collection[str]) -> CaseError:
    """Return the error of a point of which a file gives some coordinates."""
    missing = " and ".join(axis for axis in "xyz" if axis not in axes)
    return fault(file, where, f"found {name} without {missing}, expected all three. Add it")


def one_unit(file: Path, units: Mapping[str, str]) -> str:
    """Return the only unit; empty without any.

    Args:
        units: places of coordinates by their unit.

    Raises:
        CaseError: there are several units.
    """
    if len(units) > 1:
        first, other, *_ = units
        raise fault(
            file,
            units[other],
            f"found {shown(other)}, and {shown(first)} above, expected one unit. Write all"
            " coordinates in one",
        )
    return next(iter(units), "")


def require_name(file: Path, where: str, name: str) -> None:
    """Refuse a name of a point that cannot be printed, or none."""
    if not name or not name.isprintable():
        raise fault(
            file, where, f"found the name {name!r}, expected printable characters. Name the point"
        )


def number(file: Path, where: str, text: object, sign: str = ".") -> float:
    """Return a coordinate.

    Args:
        sign: decimal sign of texts.

    Raises:
        CaseError: not a usable number.
    """
    found = math.nan
    if isinstance(text, str | int | float) and not isinstance(text, bool):
        with suppress(ValueError, OverflowError):
            found = decimal(numeral(text, sign)) if isinstance(text, str) else float(text)
    if not usable(found):
        advice = next((advice for kind, advice in _ADVICE if kind.match(str(text))), "")
        raise fault(
            file,
            where,
            f"found {shown(text)}, expected a coordinate. {advice or 'Correct the number'}",
        )
    return found


def positions_of(table: HardpointTable, unit: Unit, axes: Axes) -> dict[str, Vector]:
    """Return the points in metres, x forward, y left, z up."""
    points = dict[str, Vector]()
    for name, point in table.points.items():
        position = [0.0, 0.0, 0.0]
        for value, (k, sign) in zip(point.position, axes, strict=True):
            place = sign * unit(value)
            position[k] = place if usable(place) else 0.0  # too small to be squared
        points[name] = (position[0], position[1], position[2])
    return points


def unit_of(table: HardpointTable, said: str | None) -> Unit:
    """Return the unit of the coordinates, for their conversion to SI.

    Args:
        said: unit from the user.

    Raises:
        CaseError: it is unknown, or the user contradicts the file.
    """
    written = None if table.unit is None else length_name(table.unit)
    if written is not None and written not in LENGTHS:
        raise unknown_name(table.file, "unit", table.unit, LENGTHS, "a length")
    if said is None:
        if written is None:
            raise fault(
                table.file,
                "",
                "does not say in which unit its coordinates are, expected it from you. Add --units"
                " mm or --units m, or else cm, inch or foot",
            )
        return LENGTHS[written]
    name = length_name(said)
    if name not in LENGTHS:
        raise unknown_name(table.file, "--units", said, LENGTHS, "a length")
    if written not in (None, name):
        raise fault(
            table.file,
            "--units",
            f"found {said}, but the file is in {written}. Leave out --units, or correct the file",
        )
    return LENGTHS[name]


def length_name(text: str) -> str:
    """Return the name of a unit in `LENGTHS`; for another text, the text in small letters."""
    name = text.strip().lower()
    return UNIT_NAMES.get(name, name)


def axes_of(table: HardpointTable, said: str | None) -> Axes:
    """Return the axes of a table.

    Args:
        said: axes from the user.

    Raises:
        CaseError: they are unknown, or the user contradicts the file.
    """
    if said is None and table.axes is None:
        raise fault(
            table.file,
            "",
            f"does not say where x, y and z point, expected it from you. Add --axes {AXES_IN_USE}",
        )
    places = None if table.axes is None else _places(table.file, "axes", table.axes)
    if said is None:
        assert places is not None
        return places
    found = _places(table.file, "--axes", said)
    if places not in (None, found):
        raise fault(
            table.file,
            "--axes",
            f"found {said}, but the points of this file are {table.axes}. Leave out --axes",
        )
    return found


def is_axes(text: str) -> bool:
    """Return whether a text states where x, y and z point."""
    try:
        _places(Path(), "", text)
    except CaseError:
        return False
    return True


def _places(file: Path, key: str, text: str) -> list[tuple[int, float]]:
    words = [
        word.strip().lower() for word in _NAMED_AXES.get(text.strip().lower(), text).split(",")
    ]
    places = [_DIRECTIONS[word] for word in words if word in _DIRECTIONS]
    if len(words) != 3 or sorted(k for k, _ in places) != [0, 1, 2]:
        raise fault(
            file,
            key,
            f"found {shown(text)}, expected where x, y and z point, one each of forward or"
            " rearward, left or right, up or down. Write them with commas: forward,left,up",
        )
    return places
