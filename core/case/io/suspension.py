"""Suspension outputs of a case file: the [suspension] table and typed [outputs.NAME], read to
`case.suspension`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, replace
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import msgspec
from msgspec import Meta

from ...algebra import vec
from ...errors import remedy
from ...mechanism.mechanism import Mechanism, Point, Vector
from ..case import Case, Quantity, size
from ..suspension import (
    Axle,
    Convention,
    PerTravel,
    Reaction,
    Side,
    SuspensionOutput,
    Vehicle,
    own_keys,
)
from ..units import Unit
from .document import fault, join, shown
from .reference import Convert
from .schema import Flag, Number, Numbers3, Text, ToleranceKeys
from .tolerance import tolerance
from .travel_driver import require_travel, travel_driver
from .typed_tables import typed

# Axes written to nine digits are perpendicular to about 1e-9; a wrong sign or digit gives far more.
SQUARE = 1e-8


def _one_of(kind: type[StrEnum]) -> Any:
    return Meta(description=f"one of {', '.join(kind)}")


Points = Annotated[tuple[str, str], Meta(description='two names ["first point", "second point"]')]
Rods = Annotated[
    tuple[tuple[str, str], tuple[str, str], tuple[str, str], tuple[str, str]],
    Meta(description='the ends of four rods [["on the body", "on the wheel carrier"], ...]'),
]
Length = Annotated[float, Meta(gt=0.0, description="a positive length")]
Share = Annotated[float, Meta(ge=0.0, le=1.0, description="a part of the whole, 0 to 1")]
Conventions = Annotated[Convention, _one_of(Convention)]
Sides = Annotated[Side, _one_of(Side)]
Axles = Annotated[Axle, _one_of(Axle)]
Reactions = Annotated[Reaction, _one_of(Reaction)]


class SuspensionKeys(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """[suspension]; global at design."""

    convention: Conventions
    side: Sides
    forward: Numbers3
    up: Numbers3
    wheel_center: Text = "wheel_center"
    center_plane: Numbers3 = (0.0, 0.0, 0.0)
    static_toe: Number = 0.0
    static_camber: Number = 0.0
    wheel_radius: Length | None = None
    kingpin: Points | None = None
    kingpin_links: Rods | None = None
    axle: Axles | None = None
    wheelbase: Length | None = None
    cg_height: Length | None = None
    brakes: Reactions = Reaction.OUTBOARD
    brake_share: Share | None = None
    drive: Reactions = Reaction.INBOARD
    drive_share: Share | None = None
    travel: Text | None = None
    per_travel: Flag = True


_LENGTHS = ("wheel_radius", "wheelbase", "cg_height")
_NOT_OF_VEHICLE = ("center_plane", "per_travel", "kingpin_links")


@cache
def output_keys(cls: type[SuspensionOutput]) -> type[msgspec.Struct]:
    """Return the keys of a suspension output class: type, fields, tolerance and its reason."""
    hints = get_type_hints(cls)
    keys: list[Any] = [("type", Text)]
    for each in own_keys(cls):
        shape = _shape_of(hints[each.name])
        keys.append(
            (each.name, shape) if each.default is MISSING else (each.name, shape, each.default)
        )
    return msgspec.defstruct(
        cls.__name__, keys, bases=(ToleranceKeys,), kw_only=True, forbid_unknown_fields=True
    )


def _shape_of(hint: Any) -> Any:
    """Return the annotation of an output's own field: some words, two point names, or a flag."""
    if isinstance(hint, type) and issubclass(hint, StrEnum):
        return Annotated[hint, _one_of(hint)]
    return {tuple[str, str]: Points, bool: Flag}[hint]


@dataclass(frozen=True)
class SuspensionTable:
    """The [suspension] table: the vehicle, and whether outputs get their derivatives by travel."""

    vehicle: Vehicle
    per_travel: bool


def read_suspension(
    file: Path, value: object, case: Case, length: Unit, angle: Convert
) -> SuspensionTable:
    """Read the table, in SI.

    Args:
        case: the case as read so far.

    Raises:
        CaseError: invalid axes, unknown points or drivers, or a wheel on the wrong side.
    """
    keys, mechanism = typed(file, "suspension", value, SuspensionKeys), case.mechanism
    forward, up = (_direction(file, name, getattr(keys, name)) for name in ("forward", "up"))
    if abs(vec(forward) @ vec(up)) > SQUARE:
        found = (
            f"found {shown(keys.up)}, which is not at right angles to forward ="
            f" {shown(keys.forward)}"
        )
        raise fault(
            file,
            "suspension.up",
            f"{found}, expected axes of the vehicle's body; correct one of them",
        )
    for key, name in (
        ("wheel_center", keys.wheel_center),
        *(("kingpin", name) for name in keys.kingpin or ()),
        *(("kingpin_links", name) for rod in keys.kingpin_links or () for name in rod),
    ):
        _check_point(file, join("suspension", key), name, mechanism)
    given: dict[str, Any] = {
        name: each
        for name, each in msgspec.structs.asdict(keys).items()
        if name not in _NOT_OF_VEHICLE
    }
    given |= {name: length(given[name]) for name in _LENGTHS if given[name] is not None}
    given |= {name: angle(given[name]) for name in ("static_toe", "static_camber")}
    if keys.kingpin_links and keys.kingpin:
        problem = "found beside kingpin, expected one of them; remove the other"
        raise fault(file, "suspension.kingpin_links", problem)
    given["kingpin"] = keys.kingpin or keys.kingpin_links
    given["travel"] = travel_driver(file, keys.travel, keys.wheel_center, keys.up, case)
    given |= {"forward": forward, "up": up, "middle": tuple(map(length, keys.center_plane))}
    vehicle = Vehicle(**given)
    _check_side(file, vehicle, mechanism, length)
    return SuspensionTable(vehicle, keys.per_travel)


