"""Templates of suspensions: the roles of their hardpoints, and the joints at their places, from
`templates.toml`, which explains their keys.

Places are in metres, x forward, y left, z up. A template describes the left side; the chassis is
the ground, and the steering is locked.
"""

from __future__ import annotations

import csv
import io
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from ...case.io.table import folded
from ...errors import CaseError, unknown
from ...joints import Distance, Joint
from ...mechanism.mechanism import Point, Vector

KNUCKLE = "knuckle"
"""The wheel carrier in every template."""
WHEEL_CENTER, WHEEL_CONTACT, WHEEL_AXIS = "wheel_center", "wheel_contact", "wheel_axis"
TIEROD_INNER = "tierod_inner"

SPELLINGS = 4096
"""Names whose normal form is kept: an edited table has the same ones."""
_SIDES = (
    re.compile(r"(?P<name>.+?)_(?P<side>left|right|l|r|fl|fr|rl|rr)"),
    re.compile(r"(?P<side>left|right|fl|fr|rl|rr)_(?P<name>.+)"),
)
"""Side or corner at the end of a normal name, or at its start."""
_ARM = re.compile(r"([ul])ca_(front|rear|outer)")
_WRITTEN: dict[str, Any] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
)
NAMES = _WRITTEN.pop("names")
"""Words in names of points, as `templates.toml` has them."""
_CORNERS: Mapping[str, tuple[str, str]] = {
    word: (axle.replace("any", ""), side.replace("any", ""))
    for axle, sides in NAMES["corners"].items()
    for side, words in sides.items()
    for word in words
}


@dataclass(frozen=True)
class Role:
    """A hardpoint of a template.

    Attributes:
        meaning: description of the hardpoint, for messages.
        also: other names of the hardpoint; one point may fill several roles.
    """

    name: str
    meaning: str
    also: Sequence[str]

    @property
    def names(self) -> tuple[str, ...]:
        """All names of the hardpoint, in their compact form."""
        return tuple(map(compact, (self.name, *self.also)))


@dataclass(frozen=True)
class Template:
    """A kind of suspension; `templates.toml` explains its attributes.

    Attributes:
        joint_rows: type, bodies and roles of places of each joint, by its name.
    """

    name: str
    also: Sequence[str]
    roles: Sequence[Role]
    optional: Sequence[Role]
    joint_rows: Mapping[str, Sequence[str]]
    watched: Sequence[str]
    sample: Mapping[str, Vector]
    springs: Mapping[str, tuple[str, str]]
    twists: Mapping[str, tuple[str, ...]]
    across: Mapping[str, tuple[str, str]]
    bodies: Mapping[str, str]
    above: Sequence[tuple[str, str]]
    ahead: Sequence[tuple[str, str]]
    kingpin: tuple[str, str] | tuple[tuple[str, str], ...] | None
    steered: str
    guessed: bool

    def joints(self, at: Mapping[str, Vector]) -> list[Joint]:
        """Return the joints for the places of the roles; they name the bodies."""
        joints = list[Joint]()
        for name, (kind, i, j, role, *other) in self.joint_rows.items():
            if "bar" in (i, j) and not at.keys() >= {*self.twists["bar_twist"]}:
                continue
            cls: Any = Joint.registry[kind]
            given: list[Any] = [at[role]]
            if cls is Distance:
                given = [(at[role], at[other[0]])]
            elif other:
                a, b = at[role], at[other[0]]
                given.append((b[0] - a[0], b[1] - a[1], b[2] - a[2]))
            joints.append(cls(name, i, j, *given))
        return joints

    def points(self, at: Mapping[str, Vector]) -> list[Point]:
        """Return the points for outputs, from the roles with a place."""
        read = [
            *self.watched,
            *(
                role
                for each in self.kingpin or ()
                for role in ([each] if isinstance(each, str) else each)
            ),
        ]
        twists = [roles[:3] for roles in self.twists.values() if at.keys() >= {*roles}]
        several = (*self.springs.values(), *twists, *self.across.values())
        read += [role for roles in several if all(map(at.get, roles)) for role in roles]
        read += [role for role in (WHEEL_CONTACT, WHEEL_AXIS) if role in at]
        return [
            Point(role, self.bodies.get(role, KNUCKLE), at[role]) for role in dict.fromkeys(read)
        ]


@lru_cache(SPELLINGS)
def normal(name: str) -> str:
    """Return a hardpoint's name in normal form: without differences in case, blanks, the prefix of
    Adams/Car, and the spelling of centre.
    """
    plain = folded(name).replace("centre", "center").replace("tie_rod", "tierod")
    return re.sub(r"^hp[ls]_", "", plain)


@lru_cache(SPELLINGS)
def compact(name: str) -> str:
    """Return a hardpoint's name in normal form without separators, also of words written together:
    `upperBallJoint`.
    """
    return normal(name).replace("_", "")


def side_of(name: str) -> tuple[str, str]:
    """Return a hardpoint's normal name without its side or corner, and the side: "left", "right" or
    an empty text.
    """
    plain = normal(name)
    for pattern in _SIDES:
        if found := pattern.fullmatch(plain):
            side = found["side"]
            return found["name"], "left" if side in ("left", "l", "fl", "rl") else "right"
    return plain, ""


def head_of_corner(column: str) -> str:
    """Return what a column of corners tells, by its head: "corner", "axle" or "side"; an empty text
    of any other column.
    """
    found = kind_of_head(column)
    return found if found in ("corner", "axle", "side") else ""


def kind_of_head(column: str) -> str:
    """Return the kind of a column by its head: as `head_of_corner`, or "name" or "number"."""
    word = compact(column)
    return next((what for what, words in NAMES["heads"].items() if word in words), "")


