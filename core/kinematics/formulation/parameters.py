"""Geometry, masses and loads of a mechanism as named places: numbers that can vary.

Names are those of a case file: "joints.NAME.point", "joints.NAME.axis", "joints.NAME.points.0",
"joints.NAME.lead", "points.NAME.position"; "bodies.NAME.mass", "bodies.NAME.center_of_mass",
"forces.NAME.stiffness", "forces.NAME.points.0", on which no motion depends.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

from ...algebra import Scalar
from ...joints import Joint, Kind
from ...mechanism.body import MASS, Body, Dimension, dimension_of
from ...mechanism.loads import ForceElement
from ...mechanism.mechanism import Mechanism, Point

_Part = TypeVar("_Part", Body, ForceElement, Joint)


@dataclass(frozen=True)
class LoadPlace:
    """A mass, a centre of mass, or a number or point of a force element.

    Attributes:
        field: where its part has it; of a pair with the number of the end.
        value: one number, or three of a point [SI].
        dimension: of a number; None of a point.
    """

    part: str
    field: str
    value: tuple[float, ...]
    dimension: Dimension | None

    @property
    def name(self) -> str:
        """The name, as in a case file."""
        return f"{self.part}.{self.field}"


def load_places(mechanism: Mechanism) -> dict[str, LoadPlace]:
    """Return the places of bodies with mass, then of force elements, by name."""
    return {place.name: place for place in _load_places(mechanism)}


def _load_places(mechanism: Mechanism) -> Iterator[LoadPlace]:
    for body in mechanism.moving:
        if body.mass != 0.0:
            part = f"bodies.{body.name}"
            yield LoadPlace(part, "mass", (body.mass,), MASS)
            yield LoadPlace(part, "center_of_mass", body.center, None)
    for force in mechanism.forces:
        part = f"forces.{force.name}"
        for each in fields(force):
            value: Any = getattr(force, each.name)
            kind, dimension = each.metadata.get("kind"), dimension_of(each)
            if kind is Kind.POSITION:
                yield LoadPlace(part, each.name, tuple(value), None)
            elif kind is Kind.POSITIONS:
                for end, point in enumerate(value):
                    yield LoadPlace(part, f"{each.name}.{end}", tuple(point), None)
            elif dimension is not None and not isinstance(value, tuple):
                yield LoadPlace(part, each.name, (value,), dimension)


def with_loads(
    mechanism: Mechanism, values: Mapping[str, Sequence[Scalar]]
) -> tuple[list[Body], list[ForceElement]]:
    """Return the bodies and force elements with other values at some places, unchecked."""
    changes: dict[str, dict[str, Any]] = {}
    for name, place in load_places(mechanism).items():
        if name in values:
            given = values[name]
            changes.setdefault(place.part, {})[place.field] = (
                tuple(given) if place.dimension is None else given[0]
            )
    bodies = [_change(each, changes.get(f"bodies.{each.name}")) for each in mechanism.bodies]
    forces = [_change(each, changes.get(f"forces.{each.name}")) for each in mechanism.forces]
    return bodies, forces


def _change(part: _Part, changes: Mapping[str, Any] | None) -> _Part:
    if not changes:
        return part
    other = copy(part)
    for field, value in changes.items():
        name, _, end = field.partition(".")
        if end:
            pair = [*getattr(other, name)]
            pair[int(end)] = value
            value = tuple(pair)
        object.__setattr__(other, name, value)
    return other


def places(mechanism: Mechanism) -> dict[str, tuple[float, ...]]:
    """Return the value of every place [m or -]: three numbers of a point or direction, or one."""
    return {
        name: (value,) if kind is Kind.LENGTH else tuple(value)
        for name, kind, value in _geometry(mechanism)
    }


def kinds(mechanism: Mechanism) -> dict[str, Kind]:
    """Return the kind of every place: a point, a direction or a length."""
    return {name: kind for name, kind, _ in _geometry(mechanism)}


def _geometry(mechanism: Mechanism) -> Iterator[tuple[str, Kind, Any]]:
    for joint in mechanism.joints:
        for name, kind, value in joint.parts():
            yield f"joints.{joint.name}.{name}", kind, value
    for point in mechanism.points:
        yield f"points.{point.name}.position", Kind.POSITION, point.position


def every_place(mechanism: Mechanism) -> dict[str, tuple[float, ...]]:
    """Return the value of every place [SI], of geometry, masses and loads."""
    return places(mechanism) | {name: place.value for name, place in load_places(mechanism).items()}


def placed(mechanism: Mechanism, values: Mapping[str, Sequence[Scalar]]) -> Mechanism:
    """Return the mechanism with other values, of any scalar type, at some places, unchecked."""
    joints = [_change(joint, _changes(joint, values)) for joint in mechanism.joints]

    def at_points(joint: Joint) -> Joint:
        # the directions of a part of a reduced joint are not those of the joint that holds the rest
        return _change(joint, _changes(joint, values, Kind.POSITION))

    reduced = [each.changed(at_points) for each in mechanism.reduced]
    points = [
        _move(point, values.get(f"points.{point.name}.position")) for point in mechanism.points
    ]
    bodies, forces = with_loads(mechanism, values)
    return replace(
        mechanism, joints=joints, points=points, bodies=bodies, forces=forces, reduced=reduced
    )


def _changes(
    joint: Joint, values: Mapping[str, Sequence[Scalar]], only: Kind | None = None
) -> dict[str, Any]:
    """Return the new values of a joint's places, of one kind if it is given."""
    return {
        name: values[place][0] if kind is Kind.LENGTH else tuple(values[place])
        for name, kind, _ in joint.parts()
        if (place := f"joints.{joint.name}.{name}") in values and only in (None, kind)
    }


def _move(point: Point, position: Sequence[Scalar] | None) -> Point:
    if position is None:
        return point
    x, y, z = position
    return replace(point, position=(x, y, z))
