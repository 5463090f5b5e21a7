"""The keys of a case file, schema kincheck-case/1: which there are, what each holds, and what it is when left out.

The keys of a joint's geometry, and of a driver, are read off the fields of its class: a new type needs nothing here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, Field, fields
from functools import cache
from typing import Annotated, Any, Literal, get_type_hints

import msgspec
from msgspec import Meta

from ..drivers import Driver
from ..joints import Joint, Kind
from ..mechanism import Vector
from .case import Truth

SCHEMA = "kincheck-case/1"
MOST_SAMPLES = 1_000_000

Text = Annotated[str, Meta(min_length=1, description="a text that is not empty")]
Flag = Annotated[bool, Meta(description="true or false")]
Number = Annotated[float, Meta(description="a number")]
Size = Annotated[float, Meta(ge=0.0, description="a number that is not negative")]
Numbers3 = Annotated[Vector, Meta(description="three numbers [x, y, z]")]
Numbers4 = Annotated[tuple[float, float, float, float], Meta(description="four numbers [e0, e1, e2, e3]")]
Table = Annotated[dict[str, Any], Meta(description="a table")]
Pair = Annotated[tuple[str, str], Meta(description='two names ["first body", "second body"]')]
Truths = Annotated[Truth, Meta(description=f"one of {', '.join(Truth)}")]

_SHAPES: Mapping[Kind, Any] = {
    Kind.POSITION: Vector,
    Kind.DIRECTION: Vector,
    Kind.POSITIONS: tuple[Vector, Vector],
    Kind.DIRECTIONS: tuple[Vector, Vector],
    Kind.LENGTH: float,
}
_OF_DRIVERS: Mapping[Any, Any] = {str: Text, bool: Flag, float: Number, Vector: Numbers3}


class UnitsKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[units] of everything in the file."""

    length: Annotated[Literal["m", "mm"], Meta(description='"m" or "mm"')] = "m"
    angle: Annotated[Literal["rad", "deg"], Meta(description='"rad" or "deg"')] = "rad"


class CaseKeys(msgspec.Struct, forbid_unknown_fields=True):
    """The tables of the file."""

    schema: Annotated[str, Meta(description=f'"{SCHEMA}"')]
    name: Text
    source: Annotated[str, Meta(min_length=1, description="a text that says where the numbers come from")]
    bodies: Table
    drivers: Table
    sweep: Table
    truth: Truths | None = None
    units: Table = {}
    joints: Table = {}
    points: Table = {}
    outputs: Table = {}
    reference: Table | None = None


class BodyKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[bodies.NAME]; the frame is global and aligned unless given."""

    origin: Numbers3 = (0.0, 0.0, 0.0)
    euler_parameters: Numbers4 = (1.0, 0.0, 0.0, 0.0)
    fixed: Flag = False


class PointKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[points.NAME]; global at design."""

    body: Text
    position: Numbers3


class SweepKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[sweep]; start, stop and rate in the driver's unit."""

    driver: Text
    start: Number
    stop: Number
    steps: Annotated[int, Meta(ge=1, le=MOST_SAMPLES, description=f"a whole number of samples, 1 to {MOST_SAMPLES}")]
    rate: Number = 1.0


class OutputKeys(msgspec.Struct, forbid_unknown_fields=True):
    """[outputs.NAME]; component or direction, and a tolerance with its reason."""

    point: Text
    component: Annotated[Literal["x", "y", "z"], Meta(description='"x", "y" or "z"')] | None = None
    direction: Numbers3 | None = None
    relative: Flag = False
    atol: Size | None = None
    rtol: Size | None = None
    why: Text | None = None


@cache
def joint_keys(cls: type[Joint]) -> type[msgspec.Struct]:
    """The keys of a joint of that class: type, bodies and its geometry."""
    keys: list[tuple[str, Any] | tuple[str, Any, Any]] = []
    for each in geometry(cls):
        kind: Kind = each.metadata["kind"]
        shape: Any = Annotated[_SHAPES[kind], Meta(description=kind.value)]
        keys.append((each.name, shape) if each.default is MISSING else (each.name, shape, each.default))
    return msgspec.defstruct(cls.__name__, [("type", Text), ("bodies", Pair), *keys], forbid_unknown_fields=True)


def geometry(cls: type[Joint]) -> list[Field[Any]]:
    """The fields of a joint class that hold geometry, each with its `Kind` as metadata."""
    return [each for each in fields(cls) if "kind" in each.metadata]


@cache
def driver_keys(cls: type[Driver]) -> type[msgspec.Struct]:
    """The keys of a driver of that class: type and its fields."""
    hints = get_type_hints(cls)
    keys: list[tuple[str, Any] | tuple[str, Any, Any]] = [("type", Text)]
    for each in fields(cls):
        if each.name != "name":
            shape = _OF_DRIVERS[hints[each.name]]
            keys.append((each.name, shape) if each.default is MISSING else (each.name, shape, each.default))
    return msgspec.defstruct(cls.__name__, keys, forbid_unknown_fields=True)
