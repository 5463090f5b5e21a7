"""Hardpoints in a tree of names: YAML or JSON files, and assignments of scripts and lists of
parameters, `lca_front = [1, 2, 3]`, `UCA_FL.x = 123.4`. Assignments of anything but numbers are
left out.

A point is three numbers, `lca_front: [1, 2, 3]`, or one number for each coordinate: keys x, y and z
below its name, or names with the coordinate at their end, `lca_front_x`. Its name is its path in
the tree without what all points share, and without a key `left`. Of the points of a car, those of
one suspension are read.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias, cast

from ...case.io.document import check_values, fault, parse, parse_json, shown, unknown_name
from ...case.io.lines import join
from ...case.io.table import is_number
from ...case.units import LENGTHS
from ...errors import brief, remedy, sentence, shortened
from ...mechanism.mechanism import Vector
from ..yaml.reading import parse_yaml
from .options import WheelOptions
from .programs import without_comments
from .table import (
    Hardpoint,
    HardpointTable,
    angles_and_radius,
    incomplete,
    is_axes,
    length_name,
    number,
    one_unit,
    twice,
    wanted_corner,
)
from .templates import ROLES, TEMPLATE_NAMES, agree, compact, corner_of, normal
from .words import fact, fact_of, require_no_slip

FEWEST = 3
"""Fewest points, rows or assignments to recognise a form."""
MOST_LINES = 20_000
Keys: TypeAlias = tuple[str, ...]
"""Path of a value: the keys of the tree from its root."""

_AXIS = re.compile(
    r"(?P<name>.*[^\s_.\-\[(:])(?:[\s_.\-\[(:]+(?P<axis>[xyzXYZ])|(?<=[a-z0-9])(?P<bare>[XYZ]))[\])]?"
)
_AXIS_FIRST = re.compile(r"(?P<axis>[xyzXYZ])[\s_.\-:]+(?P<name>.+)")
_LAST = ("position", "pos", "coordinates", "coords", "coord", "location", "loc", "xyz", "point")
_NAMES = ("name", "id", "label", "point")
# Three numbers that are no place.
_NO_PLACE = re.compile(
    r"axis|(?:.+_)?(?:spin_axis|direction|normal|vector|rotation|orientation|rpy|inertia|euler\w*)"
)
_CONTAINERS = ("hardpoints", "hard_points", "hardpoint", "points", "coordinates", "geometry")
_OF = re.compile(
    r"(?:_|\b)(?:axle|suspension|susp|hard_?points?|hps?|points?|pts|coord(?:inate)?s|geometry|corner"
    r"|wheel)(?=_|\b)"
)
_LEFT = re.compile(r"(?:.+_)?left|[fr]?l|l[fr]")
_RIGHT = re.compile(r"(?:.+_)?right|[fr]?r|r[fr]")
_AXLES = [re.compile(rf"{axle}(?:_left)?|{axle[0]}l?|l{axle[0]}") for axle in ("front", "rear")]
_UNIT_KEYS = ("unit", "units", "length_unit", "length_units", "length")
_AXES_KEYS = ("axes", "coordinate_system", "frame", "axis_system")
_TYPE_KEYS = ("type", "template", "suspension_type", "suspension")
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


@dataclass(frozen=True)
class Leaf:
    """A value of a tree, with the path of its keys and its place for messages."""

    keys: Keys
    value: Any
    where: str

    @property
    def triple(self) -> list[Any]:
        """The three numbers of the value; none if it is another."""
        value = self.value
        items = cast("list[Any]", value) if isinstance(value, list) else []
        return items if len(items) == 3 and all(map(is_number, items)) else []

    @property
    def coordinate(self) -> tuple[Keys, str] | None:
        """The path of a point and the coordinate that the value is; None for another value."""
        if not self.keys or not is_number(self.value):
            return None
        *above, last = self.keys
        if last.strip().lower() in ("x", "y", "z"):
            return self.keys[:-1], last.strip().lower()
        split = axis_of(last)
        return ((*above, split[0]), split[1]) if split else None


def read_tree(file: Path, text: str, supplied: WheelOptions) -> HardpointTable:
    """Return the points of a YAML, JSON or TOML file.

    Args:
        supplied: section or corner of the tree, if several have points.

    Raises:
        CaseError: no such text, no points, or points of several suspensions.
    """
    if file.suffix.lower() == ".json":
        return table_of(file, "JSON", json_tree(file, without_comments(text)), supplied)
    if file.suffix.lower() == ".toml":
        return table_of(file, "TOML", toml_tree(file, text), supplied)
    return table_of(file, "YAML", [*leaves_of(parse_yaml(file, text))], supplied)


def json_tree(file: Path, text: str) -> list[Leaf]:
    """Return the values of a JSON text, an object or a list.

    Raises:
        CaseError: not JSON.
    """
    data = parse_json(file, text)
    check_values(file, data)
    return [*leaves_of(data)]


def toml_tree(file: Path, text: str) -> list[Leaf]:
    """Return the values of a TOML text, and facts of its comments.

    Raises:
        CaseError: not TOML.
    """
    return [*leaves_of(parse(file, text)), *fact_leaves(facts_of_comments(file, text))]


def has_points(tree: Sequence[Leaf]) -> bool:
    """Return whether a tree has values that may be points."""
    return sum(bool(leaf.triple or leaf.coordinate) for leaf in tree) >= FEWEST


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


def add_fact(file: Path, where: str, facts: dict[str, str], fact: tuple[str, str]) -> None:
    """Add a fact to those above.

    Raises:
        CaseError: another one stands there.
    """
    name, value = fact
    if facts.setdefault(name, value).lower() != value.lower():
        problem = f"found {name} {shown(value)}, and {shown(facts[name])} above, expected one"
        raise fault(file, where, f"{problem}. Remove either")


def facts_of_comments(file: Path, text: str) -> dict[str, str]:
    """Return the facts in whole lines of comments.

    Raises:
        CaseError: two contradict each other.
    """
    facts = dict[str, str]()
    for k, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("#"):
            if fact := fact_of(line.strip()):
                add_fact(file, f"line {k}", facts, fact)
            require_no_slip(file, f"line {k}", line)
    return facts


def fact_leaves(facts: Mapping[str, str]) -> list[Leaf]:
    """Return facts as values of a tree."""
    return [Leaf((key,), value, key) for key, value in facts.items()]


def is_assignments(lines: Sequence[tuple[str, str]]) -> bool:
    """Return whether most lines of a text, without comments, assign something."""
    assigned = sum(_ASSIGNED.fullmatch(line) is not None for _, line in lines[:MOST_LINES])
    return assigned >= FEWEST and 2 * assigned >= len(lines[:MOST_LINES])


def read_assignments(
    file: Path, lines: Sequence[tuple[str, str]], facts: dict[str, str], supplied: WheelOptions
) -> HardpointTable:
    """Return the points of assignments.

    Args:
        lines: places and texts of the lines.
        facts: unit, axes and template, from comments.
        supplied: section or corner of the names, such as `front` in `front.lca_front`, if several
            have points.

    Raises:
        CaseError: no points, several units, or points of several suspensions.
    """
    found = list[Leaf]()
    left_out = list[str]()
    units = dict[str, str]()
    for where, line in lines:
        assigned = _ASSIGNED.fullmatch(line)
        if assigned is None:
            if fact := fact_of(line):
                add_fact(file, where, facts, fact)
            elif line.strip():
                left_out.append(f"{where} ({brief(line.strip())})")
            continue
        keys = tuple(each.strip() for each in _KEY.sub(r".\1", assigned[1]).split(".") if each)
        text, comment = assigned[2], _COMMENT.search(assigned[2])
        if comment:
            text = text[: comment.start()]
        value: Any = text.strip().rstrip(";").strip("\"'")
        unit = ""
        if vector := _VECTOR.fullmatch(text):
            value = [*vector.groups()]
        elif scalar := _SCALAR.fullmatch(text):
            unit = scalar[2] or ""
            if not unit or length_name(unit) in LENGTHS:
                value = scalar[1]
        if comment and (stated := _UNIT.search(comment[0])):
            unit = unit or stated[1]
        leaf = Leaf(keys or ("",), value, f"{where} ({'.'.join(keys)})")
        if (isinstance(value, list) or leaf.coordinate) and length_name(unit) in LENGTHS:
            units.setdefault(length_name(unit), where)
        found.append(leaf)
    told = with_unit(file, facts, units)
    return table_of(file, "Assigned", [*found, *fact_leaves(told)], supplied, left_out)


def with_unit(file: Path, facts: Mapping[str, str], units: Mapping[str, str]) -> dict[str, str]:
    """Return the facts of a file, the unit of its points among them.

    Args:
        units: places of points by the unit beside them.

    Raises:
        CaseError: there are several units.
    """
    unit = one_unit(file, units)
    stated = facts.get("unit", unit)
    if unit and length_name(stated) != unit:
        problem = f"found {unit}, and {stated} in a comment, expected one unit"
        raise fault(file, units[unit], f"{problem}. Correct either")
    return {"unit": stated, **facts} if unit else dict(facts)


def leaves_of(value: Any, keys: Keys = (), path: str = "") -> Iterator[Leaf]:
    """Yield the values of a tree; a list of numbers or texts is one value.

    Args:
        keys: names around the value.
        path: its place in the file, for messages.
    """
    if isinstance(value, Mapping):
        for key, each in cast("Mapping[str, Any]", value).items():
            yield from leaves_of(each, (*keys, str(key)), join(path, str(key)))
        return
    items = cast("list[Any]", value) if isinstance(value, list) else []
    if isinstance(value, list) and (
        not items or any(isinstance(each, dict | list) for each in items)
    ):
        for k, each in enumerate(items):
            name, unnamed = _split_name(each)
            yield from leaves_of(unnamed, (*keys, name or f"[{k}]"), f"{path}[{k}]")
    else:
        named = ".".join(keys)
        same = named.replace(".[", "[") == path
        yield Leaf(keys, value, path if same else f"{path} ({named})")


def _split_name(item: Any) -> tuple[str, Any]:
    """Return the name of a point in a list of points, empty if it has none, and the rest of it."""
    if isinstance(item, dict):
        table = cast("dict[str, Any]", item)
        names = [str(table[key]) for key in table if normal(key) in _NAMES]
        rest = {key: each for key, each in table.items() if normal(key) not in _NAMES}
        return next(iter(names), ""), rest
    cells = cast("list[Any]", item) if isinstance(item, list) else []
    if len(cells) == 4 and isinstance(cells[0], str) and not is_number(cells[0]):
        return cells[0], cells[1:]
    if len(cells) == 2 and isinstance(cells[0], str) and isinstance(cells[1], list | dict):
        return cells[0], cast("Any", cells[1])
    return "", cast("Any", item)


def table_of(
    file: Path,
    tool: str,
    tree: Sequence[Leaf],
    supplied: WheelOptions,
    left_out: Sequence[str] = (),
) -> HardpointTable:
    """Return the points of a tree.

    Args:
        tool: program of the format.
        left_out: other content of the file.

    Raises:
        CaseError: no points, or points of several suspensions.
    """
    points, others = _points(file, tree)
    facts = _facts(others)
    if not points:
        raise fault(
            file,
            "",
            "found no point, expected three numbers such as lca_front: [0.1, 0.3, 0.2], or x, y and"
            " z below a name. Give a file of hardpoints (beside a URDF, give the URDF)",
        )
    chosen, dropped, corner = _of_one_suspension(file, [*points], supplied)
    found = dict[str, Hardpoint]()
    for keys, name in chosen.items():
        if name in found:
            raise twice(file, points[keys].where, name, found[name].where)
        found[name] = points[keys]
    values = {leaf.keys: leaf.value for leaf in others}
    millimetres = length_name(facts.get("unit", "")) == "mm"
    found |= _wheel_points(found, values, millimetres=millimetres)
    listed, said = [*left_out, *dropped], [*facts.values()]
    if unused := [leaf.where for leaf in others if not (_fact_key(leaf) and leaf.value in said)]:
        listed.append(f"values {shortened([brief(each) for each in unused], 8)}")
    return HardpointTable(
        *(file, tool, found, facts.get("unit"), facts.get("axes"), facts.get("template"), listed),
        side=facts.get("side") or (corner or ("", ""))[1] or None,
        corner=corner,
        **angles_and_radius(facts),
    )


def _points(file: Path, tree: Sequence[Leaf]) -> tuple[dict[Keys, Hardpoint], list[Leaf]]:
    """Return points by the keys of their paths, and the other values."""
    points = dict[Keys, Hardpoint]()
    single = dict[Keys, dict[str, Leaf]]()
    others = list[Leaf]()

    def add(keys: Keys, where: str, x: float, y: float, z: float) -> None:
        if keys in points:
            raise twice(file, where, ".".join(keys), points[keys].where)
        points[keys] = Hardpoint((x, y, z), where)

    for leaf in tree:
        keys, axis = leaf.coordinate or (leaf.keys if leaf.triple else (), "")
        last = normal(keys[-1]) if keys else ""
        if _NO_PLACE.fullmatch(last) or not (keys or leaf.triple):
            others.append(leaf)
            continue
        keys = keys[:-1] if last in _LAST and len(keys) > 1 else keys
        if leaf.triple:
            add(keys, leaf.where, *(number(file, leaf.where, each) for each in leaf.triple))
            continue
        before = single.setdefault(keys, {}).setdefault(axis, leaf)
        if before is not leaf:
            raise twice(file, leaf.where, f"{'.'.join(keys)} {axis}", before.where)
    for keys, found in single.items():
        if len(found) == 3:
            values = (number(file, found[axis].where, found[axis].value) for axis in "xyz")
            add(keys, found["x"].where, *values)
        elif compact(".".join(keys[-2:])) in ROLES or compact(keys[-1]) in ROLES:
            raise incomplete(file, next(iter(found.values())).where, ".".join(keys), found)
        else:
            others += found.values()
    return points, others


def _fact_key(leaf: Leaf) -> bool:
    """Return whether a value has the key of a fact."""
    key = normal(leaf.keys[-1]) if leaf.keys else ""
    return (
        key == "side"
        or any(key in keys for keys in (_UNIT_KEYS, _AXES_KEYS, _TYPE_KEYS))
        or fact(key, str(leaf.value)) is not None
    )


def _facts(others: Sequence[Leaf]) -> dict[str, str]:
    """Return what the tree states of all points: unit, axes, template, side, radius and angles."""
    facts = dict[str, str]()
    for leaf in others:
        if not leaf.keys or not isinstance(leaf.value, str | int | float):
            continue
        key, value = normal(leaf.keys[-1]), str(leaf.value).strip()
        name, value = fact(key, value) or ("", value)
        if key in _UNIT_KEYS or name == "unit":
            if length_name(value) in LENGTHS or key != "length":
                facts.setdefault("unit", value)
        elif key in _AXES_KEYS or name == "axes":
            if is_axes(value):
                facts.setdefault("axes", value)
        elif key in _TYPE_KEYS or name == "template":
            if compact(value) in TEMPLATE_NAMES:
                facts.setdefault("template", value)
        elif name and (name != "side" or value.lower() in ("left", "right")):
            facts.setdefault(name, value)
    return facts


def _of_one_suspension(
    file: Path, paths: Sequence[Keys], supplied: WheelOptions
) -> tuple[dict[Keys, str], list[str], tuple[str, str] | None]:
    """Return the names of the points of one suspension by their paths, what was left out, and the
    corner that keys name, if it is asked for.
    """
    wanted = supplied.sheet
    left_out = list[str]()
    kept = {keys: keys for keys in paths}
    contained = {
        keys: (*keys[:k], *keys[k + 1 :])
        for keys in paths
        for k in [k for k, key in enumerate(keys[:-1]) if normal(key) in _CONTAINERS][:1]
    }
    if contained:
        beside = {keys: keys for keys in paths if len(keys) == 1 and compact(keys[0]) in ROLES}
        outside = [".".join(keys) for keys in paths if keys not in {**contained, **beside}]
        if outside:
            left_out.append(f"values {shortened(outside, 8)}")
        kept = beside | contained
    if wanted is not None:
        inside = {keys: _below(short, wanted) for keys, short in kept.items()}
        found = {keys: short for keys, short in inside.items() if short}
        if not found:
            known = {".".join(short[:k]) for short in kept.values() for k in range(1, len(short))}
            raise fault(
                file,
                "--sheet",
                f"found no section {shown(wanted)}, expected one with points."
                f" {sentence(remedy(wanted, known))}",
            )
        if rest := len(kept) - len(found):
            left_out.append(f"{rest} points of other sections")
        kept = found
    corner = None
    named = {
        keys: [k for k in short[:-1] if corner_of(_section(k))] for keys, short in kept.items()
    }
    if supplied.corner is not None and any(named.values()):
        corner = wanted_corner(file, supplied.corner)
        short = {
            keys: tuple(
                key
                for k, key in enumerate(short, 1)
                if k == len(short) or not corner_of(_section(key))
            )
            for keys, short in kept.items()
            if all(agree(corner_of(_section(key)) or ("", ""), corner) for key in named[keys])
        }
        if not any(named[keys] for keys in short):
            known = dict.fromkeys(key for keys in named.values() for key in keys)
            raise unknown_name(file, "--corner", supplied.corner, known, "a corner of the file")
        left_out += [f"{len(kept) - len(short)} points of other corners"]
        kept = short
    sides = {keys: _side(short) for keys, short in kept.items()}
    right = [keys for keys, side in sides.items() if side is _RIGHT]
    if right and _LEFT in sides.values():
        left_out.append(f"{len(right)} points of the right side")
        kept = {keys: short for keys, short in kept.items() if keys not in right}
    kept = _without_shared(kept)
    sections = dict.fromkeys(short[0] for short in kept.values() if len(short) > 1)
    if all(any(axle.fullmatch(_section(each)) for each in sections) for axle in _AXLES):
        raise fault(
            file,
            "",
            f"found points in {', '.join(map(shown, sections))}, expected those of one suspension."
            " Choose a section by --sheet NAME, or --corner FL",
        )
    names = {
        keys: ".".join(
            each for k, each in enumerate(short, 1) if k == len(short) or _section(each) != "left"
        )
        for keys, short in kept.items()
    }
    return names, left_out, corner


def _without_shared(kept: Mapping[Keys, Keys]) -> dict[Keys, Keys]:
    """Return the keys of points without the sections shared by all. Points beside the only section
    are of its suspension, if the names in it are those of a suspension.
    """
    inside = [short for short in kept.values() if len(short) > 1]
    most = min(map(len, inside), default=1) - 1
    shared = next((k for k in range(most) if len({short[k] for short in inside}) > 1), most)
    bare = {keys: short[shared:] if len(short) > 1 else short for keys, short in kept.items()}
    if len(inside) == len(kept) or _roles(bare) > _roles(kept):
        return bare
    axle = shared and any(axle.fullmatch(_section(inside[0][shared - 1])) for axle in _AXLES)
    return bare if axle and _roles(bare) == _roles(kept) else dict(kept)


def _roles(kept: Mapping[Keys, Keys]) -> int:
    """Return how many points have the name of a role of a template, each counted once."""
    return len({compact(".".join(short)) for short in kept.values()} & ROLES)


def _section(key: str) -> str:
    """Return the normal name of a section without words such as hardpoints: `HP_FRONT` and
    `frontHardpoints` are front.
    """
    plain = normal(re.sub(r"(?<=[a-z])(?=[A-Z])", "_", key))
    return _OF.sub("", plain).strip("_") or plain


def _below(keys: Keys, wanted: str) -> Keys:
    """Return the keys below a section; none if the path is not in it."""
    for first in range(len(keys) - 1):
        for last in range(first + 1, len(keys)):
            if normal(".".join(keys[first:last])) == normal(wanted):
                return keys[last:]
        if _section(keys[first]) == normal(wanted):
            return keys[first + 1 :]
    return ()


def _side(keys: Keys) -> re.Pattern[str] | None:
    """Return the pattern of the side that a key above the point's names; None without one."""
    sides = (side for key in keys[:-1] for side in (_LEFT, _RIGHT) if side.fullmatch(_section(key)))
    return next(sides, None)


