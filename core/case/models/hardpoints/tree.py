"""Hardpoints in a tree of names: YAML or JSON files, and assignments of scripts.

A point is three numbers, `lca_front: [1, 2, 3]`, or one number for each coordinate: keys x, y and z
below its name, or names with the coordinate at their end, `lca_front_x`. Its name is its path in
the tree without what all points share, and without a key `left`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from ....errors import brief, shortened
from ....mechanism.mechanism import Vector
from ...io.document import fault, parse
from ...io.yaml_document import parse_yaml
from ...units import LENGTHS
from .forms import FEWEST, axis_of, is_number
from .programs import without_comments
from .roles import compact, normal
from .sections import Keys, chosen_points
from .table import Hardpoint, HardpointTable, is_axes, length_name, number, twice
from .templates import ROLES, TEMPLATES

_LAST = ("position", "pos", "coordinates", "coords", "coord", "location", "loc", "xyz", "point")
_NAMES = ("name", "id", "label", "point")
# Three numbers that are no place.
_NO_PLACE = re.compile(
    r"axis|(?:.+_)?(?:spin_axis|direction|normal|vector|rotation|orientation|rpy|inertia|euler\w*)"
)


@dataclass(frozen=True)
class Leaf:
    """A value of a tree, with the path of its keys and its place for messages."""

    keys: Keys
    value: Any
    where: str


def read_tree(file: Path, text: str, wanted: str | None) -> HardpointTable:
    """Return the points of a YAML or JSON file.

    Args:
        wanted: section of the tree, if several have points.

    Raises:
        CaseError: no YAML or JSON, no points, or points of several suspensions.
    """
    if file.suffix.lower() == ".json":
        return table_of(file, "JSON", json_tree(file, without_comments(text)), wanted)
    return table_of(file, "YAML", [*leaves(parse_yaml(file, text))], wanted)


def json_tree(file: Path, text: str) -> list[Leaf]:
    """Return the values of a JSON text, an object or a list.

    Raises:
        CaseError: not JSON.
    """
    if not text.lstrip().startswith("["):
        return [*leaves(parse(file, text))]
    return [*leaves(parse(file, f'{{"points": {text}}}'))]


def has_points(tree: Sequence[Leaf]) -> bool:
    """Return whether a tree has values that may be points."""
    return sum(_is_place(leaf) for leaf in tree) >= FEWEST


def _is_place(leaf: Leaf) -> bool:
    if _is_list(leaf.value):
        items: list[Any] = leaf.value
        return len(items) == 3 and all(map(is_number, items))
    return bool(leaf.keys) and is_number(leaf.value) and _coordinate(leaf.keys) is not None


def leaves(value: Any, keys: Keys = ()) -> Iterator[Leaf]:
    """Yield the values of a tree; a list of three or more items with a number is one value."""
    if isinstance(value, Mapping):
        table = cast("Mapping[str, Any]", value)
        for key, each in table.items():
            yield from leaves(each, (*keys, str(key)))
    elif _is_list(value):
        items: list[Any] = value
        if items and not any(isinstance(each, dict | list) for each in items):
            yield Leaf(keys, items, ".".join(keys))
            return
        for k, each in enumerate(items):
            yield from leaves(_unnamed(each), (*keys, _name_of(each) or f"[{k}]"))
    else:
        yield Leaf(keys, value, ".".join(keys))


def _is_list(value: Any) -> bool:
    return isinstance(value, list)


def _name_of(item: Any) -> str:
    """Return the name of a point in a list of points; empty if it has none."""
    if isinstance(item, dict):
        table = cast("dict[str, Any]", item)
        return next((str(table[key]) for key in table if normal(key) in _NAMES), "")
    if isinstance(item, list):
        cells = cast("list[Any]", item)
        if len(cells) == 4 and isinstance(cells[0], str) and not is_number(cells[0]):
            return cells[0]
    return ""


def _unnamed(item: Any) -> Any:
    """Return a point in a list of points without its name."""
    if isinstance(item, dict):
        table = cast("dict[str, Any]", item)
        return {key: each for key, each in table.items() if normal(key) not in _NAMES}
    return item[1:] if _name_of(item) else item


def table_of(
    file: Path, tool: str, tree: Sequence[Leaf], wanted: str | None, left_out: Sequence[str] = ()
) -> HardpointTable:
    """Return the points of a tree.

    Args:
        wanted: section of the tree, if several have points.

    Raises:
        CaseError: no points, points of several suspensions, or a point without a coordinate.
    """
    points, others = _points(file, tree)
    facts = _facts(others)
    if not points:
        raise fault(
            file,
            "",
            "found no point, expected three numbers such as lca_front: [0.1, 0.3, 0.2], or x, y and"
            " z below a name; give a file of hardpoints (beside a URDF, give the URDF)",
        )
    chosen, dropped = chosen_points(file, [*points], wanted)
    found: dict[str, Hardpoint] = {}
    for keys, name in chosen.items():
        if name in found:
            raise twice(file, points[keys].where, name, found[name].where)
        found[name] = points[keys]
    values = {leaf.keys: leaf.value for leaf in others}
    millimetres = length_name(facts.get("unit", "")) == "mm"
    found |= wheel_points(found, values, millimetres=millimetres)
    listed = [*left_out, *dropped]
    if unused := [leaf.where for leaf in others if leaf.value not in facts.values()]:
        listed.append(f"values {shortened([brief(each) for each in unused], 8)}")
    return HardpointTable(
        file, tool, found, facts.get("unit"), facts.get("axes"), facts.get("template"), listed
    )


def _points(file: Path, tree: Sequence[Leaf]) -> tuple[dict[Keys, Hardpoint], list[Leaf]]:
    """Return points by the keys of their paths, and the other values."""
    points: dict[Keys, Hardpoint] = {}
    single: dict[Keys, dict[str, Leaf]] = {}
    others: list[Leaf] = []
    for leaf in tree:
        keys = leaf.keys
        if _is_list(leaf.value):
            items: list[Any] = leaf.value
            last = normal(keys[-1]) if keys else ""
            if len(items) == 3 and all(map(is_number, items)) and not _NO_PLACE.fullmatch(last):
                keys = keys[:-1] if last in _LAST and len(keys) > 1 else keys
                x, y, z = (number(file, leaf.where, each) for each in items)
                _add(file, points, keys, Hardpoint((x, y, z), leaf.where))
                continue
        elif keys and (split := _coordinate(keys)) and is_number(leaf.value):
            place, axis = split
            last = normal(place[-1]) if place else ""
            if place and not _NO_PLACE.fullmatch(last):
                place = place[:-1] if last in _LAST and len(place) > 1 else place
                before = single.setdefault(place, {}).setdefault(axis, leaf)
                if before is not leaf:
                    raise twice(file, leaf.where, f"{'.'.join(place)} {axis}", before.where)
                continue
        others.append(leaf)
    for keys, found in single.items():
        if len(found) == 3:
            x, y, z = (number(file, found[axis].where, found[axis].value) for axis in "xyz")
            _add(file, points, keys, Hardpoint((x, y, z), found["x"].where))
        elif compact(".".join(keys[-2:])) in ROLES or compact(keys[-1]) in ROLES:
            missing = " and ".join(axis for axis in "xyz" if axis not in found)
            raise fault(
                file,
                next(iter(found.values())).where,
                f"found {'.'.join(keys)} without {missing}, expected all three; add it",
            )
        else:
            others += found.values()
    return points, others


def _add(file: Path, points: dict[Keys, Hardpoint], keys: Keys, point: Hardpoint) -> None:
    if keys in points:
        raise twice(file, point.where, f"{'.'.join(keys)}", points[keys].where)
    points[keys] = point


def _coordinate(keys: Keys) -> tuple[Keys, str] | None:
    """Return the path of a point and the coordinate that a path names; None for another path."""
    if keys[-1].strip().lower() in ("x", "y", "z"):
        return keys[:-1], keys[-1].strip().lower()
    split = axis_of(keys[-1])
    return ((*keys[:-1], split[0]), split[1]) if split else None


def _facts(others: Sequence[Leaf]) -> dict[str, str]:
    """Return unit, axes and template, if the tree names them."""
    facts: dict[str, str] = {}
    templates = {
        compact(each) for known in TEMPLATES.values() for each in (known.name, *known.also)
    }
    for leaf in others:
        if not leaf.keys or not isinstance(leaf.value, str):
            continue
        key, value = normal(leaf.keys[-1]), leaf.value.strip()
        if key in ("unit", "units", "length_unit", "length_units", "length"):
            if length_name(value) in LENGTHS or key != "length":
                facts.setdefault("unit", value)
        elif key in ("axes", "coordinate_system", "frame", "axis_system") and is_axes(value):
            facts.setdefault("axes", value)
        elif key in ("type", "template", "suspension_type", "suspension") and (
            compact(value) in templates
        ):
            facts.setdefault("template", value)
    return facts


def wheel_points(
    points: Mapping[str, Hardpoint],
    values: Mapping[tuple[str, ...], object],
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
    if not is_number(offset):
        return {}
    inner, outer = at["axle_inboard"], at["axle_outboard"]
    length = math.dist(inner, outer)
    if length == 0.0:
        return {}
    axis = [(b - a) / length for a, b in zip(inner, outer, strict=True)]
    center = _moved(outer, axis, -float(str(offset)))
    where = f"axle_outboard, wheel offset {offset}"
    found = {
        "wheel_center": Hardpoint(center, where),
        "wheel_axis": Hardpoint(_moved(center, axis, length), where),
    }
    tire = [given.get(("tire", key)) for key in ("rim_diameter", "aspect_ratio", "section_width")]
    if millimetres and all(map(is_number, tire)):
        rim, ratio, width = (float(str(each)) for each in tire)
        down = [axis[2] * axis[0], axis[2] * axis[1], axis[2] * axis[2] - 1.0]
        size = math.hypot(*down)
        if size > 0.0:
            radius = 0.5 * rim * 25.4 + ratio * width
            found["wheel_contact"] = Hardpoint(
                _moved(center, [each / size for each in down], radius), f"{where}, tire"
            )
    return found


def _moved(place: Vector, along: Sequence[float], far: float) -> Vector:
    x, y, z = (a + far * b for a, b in zip(place, along, strict=True))
    return x, y, z