def corner_of(text: str, column: str = "") -> tuple[str, str] | None:
    """Return the axle and the side in the name of a corner: ("front", "left") for "FL", ("rear",
    "") for "rear"; None for another text.

    Args:
        column: head of the column of the text; below "side", "R" is right, below "axle" rear.
    """
    word = compact(text)
    if (head := head_of_corner(column)) in ("axle", "side"):
        name = next((name for name, words in NAMES[head].items() if word in words), "")
        return ((name, "") if head == "axle" else ("", name)) if name else None
    return _CORNERS.get(word)


def corner_in(name: str) -> tuple[str, str]:
    """Return the axle and the side at the end or at the start of a hardpoint's name; empty texts
    without.
    """
    plain = normal(name)
    for pattern in _SIDES:
        if found := pattern.fullmatch(plain):
            return corner_of(found["side"]) or ("", side_of(name)[1])
    return "", ""


def agree(found: tuple[str, str], wanted: tuple[str, str]) -> bool:
    """Return whether axle and side of a corner are the wanted ones, or left open."""
    return all(a in ("", b) or not b for a, b in zip(found, wanted, strict=True))


def _further_names(role: str) -> Iterable[str]:
    """Yield names of wishbones and tie rods in tables of Adams/Car, Lotus Suspension Analysis,
    suspension-explorer, OptimumK, Assetto Corsa and others.
    """
    ends = NAMES["rod_ends"].get(role, ())
    yield from (f"{rod}_{end}" for rod in NAMES["rods"] for end in ends)
    if found := _ARM.fullmatch(role):
        level, end = {"u": "upper", "l": "lower"}[found[1]], found[2]
        yield from (
            f"{arm.format(level)}_{name}"
            for arm in NAMES["arms"]
            for name in NAMES["arm_ends"][end]
        )
        if end == "outer":
            yield from (f"{level}_ball_joint", f"{level[0]}bj")
        yield NAMES["optimum"][end].format(level[:3].capitalize())
        place = {"u": "top", "l": "bottom"}[found[1]]
        yield f"wbtyre_{place}" if end == "outer" else f"wbcar_{place}_{end}"


def _read_templates() -> dict[str, Template]:
    written = _WRITTEN
    common = written.pop("common")

    def roles(rows: Mapping[str, list[str]]) -> list[Role]:
        found = list[Role]()
        for name, row in rows.items():
            meaning, *also = row or common["roles"][name]
            found.append(Role(name, meaning, (*also, *_further_names(name))))
        return found

    templates = dict[str, Template]()
    for name, own in written.items():
        like: dict[str, Any] = written.get(own.get("like"), {})
        both = {key: {**like.get(key, {}), **own.get(key, {})} for key in ("roles", "sample")}
        keys: dict[str, Any] = {"springs": common["springs"], "across": {}, **like, **own, **both}
        keys["twists"] = {**common["twists"], **keys.get("twists", {})}
        bar = [name if name != "BAR" else keys["bar"] for name in common["joints"]["bar_link"]]
        keys["joints"] = {**keys["joints"], **common["joints"], "bar_link": bar}
        written[name] = keys
        wanted = roles(keys["roles"])
        optional = roles({**common["optional"], **keys.get("optional", {})})
        known = [role.name for role in (*wanted, *optional)]
        fronts = [(f"{x.removesuffix('_rear')}_front", x) for x in known if x.endswith("_rear")]
        kingpin: Any = tuple(
            each if isinstance(each, str) else tuple(each) for each in keys.get("kingpin", ())
        )
        templates[name] = Template(
            *(name, own["also"], wanted, optional, keys["joints"], keys["watched"]),
            sample={role: place for role, place in keys["sample"].items() if role in known},
            springs=keys["springs"],
            twists={name: tuple(roles) for name, roles in keys["twists"].items()},
            across={name: tuple(ends) for name, ends in keys["across"].items()},
            bodies={**common["bodies"], **keys.get("bodies", {})},
            above=(*keys.get("above", ()), (WHEEL_CENTER, WHEEL_CONTACT)),
            ahead=(*fronts, *keys.get("ahead", ())),
            kingpin=kingpin or None,
            steered=keys.get("steered", ""),
            guessed=own.get("guessed", True),
        )
    return templates


TEMPLATES = _read_templates()
"""Templates by name, as for --template."""

TEMPLATE_NAMES = {
    compact(name): template
    for template in TEMPLATES.values()
    for name in (template.name, *template.also)
}
"""Templates by all their names, in their compact form."""

ROLES = frozenset(
    name
    for template in TEMPLATES.values()
    for role in (*template.roles, *template.optional)
    for name in role.names
)
"""All names of all roles, in their compact form."""


def samples(names: Sequence[str], sample: Callable[[Template], str]) -> list[str]:
    """Return the samples of the templates of these names; of all templates without names.

    Raises:
        CaseError: there is no such template.
    """
    for name in names:
        if name not in TEMPLATES:
            raise CaseError(unknown("template", name, TEMPLATES))
    return [sample(TEMPLATES[name]) for name in names or TEMPLATES]


def sample_table(template: Template) -> str:
    """Return the text of a table to begin one's own with, in mm; its numbers are invented."""
    text = io.StringIO()
    text.write(f"# template: {template.name}\n# units: mm\n# axes: forward,left,up\n")
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("name", "x", "y", "z", "meaning"))
    for roles, note in ((template.roles, ""), (template.optional, "optional: ")):
        for role in roles:
            if role.name in template.sample:
                place = (f"{1000.0 * x:.6g}" for x in template.sample[role.name])
                rows.writerow((role.name, *place, f"{note}{role.meaning}"))
    return text.getvalue()
