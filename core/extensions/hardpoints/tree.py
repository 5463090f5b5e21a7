"""Hardpoints in a tree of names: YAML or JSON files, and assignments of scripts and lists of
parameters, `lca_front = [1, 2, 3]`, `UCA_FL.x = 123.4`. Nothing is evaluated: assignments of
anything but numbers are left out.

A point is three numbers, `lca_front: [1, 2, 3]`, or one number for each coordinate: keys x, y and z
below its name, or names with the coordinate at their end, `lca_front_x`. Its name is its path in
the tree without what all points share, and without a key `left`. Of the points of a car, those of
one suspension are read.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias, cast

from ...case.io.document import fault, parse, shown, unknown_name
from ...case.io.table import is_number
from ...case.io.toml_text import parse_yaml
from ...case.units import LENGTHS
from ...errors import brief, remedy, shortened
from ...mechanism.mechanism import Vector
from .options import NOTHING, WheelOptions
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
from .words import fact, fact_of

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
_OF = "axle|suspension|hardpoints|points|geometry|corner|wheel"
_LEFT = re.compile(r"(?:.+_)?left|[fr]?l|l[fr]")
_RIGHT = re.compile(r"(?:.+_)?right|[fr]?r|r[fr]")
_AXLES = [
    re.compile(rf"{axle}(?:_(?:left|{_OF}))?|(?:{_OF})_{axle}|{axle[0]}l?|l{axle[0]}")
    for axle in ("front", "rear")
]
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


def read_tree(file: Path, text: str, supplied: WheelOptions = NOTHING) -> HardpointTable:
    """Return the points of a YAML, JSON or TOML file.

    Args:
        supplied: section or corner of the tree, if several have points.

    Raises:
        CaseError: no such text, no points, or points of several suspensions.
    """
    if file.suffix.lower() == ".json":
        return _table(file, "JSON", json_tree(file, without_comments(text)), supplied)
    if file.suffix.lower() == ".toml":
        return _table(file, "TOML", toml_tree(file, text), supplied)
    return _table(file, "YAML", [*_leaves(parse_yaml(file, text))], supplied)


def read_python(file: Path, text: str, supplied: WheelOptions = NOTHING) -> HardpointTable:
    """Return the points of the assignments of a Python script, dictionaries among them. Nothing is
    evaluated; what is no number, text, list or dictionary of these is left out and listed.

    Raises:
        CaseError: not Python, no points, or points of several suspensions.
    """
    left_out = list[str]()
    leaves = _facts_of_comments(text)
    try:
        for each, above in _statements(ast.parse(text).body):
            targets = each.targets if isinstance(each, ast.Assign) else []
            if isinstance(each, ast.AnnAssign):
                targets = [each.target]
            if not targets:
                left_out.append(f"line {each.lineno}")
                continue
            value = _literal(source) if (source := getattr(each, "value", None)) else ""
            for target in targets:
                path = [*above, *_KEY.sub(r".\1", ast.unparse(target)).split(".")]
                where = f"line {each.lineno} "
                found = _leaves(value, tuple(path))
                leaves += [replace(leaf, where=where + leaf.where) for leaf in found]
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        why = brief(f"{type(error).__name__}: {error}".replace("\n", " "))
        raise fault(file, "", f"is no Python script of points ({why}); correct it") from None
    return _table(file, "Python", leaves, supplied, left_out)


def _statements(body: Iterable[ast.stmt], above: Keys = ()) -> Iterator[tuple[ast.stmt, Keys]]:
    """Yield the statements of a script, and those of its classes below their names."""
    for each in body:
        if isinstance(each, ast.ClassDef):
            yield from _statements(each.body, (*above, each.name))
        else:
            yield each, above


def _literal(node: ast.AST) -> Any:
    """Return the value of an expression of literals, and the text of another one. A call with one
    list, or with three numbers, is a point: `np.array([1, 2, 3])`, `Vector(1, 2, 3)`.
    """
    match node:
        case ast.Constant(value=int() | float() | str()):
            return node.value
        case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() | float() as number)):
            return -number
        case ast.List(elts=items) | ast.Tuple(elts=items):
            return [_literal(item) for item in items]
        case ast.Dict():
            keys = ["**" if key is None else str(_literal(key)) for key in node.keys]
            return _named_values(zip(keys, map(_literal, node.values), strict=True))
        case ast.Call(func=ast.Name(id="dict"), args=[]):
            return _named_values((str(each.arg), _literal(each.value)) for each in node.keywords)
        case ast.Call(args=[ast.List() | ast.Tuple() as only], keywords=[]):
            return _literal(only)
        case ast.Call(args=[_, _, _] as items, keywords=[]):
            return [_literal(item) for item in items]
        case _:
            return ast.unparse(node)


def _named_values(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    found = dict[str, Any]()
    for key, value in pairs:
        if key in found:
            raise ValueError(f"the key {key!r} stands twice")
        found[key] = value
    return found


def json_tree(file: Path, text: str) -> list[Leaf]:
    """Return the values of a JSON text, an object or a list.

    Raises:
        CaseError: not JSON.
    """
    listed = text.lstrip().startswith("[")
    return [*_leaves(parse(file, f'{{"points": {text}}}' if listed else text))]


def toml_tree(file: Path, text: str) -> list[Leaf]:
    """Return the values of a TOML text, and facts of its comments.

    Raises:
        CaseError: not TOML.
    """
    return [*_leaves(parse(file, text)), *_facts_of_comments(text)]


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


def _facts_of_comments(text: str) -> list[Leaf]:
    comments = (line.strip() for line in text.splitlines() if line.lstrip().startswith("#"))
    return _fact_leaves(fact for comment in comments if (fact := fact_of(comment)))


def _fact_leaves(facts: Iterable[tuple[str, str]]) -> list[Leaf]:
    return [Leaf((key,), value, key) for key, value in facts]


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
                facts.setdefault(*fact)
            elif line.strip():
                left_out.append(where)
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
    if unit := one_unit(file, units):
        if length_name(facts.get("unit", unit)) != unit:
            problem = f"found {unit}, and {facts['unit']} in a comment, expected one unit"
            raise fault(file, units[unit], f"{problem}; correct either")
        facts.setdefault("unit", unit)
    return _table(file, "Assigned", [*found, *_fact_leaves(facts.items())], supplied, left_out)


def _leaves(value: Any, keys: Keys = ()) -> Iterator[Leaf]:
    """Yield the values of a tree; a list of numbers or texts is one value."""
    if isinstance(value, Mapping):
        for key, each in cast("Mapping[str, Any]", value).items():
            yield from _leaves(each, (*keys, str(key)))
        return
    items = cast("list[Any]", value) if isinstance(value, list) else []
    if isinstance(value, list) and (
        not items or any(isinstance(each, dict | list) for each in items)
    ):
        for k, each in enumerate(items):
            name, unnamed = _split_name(each)
            yield from _leaves(unnamed, (*keys, name or f"[{k}]"))
    else:
        yield Leaf(keys, value, ".".join(keys))


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
    return "", cast("Any", item)


def _table(
    file: Path,
    tool: str,
    tree: Sequence[Leaf],
    supplied: WheelOptions,
    left_out: Sequence[str] = (),
) -> HardpointTable:
    """Return the points of a tree."""
    points, others = _points(file, tree)
    facts = _facts(others)
    if not points:
        raise fault(
            file,
            "",
            "found no point, expected three numbers such as lca_front: [0.1, 0.3, 0.2], or x, y and"
            " z below a name; give a file of hardpoints (beside a URDF, give the URDF)",
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
        outside = [".".join(keys) for keys in paths if keys not in contained]
        if outside:
            left_out.append(f"values {shortened(outside, 8)}")
        kept = contained
    if wanted is not None:
        inside = {keys: _below(short, wanted) for keys, short in kept.items()}
        found = {keys: short for keys, short in inside.items() if short}
        if not found:
            known = {".".join(short[:k]) for short in kept.values() for k in range(1, len(short))}
            raise fault(
                file,
                "--sheet",
                f"found no section {shown(wanted)}, expected one with points;"
                f" {remedy(wanted, known)}",
            )
        if rest := len(kept) - len(found):
            left_out.append(f"{rest} points of other sections")
        kept = found
    corner = None
    named = {keys: [k for k in short[:-1] if corner_of(k)] for keys, short in kept.items()}
    if supplied.corner is not None and any(named.values()):
        corner = wanted_corner(file, supplied.corner)
        short = {
            keys: tuple(
                key for k, key in enumerate(short) if k + 1 == len(short) or not corner_of(key)
            )
            for keys, short in kept.items()
            if all(agree(corner_of(key) or ("", ""), corner) for key in named[keys])
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
    first, *others = kept.values()
    most = min(map(len, kept.values())) - 1
    differ = (k for k in range(most) if any(keys[k] != first[k] for keys in others))
    shared = next(differ, max(most, 0))
    kept = {keys: short[shared:] for keys, short in kept.items()}
    sections = dict.fromkeys(short[0] for short in kept.values() if len(short) > 1)
    if all(any(axle.fullmatch(normal(each)) for each in sections) for axle in _AXLES):
        raise fault(
            file,
            "",
            f"found points in {', '.join(map(shown, sections))}, expected those of one suspension;"
            " choose a section by --sheet NAME, or --corner FL",
        )
    names = {
        keys: ".".join(
            each for k, each in enumerate(short, 1) if k == len(short) or normal(each) != "left"
        )
        for keys, short in kept.items()
    }
    return names, left_out, corner


def _below(keys: Keys, wanted: str) -> Keys:
    """Return the keys below a section; none if the path is not in it."""
    for first in range(len(keys) - 1):
        for last in range(first + 1, len(keys)):
            if normal(".".join(keys[first:last])) == normal(wanted):
                return keys[last:]
    return ()


def _side(keys: Keys) -> re.Pattern[str] | None:
    """Return the pattern of the side that a key above the point's names; None without one."""
    sides = (side for key in keys[:-1] for side in (_LEFT, _RIGHT) if side.fullmatch(normal(key)))
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
