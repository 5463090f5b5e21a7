"""Keys of joints, couplers, drivers, motions and force elements: the fields of their classes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields
from functools import cache
from typing import Annotated, Any, Literal, TypeAlias, get_type_hints

import msgspec
from msgspec import Meta

from ...joints import Coupler, Joint, Kind
from ...mechanism.drivers import Driver
from ...mechanism.loads import ForceElement
from ...mechanism.mechanism import Vector
from ...mechanism.motions import Motion
from .schema import Bodies, Flag, Joints, Number, Numbers, Numbers3, Table, Text

_SHAPES: Mapping[Kind, Any] = {
    Kind.POSITION: Vector,
    Kind.DIRECTION: Vector,
    Kind.POSITIONS: tuple[Vector, Vector],
    Kind.DIRECTIONS: tuple[Vector, Vector],
    Kind.LENGTH: float,
}
_OF_FIELDS: Mapping[Any, Any] = {
    str: Text,
    bool: Flag,
    float: Number,
    Vector: Numbers3,
    tuple[float, ...]: Numbers,
}

_LISTS: Mapping[Any, Any] = {
    "tuple[float, ...]": Numbers,
    "tuple[str, str]": Annotated[
        tuple[Literal["rotation", "translation"], Literal["rotation", "translation"]],
        Meta(description='two of "rotation", "translation", of the first and second joint'),
    ],
}
"""Shape of a coupler's field with several values, by its annotation."""

Described: TypeAlias = Joint | Coupler | Driver | Motion | ForceElement
_Keys = list[tuple[str, Any] | tuple[str, Any, Any]]
_INHERITED = {each.name for base in (Joint, Coupler, Driver, Motion) for each in fields(base)}


@cache
def joint_keys(cls: type[Joint] | type[Coupler]) -> type[msgspec.Struct]:
    """Return the keys of a joint class: type, its two bodies or joints, and its geometry."""
    keys: _Keys = [
        ("type", Text),
        ("joints", Joints) if issubclass(cls, Coupler) else ("bodies", Bodies),
    ]
    for each in own_fields(cls):
        keys.append(key_of(each, shape_of(each)))
    return msgspec.defstruct(cls.__name__, keys, forbid_unknown_fields=True, kw_only=True)


@cache
def driver_keys(cls: type[Driver]) -> type[msgspec.Struct]:
    """Return the keys of a driver class: type, its fields, and its motion."""
    return _keys_of_fields(cls, ("motion", Table | None, None))


@cache
def motion_keys(cls: type[Motion]) -> type[msgspec.Struct]:
    """Return the keys of a motion class: type and its fields."""
    return _keys_of_fields(cls)


def own_fields(cls: type[Described]) -> list[Field[Any]]:
    """Return the fields of a class itself, without the fields of its kind; case files give them."""
    return [
        each
        for each in fields(cls)
        if each.name not in _INHERITED and not each.metadata.get("hidden")
    ]


def kind_of(each: Field[Any]) -> Kind | None:
    """Return the kind of a joint's field; None for a plain number."""
    return each.metadata.get("kind")


def _keys_of_fields(
    cls: type[Driver] | type[Motion], *more: tuple[str, Any, Any]
) -> type[msgspec.Struct]:
    hints = get_type_hints(cls)
    keys: _Keys = [
        ("type", Text),
        *(key_of(each, _OF_FIELDS[hints[each.name]]) for each in own_fields(cls)),
        *more,
    ]
    return msgspec.defstruct(cls.__name__, keys, forbid_unknown_fields=True)


def shape_of(each: Field[Any]) -> Any:
    """Return the shape of a geometric field, or of a plain number."""
    kind = kind_of(each)
    if kind is None:
        return _LISTS.get(each.type, Number)
    return Annotated[_SHAPES[kind], Meta(description=kind.value)]


def key_of(each: Field[Any], shape: Any) -> tuple[str, Any] | tuple[str, Any, Any]:
    """Return the key of a field: name, shape, and the default, if any."""
    return (each.name, shape) if each.default is MISSING else (each.name, shape, each.default)
