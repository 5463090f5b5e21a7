"""Columns of a measured curve: matched to the driver and the outputs of a case by their names, by
names that rigs and other programs use, or as the user states.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ...errors import MOST_NAMED, brief, remedy, shortened
from .column_units import split_head
from .document import fault, shown, unknown_name

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
_OTHER_NAMES = {other: name for name, others in _ALSO.items() for other in others}
_LEFT = re.compile(r"^(?:left|l|fl|rl|lf|lr)_(?=..)|_(?:left|l|fl|rl|lf|lr)$")


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
        exact = [k for k in places if names[k] == name]
        if len(exact or places) > 1:
            both = " and ".join(shown(heads[k]) for k in exact or places)
            raise fault(
                file,
                where,
                f"found the columns {both}, expected one for {name}; say which by {MAP}"
                f' "COLUMN={name}"',
            )
        found[(exact or places)[0]] = Target(name)
    if driver not in [target.name for target in found.values()] and 0 not in found:
        found[0] = Target(driver)
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
        for other in (each, f"left_{each}"):
            known = by_name.get(other) or by_name.get(_normal(_OTHER_NAMES.get(other, "")))
            if known:
                return known
        also = _OTHER_NAMES.get(each, "")
        if also and (known := by_name.get(f"left_{also}")):
            return known
    return ""


def _normal(name: str) -> str:
    """Return a name without differences in case, separators and the spelling of centre."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_").replace("centre", "center")
