"""Units in the heads of columns: `toe [deg]`, `toe (deg)`, `toe, deg`, `toe_deg`.

A unit is a product of known units: `deg/mm`, `mm/s^2`, `N mm`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TypeAlias

from ..units import ANGLES, LENGTHS
from .document import fault, shown

_Powers: TypeAlias = tuple[int, int, int, int]
"""Powers of length, angle, time and force."""
_NONE: _Powers = (0, 0, 0, 0)
_LENGTH, _ANGLE, _TIME, _FORCE = (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)
_OTHER_NAMES: Mapping[str, Sequence[str]] = {
    "m": ("meter", "metre", "meters", "metres"),
    "mm": ("millimeter", "millimetre", "millimeters", "millimetres"),
    "cm": ("centimeter", "centimetre", "centimeters", "centimetres"),
    "inch": ("in", "inches", '"'),
    "foot": ("ft", "feet"),
    "rad": ("radian", "radians"),
    "deg": ("degree", "degrees", "°", "º"),
}
UNIT_NAMES: Mapping[str, str] = {
    other: name for name, others in _OTHER_NAMES.items() for other in (name, *others)
}
"""Names of units of length and angle by their other names, in small letters."""
_FURTHER: Mapping[str, tuple[float, _Powers]] = {
    "1": (1.0, _NONE),
    "-": (1.0, _NONE),
    "%": (0.01, _NONE),
    "um": (1e-6, _LENGTH),
    "µm": (1e-6, _LENGTH),
    "mrad": (1e-3, _ANGLE),
    "arcmin": (ANGLES["deg"].size / 60.0, _ANGLE),
    "s": (1.0, _TIME),
    "sec": (1.0, _TIME),
    "ms": (1e-3, _TIME),
    "n": (1.0, _FORCE),
    "newton": (1.0, _FORCE),
    "kn": (1e3, _FORCE),
    "nm": (1.0, (1, 0, 0, 1)),
    "nmm": (1e-3, (1, 0, 0, 1)),
}
_WORDS: Mapping[_Powers, str] = {
    _NONE: "no unit, [-] or [%]",
    _LENGTH: "a length: m, mm, cm, inch or foot",
    _ANGLE: "an angle: deg, rad, mrad or arcmin",
    _TIME: "a time: s or ms",
    _FORCE: "a force: N or kN",
}
_IN_BRACKETS = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))\s*", re.DOTALL)
_BETWEEN = re.compile(r"[\s_,/]+")
_LONGEST = 30
_FACTOR = re.compile(r"([^\d^]+|1)\s*(?:\^?\s*([+-]?[1-9]))?")


@dataclass(frozen=True)
class ColumnUnit:
    """The unit of a column.

    Attributes:
        name: as the file writes it.
        powers: powers of length, angle, time and force.
        convert: conversion of a number to SI.
    """

    name: str
    powers: _Powers
    convert: Callable[[float], float]


def read_unit(text: str) -> ColumnUnit | None:
    """Return the unit of a text; None for an unknown unit."""
    if len(text) > _LONGEST:
        return None
    plain = text.strip().lower().replace("²", "^2").replace("³", "^3").replace(" per ", "/")
    plain = plain.replace("_per_", "/")
    name = UNIT_NAMES.get(plain, plain)
    for known, powers in ((LENGTHS, _LENGTH), (ANGLES, _ANGLE)):
        if name in known:
            return ColumnUnit(name, powers, known[name].convert)
    size, total = Fraction(1), list(_NONE)
    for k, part in enumerate(plain.split("/")):
        for factor in filter(None, re.split(r"[ *·.]+", part)):
            found = _FACTOR.fullmatch(factor)
            known_factor = _factor(found[1].strip()) if found else None
            if found is None or known_factor is None:
                return None
            power = int(found[2] or 1) * (-1 if k else 1)
            size *= Fraction(repr(known_factor[0])) ** power
            total = [old + power * new for old, new in zip(total, known_factor[1], strict=True)]
        if not part.strip():
            return None
    a, b, c, d = total
    number = float(size)
    return ColumnUnit(text.strip(), (a, b, c, d), lambda x: x * number)


def _factor(name: str) -> tuple[float, _Powers] | None:
    name = UNIT_NAMES.get(name, name)
    if name in LENGTHS:
        return LENGTHS[name].size, _LENGTH
    if name in ANGLES:
        return ANGLES[name].size, _ANGLE
    return _FURTHER.get(name)


def split_head(text: str, names: Container[str] = ()) -> tuple[str, str]:
    """Return name and unit of the head of a column, the unit empty if it has none.

    Args:
        names: known names; a head that is one of them has no unit.
    """
    text = text.strip()
    if text in names:
        return text, ""
    if (found := _IN_BRACKETS.fullmatch(text)) and found[1]:
        return found[1], (found[2] if found[2] is not None else found[3]).strip() or "-"
    for between in _BETWEEN.finditer(text):  # from the left: `deg/mm` is longer than `mm`
        name, unit = text[: between.start()], text[between.end() :]
        toe_in = unit.lower() == "in" and name.lower().endswith("toe")
        if (
            name
            and (unit[:1].isalpha() or unit[:1] == "°")
            and not toe_in
            and read_unit(unit) is not None
        ):
            return name, unit
    return text, ""


def unit_of_head(file: Path, where: str, text: str, names: Container[str] = ()) -> tuple[str, str]:
    """Return name and unit of the head of a column that may give its unit twice.

    Raises:
        CaseError: the head gives two units.
    """
    name, unit = split_head(text, names)
    while unit:
        inner, other = split_head(name, names)
        if not other or (read_unit(other) is None and inner not in names):
            break
        first, second = read_unit(other), read_unit(unit)
        if first is None or second is None or first.name != second.name:
            raise fault(
                file,
                where,
                f"found the column {shown(text)} in {shown(other)} and {shown(unit)}, expected one"
                " unit; correct either",
            )
        name = inner
    return name, unit


def required_unit(file: Path, where: str, column: str, unit: str, si: str) -> ColumnUnit:
    """Return the unit of a column, which must measure what an SI unit does.

    Raises:
        CaseError: the unit is unknown, or of something else.
    """
    expected, found = read_unit(si), read_unit(unit)
    assert expected is not None
    if found is None or found.powers != expected.powers:
        what = _WORDS.get(expected.powers, f"a unit such as {si}")
        raise fault(
            file,
            where,
            f"found the unit {shown(unit)} of column {shown(column)}, expected {what}; correct it",
        )
    return found


def is_unit_row(cells: Sequence[object]) -> bool:
    """Return whether cells are units, as in a row below the heads."""
    texts = [cell for cell in cells if cell != ""]
    return bool(texts) and all(
        isinstance(each, str) and each.strip() != "1" and read_unit(each.strip("[]() ")) is not None
        for each in texts
    )
