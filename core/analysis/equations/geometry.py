"""The geometry of a mechanism as named places, so that it can be varied: the hardpoints, axes and lengths of joints and points.

A place is named as in a case file: "joints.NAME.point", "joints.NAME.axis", "joints.NAME.points.0", "joints.NAME.lead",
"points.NAME.position".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

from ...algebra import Scalar
from ...joints import Joint, Kind
from ...mechanism import Mechanism, Point

PAIRS = (Kind.POSITIONS, Kind.DIRECTIONS)


def places(mechanism: Mechanism) -> dict[str, tuple[float, ...]]:
    """The value of every place [m or -]: three numbers of a point or direction, one of a length."""
    found: dict[str, tuple[float, ...]] = {}
    for joint in mechanism.joints:
        for name, kind in _fields(joint):
            value = getattr(joint, name)
            if kind in PAIRS:
                found |= {f"joints.{joint.name}.{name}.{k}": tuple(each) for k, each in enumerate(value)}
            elif value is not None:
                found[f"joints.{joint.name}.{name}"] = (value,) if kind is Kind.LENGTH else tuple(value)
    return found | {f"points.{point.name}.position": point.position for point in mechanism.points}


def directions(mechanism: Mechanism) -> frozenset[str]:
    """The places that hold directions: what varies there is an angle."""
    found: set[str] = set()
    for joint in mechanism.joints:
        for name, kind in _fields(joint):
            place = f"joints.{joint.name}.{name}"
            found |= {Kind.DIRECTION: {place}, Kind.DIRECTIONS: {f"{place}.0", f"{place}.1"}}.get(kind, set())
    return frozenset(found)


def placed(mechanism: Mechanism, values: Mapping[str, Sequence[Scalar]]) -> Mechanism:
    """The mechanism with other values at some places, numbers of any kind; they are not checked again."""
    joints = [joint.changed(**_changes(joint, values)) for joint in mechanism.joints]
    points = [_moved(point, values.get(f"points.{point.name}.position")) for point in mechanism.points]
    return replace(mechanism, joints=joints, points=points)


def _fields(joint: Joint) -> list[tuple[str, Kind]]:
    return [(each.name, each.metadata["kind"]) for each in fields(joint) if "kind" in each.metadata]


def _changes(joint: Joint, values: Mapping[str, Sequence[Scalar]]) -> dict[str, Any]:
    changes: dict[str, Any] = {}
    for name, kind in _fields(joint):
        place = f"joints.{joint.name}.{name}"
        if kind in PAIRS:
            given = tuple(values.get(f"{place}.{k}") for k in range(2))
            if given != (None, None):
                pairs = zip(given, getattr(joint, name), strict=True)
                changes[name] = tuple(old if new is None else tuple(new) for new, old in pairs)
        elif place in values:
            changes[name] = values[place][0] if kind is Kind.LENGTH else tuple(values[place])
    return changes


def _moved(point: Point, position: Sequence[Scalar] | None) -> Point:
    if position is None:
        return point
    x, y, z = position
    return replace(point, position=(x, y, z))
