"""The geometry of a mechanism as named places: hardpoints, axes and lengths that can vary.

Names are those of a case file: "joints.NAME.point", "joints.NAME.axis", "joints.NAME.points.0",
"joints.NAME.lead", "points.NAME.position". `load_parameters` has the places of masses and loads,
on which no motion depends.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from ...algebra import Scalar
from ...joints import Joint, Kind
from ...mechanism.mechanism import Mechanism, Point
from .load_parameters import load_places, with_loads


def places(mechanism: Mechanism) -> dict[str, tuple[float, ...]]:
    """Return the value of every place [m or -]: three numbers of a point or direction, or one."""
    found: dict[str, tuple[float, ...]] = {}
    for joint in mechanism.joints:
        for name, kind, value in joint.parts():
            found[f"joints.{joint.name}.{name}"] = (value,) if kind is Kind.LENGTH else tuple(value)
    return found | {f"points.{point.name}.position": point.position for point in mechanism.points}


def every_place(mechanism: Mechanism) -> dict[str, tuple[float, ...]]:
    """Return the value of every place [SI], of geometry, masses and loads."""
    return places(mechanism) | {name: place.value for name, place in load_places(mechanism).items()}


def kinds(mechanism: Mechanism) -> dict[str, Kind]:
    """Return the kind of every place: a point, a direction or a length."""
    found = {
        f"joints.{joint.name}.{name}": kind
        for joint in mechanism.joints
        for name, kind, _ in joint.parts()
    }
    return found | {f"points.{point.name}.position": Kind.POSITION for point in mechanism.points}


def placed(mechanism: Mechanism, values: Mapping[str, Sequence[Scalar]]) -> Mechanism:
    """Return the mechanism with other values, of any scalar type, at some places, unchecked."""
    joints = [joint.changed(**_changes(joint, values)) for joint in mechanism.joints]
    reduced = [each.changed(partial(_at_points, values)) for each in mechanism.reduced]
    points = [
        _moved(point, values.get(f"points.{point.name}.position")) for point in mechanism.points
    ]
    bodies, forces = with_loads(mechanism, values)
    return replace(
        mechanism, joints=joints, points=points, bodies=bodies, forces=forces, reduced=reduced
    )


def _at_points(values: Mapping[str, Sequence[Scalar]], joint: Joint) -> Joint:
    """Return a joint of a reduced one with its points moved: its directions are not those of the
    joint that holds the rest.
    """
    changes = _changes(joint, values)
    kinds = {name: kind.single for name, kind, _ in joint.geometry()}
    return joint.changed(**{k: x for k, x in changes.items() if kinds[k] is Kind.POSITION})


def _changes(joint: Joint, values: Mapping[str, Sequence[Scalar]]) -> dict[str, Any]:
    changes: dict[str, Any] = {}
    for name, kind, value in joint.geometry():
        place = f"joints.{joint.name}.{name}"
        if kind.pair:
            given = tuple(values.get(f"{place}.{k}") for k in range(2))
            if given != (None, None):
                changes[name] = tuple(
                    old if new is None else tuple(new)
                    for new, old in zip(given, value, strict=True)
                )
        elif place in values:
            changes[name] = values[place][0] if kind is Kind.LENGTH else tuple(values[place])
    return changes


def _moved(point: Point, position: Sequence[Scalar] | None) -> Point:
    if position is None:
        return point
    x, y, z = position
    return replace(point, position=(x, y, z))