def _direction(file: Path, key: str, found: Vector) -> Vector:
    if not any(found):
        raise fault(
            file,
            join("suspension", key),
            "found zero, expected a direction; give one of any other length",
        )
    long = math.hypot(*found)
    return found[0] / long, found[1] / long, found[2] / long


def _check_point(file: Path, key: str, name: str, mechanism: Mechanism) -> None:
    known = [point.name for point in mechanism.points]
    if name not in known:
        raise fault(file, key, f"found {shown(name)}, expected a point; {remedy(name, known)}")


def _check_side(file: Path, vehicle: Vehicle, mechanism: Mechanism, length: Unit) -> None:
    """Refuse the most common mistake: hardpoints of one side or of mirrored axes, declared as the
    other side.
    """
    point = mechanism.point(vehicle.wheel_center)
    if mechanism.is_fixed(point.body):
        problem = (
            f"found {shown(point.name)}, which is on {shown(point.body)}, expected a point of a"
            " body that moves"
        )
        raise fault(file, "suspension.wheel_center", f"{problem}; name the centre of the wheel")
    aside = vehicle.outboard @ (vec(point.position) - vec(vehicle.middle))
    if aside <= 0.0:
        problem = (
            f"found {shown(str(vehicle.side))}, but {vehicle.wheel_center!r} is"
            f" {length.written(-aside)} on the other side"
        )
        expected = "expected the side on which it is, looking forward with up upwards"
        raise fault(
            file,
            "suspension.side",
            f"{problem} of the centre plane, {expected}; correct side, forward, up or center_plane",
        )
    ends = [mechanism.point(name).position for name in vehicle.kingpin_points]
    if len(ends) == 2:
        lower, upper = ends
        if vec(vehicle.up) @ (vec(upper) - vec(lower)) <= 0.0:
            found = list(vehicle.kingpin_points)
            problem = f"found {found!r}, the first of which is not the lower"
            raise fault(
                file,
                "suspension.kingpin",
                f"{problem}, expected the lower point, then the upper; give them in this order",
            )


def read_output(
    file: Path,
    key: str,
    cls: type[SuspensionOutput],
    name: str,
    value: object,
    table: SuspensionTable | None,
    case: Case,
    units: Mapping[str, Convert],
) -> SuspensionOutput:
    """Read an output of the given class.

    Args:
        case: the case as read so far.
        units: conversions from the file's units, by SI unit.

    Raises:
        CaseError: an unknown key, a missing input of the type, or a type that this wheel does not
            have.
    """
    if table is None:
        raise fault(
            file,
            "suspension",
            f"missing, expected a table for {key} of type {cls.type!r}; add [suspension]",
        )
    vehicle = table.vehicle
    keys: Any = typed(file, key, value, output_keys(cls))
    for need in cls.needs:
        if getattr(vehicle, need) is None:
            raise fault(
                file,
                join("suspension", need),
                f"missing, expected it for {key} of type {cls.type!r}; add it",
            )
    given = {each.name: getattr(keys, each.name) for each in own_keys(cls)}
    output = cls(
        name,
        vehicle,
        *tolerance(file, key, keys, units[cls.measure], size(case), cls.measure),
        **given,
    )
    if problem := output.problem:
        raise fault(file, key, problem)
    for each in own_keys(cls):
        if isinstance(given[each.name], tuple):  # names of points
            for point in given[each.name]:
                _check_point(file, join(key, each.name), point, case.mechanism)
    require_travel(file, key, output, case)
    return output


def with_slopes(outputs: Sequence[Quantity], size: float) -> tuple[Quantity, ...]:
    """Return the outputs, each suspension output followed by its derivative by travel.

    Args:
        size: size of the mechanism [m]. A pose error changes a slope by about 1 / size times its
            change of the output.
    """
    both: list[Quantity] = []
    for output in outputs:
        both.append(output)
        if isinstance(output, SuspensionOutput):
            both.append(PerTravel(output, output.atol / size))
    return tuple(both)


def with_markers(mechanism: Mechanism, outputs: Sequence[Quantity]) -> Mechanism:
    """Return the mechanism with the points on wheel carriers by which outputs measure rotation."""
    read = {name for output in outputs for name in output.points}
    added: dict[str, Point] = {}
    for output in outputs:
        if isinstance(output, SuspensionOutput):
            center = mechanism.point(output.vehicle.wheel_center)
            places = output.vehicle.marker_positions(center.position)
            added |= {
                name: Point(name, center.body, place)
                for name, place in places.items()
                if name in read
            }
    return replace(mechanism, points=[*mechanism.points, *added.values()]) if added else mechanism
