"""Constraints with other names, and with other numbers: those of one structure share a program."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Any, TypeVar, cast

from ...algebra import Scalar, Vec3
from ...kinematics.formulation.constraints import Constraint, Relation
from ...mechanism.mechanism import GROUND
from ...primitives.base import field_names, map_numbers
from ...program.tape import Traced


def coordinates_of(c: Constraint | Relation) -> tuple[str, ...]:
    """Return the names of the coordinates of a constraint."""
    if isinstance(c, Relation):
        return tuple(c.weights)
    return (c.coordinate,) if c.coordinate else ()


def renamed(
    c: Constraint | Relation, owner: str, bodies: Mapping[str, str], coordinates: Sequence[str]
) -> Constraint | Relation:
    """Return a constraint with other names of its owner, bodies and coordinates; bodies without one
    are the ground.
    """
    if isinstance(c, Relation):
        weights = dict(zip(coordinates, c.weights.values(), strict=True))
        return Relation(owner, weights, c.drive, c.curve)
    i, j = (bodies.get(body, GROUND) for body in (c.i, c.j))
    return Constraint(owner, c.primitive, i, j, "".join(coordinates))


def structure(value: Any, numbers: list[Scalar]) -> Hashable:
    """Return all of a value but its numbers, which are appended in order; values of one structure
    can share a program. Whether a vector is zero is part of it.

    The parts of tuples, mappings and data classes are looked into.
    """
    if _is_number(value):
        numbers.append(value)
        return Traced if isinstance(value, Traced) else float
    names, parts = _parts(value)
    if parts is None:
        return value if isinstance(value, Hashable) else id(value)
    found = tuple(structure(part, numbers) for part in parts)
    if isinstance(value, Vec3):
        return Vec3, any(isinstance(x, Traced) or x != 0.0 for x in value)
    return value.__class__, names, found


_Value = TypeVar("_Value")


def with_numbers(value: _Value, numbers: Iterator[Scalar]) -> _Value:
    """Return a value with other numbers, in the order of `structure`."""
    return map_numbers(value, lambda x: next(numbers) if _is_number(x) else x, _is_number)


def _is_number(value: Any) -> bool:
    return isinstance(value, Traced | float | int) and not isinstance(value, bool)


def _parts(value: Any) -> tuple[Sequence[str], Sequence[Any] | None]:
    """Return the names and the parts of a value; no parts of one that is not looked into."""
    if isinstance(value, tuple):
        return (), cast("tuple[Any, ...]", value)
    if isinstance(value, dict):
        named = cast("dict[str, Any]", value)
        return tuple(named), tuple(named.values())
    names = field_names(value.__class__)
    return names or (), None if names is None else [getattr(value, name) for name in names]
