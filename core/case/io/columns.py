"""Columns of tables: units in their heads, `toe [deg]`, `toe (deg)`, `toe, deg`, `toe_deg`; and
names of columns for the driver and the outputs of a case, also those of rigs and other programs.

A unit is a product of known units: `deg/mm`, `mm/s^2`, `N mm`.
"""

from __future__ import annotations

import re
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TypeAlias

from ...errors import MOST_NAMED, brief, remedy, shortened
from ..units import ANGLES, LENGTHS, Unit
from .document import fault, shown, unknown_name

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
_FACTORS: Mapping[str, tuple[float, _Powers]] = {
    **{name: (unit.size, _LENGTH) for name, unit in LENGTHS.items()},
    **{name: (unit.size, _ANGLE) for name, unit in ANGLES.items()},
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

MAP = "--map"
# Names for an output or a driver, in normal form. Names of sums and changes (track, total toe) are
# no names of outputs.
_ALSO: Mapping[str, Sequence[str]] = {
    "toe": ("toe_angle", "toe_in"),
    "camber": ("camber_angle",),
    "caster": ("caster_angle", "castor", "castor_angle"),
    "kingpin_inclination": ("kpi", "kpi_angle", "kingpin_angle", "kingpin_inclination_angle"),
    "roll_center_height": ("rc_height", "roll_center", "roll_center_z", "rch"),
    "scrub_radius": ("scrub",),
    "mechanical_trail": ("trail", "caster_trail", "castor_trail"),
    "stroke": (
        *("travel", "wheel_travel", "bump", "bump_travel", "jounce", "wheel_stroke", "wheel_lift"),
        *("vertical_travel", "wheel_displacement", "vertical_displacement", "wheel_center_travel"),
    ),
    "rack_travel": ("rack", "rack_displacement", "rack_stroke", "rack_disp", "steering_rack"),
}
_OUTPUTS = {other: name for name, others in _ALSO.items() for other in others}
_LEFT = re.compile(r"^(?:left|l|fl|rl|lf|lr)_(?=..)|_(?:left|l|fl|rl|lf|lr)$")


def read_unit(text: str) -> tuple[Unit, _Powers] | None:
    """Return the unit of a text, and its powers of length, angle, time and force; None for an
    unknown unit.
    """
    if len(text) > _LONGEST:
        return None
    plain = text.strip().lower().replace("²", "^2").replace("³", "^3").replace(" per ", "/")
    plain = plain.replace("_per_", "/")
    name = UNIT_NAMES.get(plain, plain)
    for known, powers in ((LENGTHS, _LENGTH), (ANGLES, _ANGLE)):
        if name in known:
            return known[name], powers
    size, total = Fraction(1), list(_NONE)
    for k, part in enumerate(plain.split("/")):
        for factor in filter(None, re.split(r"[ *·.]+", part)):
            found = _FACTOR.fullmatch(factor)
            name = found[1].strip() if found else ""
            name = UNIT_NAMES.get(name, name)
            if found is None or name not in _FACTORS:
                return None
            power = int(found[2] or 1) * (-1 if k else 1)
            number, powers = _FACTORS[name]
            size *= Fraction(repr(number)) ** power
            total = [old + power * new for old, new in zip(total, powers, strict=True)]
        if not part.strip():
            return None
    a, b, c, d = total
    whole = float(size)
    return Unit(text.strip(), whole, lambda x: x * whole), (a, b, c, d)


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
        starts = unit[:1].isalpha() or unit[:1] == "°"
        if name and starts and not toe_in and read_unit(unit) is not None:
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
        first, second = read_unit(other), read_unit(unit)
        if not other or (first is None and inner not in names):
            break
        if first is None or second is None or first[0].name != second[0].name:
            raise fault(
                file,
                where,
                f"found the column {shown(text)} in {shown(other)} and {shown(unit)}, expected one"
                " unit; correct either",
            )
        name = inner
    return name, unit


def required_unit(file: Path, where: str, column: str, unit: str, si: str) -> Unit:
    """Return the unit of a column, which must measure what an SI unit does.

    Raises:
        CaseError: the unit is unknown, or of something else.
    """
    expected, found = read_unit(si), read_unit(unit)
    assert expected is not None
    if found is None or found[1] != expected[1]:
        what = _WORDS.get(expected[1], f"a unit such as {si}")
        raise fault(
            file,
            where,
            f"found the unit {shown(unit)} of column {shown(column)}, expected {what}; correct it",
        )
    return found[0]


def is_unit_row(cells: Sequence[object]) -> bool:
    """Return whether cells are units, as in a row below the heads."""
    texts = [cell for cell in cells if cell != ""]
    return bool(texts) and all(
        isinstance(each, str) and each.strip() != "1" and read_unit(each.strip("[]() ")) is not None
        for each in texts
    )


@dataclass(frozen=True)
class Target:
    """What a column holds.

    Attributes:
        name: the driver, or OUTPUT, OUTPUT.velocity or OUTPUT.acceleration.
        unit: unit stated by the user; empty for that of the head.
        opposite: whether the numbers have the opposite sign.
    """

    name: str
    unit: str = ""
    opposite: bool = False


def read_stated(
    file: Path, texts: Sequence[str], driver: str, known: Mapping[str, str]
) -> dict[str, Target]:
    """Return what columns hold, by their heads, as the user states it: "COLUMN=[-]NAME [UNIT]".

    Args:
        known: names of the columns of outputs.

    Raises:
        CaseError: a text has another form, or names no output.
    """
    stated: dict[str, Target] = {}
    for text in texts:
        head, equals, right = (part.strip() for part in text.rpartition("="))
        opposite = right.startswith("-")
        name, unit = split_head(right.removeprefix("-").strip(), known)
        if not equals or not head or not name:
            raise fault(
                file,
                MAP,
                f"found {shown(text)}, expected COLUMN=OUTPUT, COLUMN=-OUTPUT or"
                f' COLUMN="OUTPUT [UNIT]"; say {MAP} "Toe Angle=toe [deg]"',
            )
        if name != driver and name not in known:
            raise unknown_name(
                file, MAP, name, [driver, *known], f"the driver {driver} or an output"
            )
        if head in stated or name in [target.name for target in stated.values()]:
            raise fault(
                file,
                MAP,
                f"found {shown(head)} or {shown(name)} twice, expected once; leave out one",
            )
        stated[head] = Target(name, unit, opposite)
    return stated


def match(
    file: Path,
    where: str,
    heads: Sequence[str],
    driver: str,
    known: Mapping[str, str],
    stated: Mapping[str, Target],
) -> dict[int, Target]:
    """Return what columns hold, by their indices, the driver first. Other columns are left out.

    Raises:
        CaseError: two columns hold the same, a stated column is missing, or none holds an output.
    """
    names = [_bare(head, known) for head in heads]
    found: dict[int, Target] = {}
    for head, target in stated.items():
        places = [k for k, each in enumerate(heads) if head in (each, names[k])]
        if len(places) != 1:
            problem = "no column" if not places else "several columns"
            raise fault(
                file,
                MAP,
                f"found {problem} {shown(head)}, expected one of the file;"
                f" {remedy(head, filter(None, heads))}",
            )
        if places[0] in found:
            raise fault(
                file,
                MAP,
                f"found the column {shown(heads[places[0]])} twice, expected it once; leave one"
                " out",
            )
        found[places[0]] = target
    taken = {target.name for target in found.values()}
    by_name = {_normal(name): name for name in (*known, driver)}
    matches: dict[str, list[int]] = {}
    for k, name in enumerate(names):
        wanted = _named(name, by_name)
        if k not in found and wanted and wanted not in taken:
            matches.setdefault(wanted, []).append(k)
    for name, places in matches.items():
        exact = [k for k in places if names[k] == name] or places
        if len(exact) > 1:
            both = " and ".join(shown(heads[k]) for k in exact)
            raise fault(
                file,
                where,
                f"found the columns {both}, expected one for {name}; say which by {MAP}"
                f' "COLUMN={name}"',
            )
        found[exact[0]] = Target(name)
    if driver not in [target.name for target in found.values()]:
        found.setdefault(0, Target(driver))
    drives = [k for k, target in found.items() if target.name == driver]
    outputs = sorted(k for k in found if k not in drives)
    if not drives or not outputs:
        missing = (
            f"an output of the case, such as {shortened([*map(brief, known)][:6], MOST_NAMED)}"
            if drives
            else f"the driver {driver}"
        )
        listed = shortened([brief(shown(head)) for head in heads if head], MOST_NAMED)
        raise fault(
            file,
            where,
            f"found the columns {listed}, expected one of {missing}; name it so, or say {MAP}"
            f' "COLUMN={next(iter(known), "OUTPUT") if drives else driver}"',
        )
    return {k: found[k] for k in (*drives, *outputs)}


def _bare(head: str, known: Mapping[str, str]) -> str:
    """Return a head without its units."""
    name, unit = split_head(head, known)
    return _bare(name, known) if unit else name


def _named(name: str, by_name: Mapping[str, str]) -> str:
    """Return the driver or column of an output of a name, of a rig's name for it, or of one of
    these of the left side; empty if there is none.
    """
    plain = _normal(name)
    for each in (plain, _LEFT.sub("", plain)):
        also = _normal(_OUTPUTS.get(each, ""))
        for other in (each, also, f"left_{each}", f"left_{also}"):
            if other in by_name:
                return by_name[other]
    return ""


def _normal(name: str) -> str:
    """Return a name without differences in case, separators and the spelling of centre."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_").replace("centre", "center")
