"""Masses and loads of a mechanism as named places, as its geometry: numbers that can vary.

Names are those of a case file: "bodies.NAME.mass", "bodies.NAME.center_of_mass",
"forces.NAME.stiffness", "forces.NAME.points.0".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, fields
from typing import Any, TypeVar

from ...algebra import Scalar
from ...joints import Kind
from ...mechanism.body import MASS, Body, Dimension, dimension_of
from ...mechanism.loads import ForceElement
from ...mechanism.mechanism import Mechanism

_Part = TypeVar("_Part", Body, ForceElement)


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
    every = [*_of_bodies(mechanism), *_of_forces(mechanism)]
    return {place.name: place for place in every}


def _of_bodies(mechanism: Mechanism) -> Iterator[LoadPlace]:
    for body in mechanism.moving:
        if body.mass != 0.0:
            part = f"bodies.{body.name}"
            yield LoadPlace(part, "mass", (body.mass,), MASS)
            yield LoadPlace(part, "center_of_mass", body.center_of_mass or body.origin, None)


def _of_forces(mechanism: Mechanism) -> Iterator[LoadPlace]:
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
    bodies = [_changed(each, changes.get(f"bodies.{each.name}")) for each in mechanism.bodies]
    forces = [_changed(each, changes.get(f"forces.{each.name}")) for each in mechanism.forces]
    return bodies, forces


def _changed(part: _Part, changes: Mapping[str, Any] | None) -> _Part:
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