def _wheel_points(
    points: Mapping[str, Hardpoint],
    values: Mapping[Keys, object],
    *,
    millimetres: bool,
) -> dict[str, Hardpoint]:
    """Return wheel centre, axis and contact of suspension-explorer's hub face, wheel offset and
    tire.

    The centre is inboard of `axle_outboard` by the offset (github.com/suspension-explorer/
    suspension-explorer-core, derived points); the rim's diameter is in inches, its other lengths
    in mm.
    """
    at = {normal(name): point.position for name, point in points.items()}
    given = {tuple(map(normal, keys[-2:])): value for keys, value in values.items()}
    offset = given.get(("wheel", "offset"))
    if "wheel_center" in at or not {"axle_inboard", "axle_outboard"} <= at.keys():
        return {}
    inner, outer = at["axle_inboard"], at["axle_outboard"]
    length = math.dist(inner, outer)
    if length == 0.0 or not is_number(offset):
        return {}
    axis = [(b - a) / length for a, b in zip(inner, outer, strict=True)]
    center = _shift(outer, axis, -float(str(offset)))
    where = f"axle_outboard, wheel offset {offset}"
    found = {
        "wheel_center": Hardpoint(center, where),
        "wheel_axis": Hardpoint(_shift(center, axis, length), where),
    }
    tire = [given.get(("tire", key)) for key in ("rim_diameter", "aspect_ratio", "section_width")]
    down = [axis[2] * axis[0], axis[2] * axis[1], axis[2] * axis[2] - 1.0]
    size = math.hypot(*down)
    if millimetres and size > 0.0 and all(map(is_number, tire)):
        rim, ratio, width = (float(str(each)) for each in tire)
        radius = 0.5 * rim * 25.4 + ratio * width
        contact = _shift(center, [each / size for each in down], radius)
        found["wheel_contact"] = Hardpoint(contact, f"{where}, tire")
    return found


def _shift(place: Vector, along: Sequence[float], far: float) -> Vector:
    x, y, z = (a + far * b for a, b in zip(place, along, strict=True))
    return x, y, z
