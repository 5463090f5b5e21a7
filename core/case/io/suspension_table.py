"""The [suspension] table of a case file: the vehicle around a wheel or an axle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from ...algebra import vec
from ...mechanism.mechanism import Mechanism
from ..case import Case
from ..suspension import Axle, Convention, Reaction, Side, Vehicle
from ..units import Unit
from .document import fault, join, shown, unknown_name
from .in_si import direction
from .reference_columns import Convert
from .schema import Flag, Number, Numbers3, Text
from .travel_driver import travel_driver
from .typed_tables import typed

# Axes with nine digits are perpendicular to about 1e-9; a wrong sign or digit gives a far larger
# error.
SQUARE = 1e-8


def one_of(kind: type[StrEnum]) -> Any:
    """Return the description of the words of an enumeration."""
    return Meta(description=f"one of {', '.join(kind)}")


Points = Annotated[tuple[str, str], Meta(description='two names ["first point", "second point"]')]
Rods = Annotated[
    tuple[tuple[str, str], tuple[str, str], tuple[str, str], tuple[str, str]],
    Meta(description='the ends of four rods [["on the body", "on the wheel carrier"], ...]'),
]
Length = Annotated[float, Meta(gt=0.0, description="a positive length")]
Share = Annotated[float, Meta(ge=0.0, le=1.0, description="a part of the whole, 0 to 1")]
Conventions = Annotated[Convention, one_of(Convention)]
Sides = Annotated[Side, one_of(Side)]
Axles = Annotated[Axle, one_of(Axle)]
Reactions = Annotated[Reaction, one_of(Reaction)]


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
    wheel_axis: Text | None = None
    wheel_radius: Length | None = None
    wheel_contact: Text | None = None
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
    other: dict[str, Any] | None = None


class OtherWheelKeys(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """[suspension.other]: the axle's other wheel; omitted keys are equal to the first wheel's."""

    wheel_center: Text
    static_toe: Number | None = None
    static_camber: Number | None = None
    wheel_axis: Text | None = None
    wheel_contact: Text | None = None
    kingpin: Points | None = None
    kingpin_links: Rods | None = None
    travel: Text | None = None


_LENGTHS = ("wheel_radius", "wheelbase", "cg_height")
_NOT_OF_VEHICLE = ("center_plane", "per_travel", "kingpin_links", "travel", "other")


@dataclass(frozen=True)
class SuspensionTable:
    """The [suspension] table.

    Attributes:
        vehicle: the vehicle with the wheel of the table.
        per_travel: whether outputs get their derivatives by travel.
        other: the vehicle with the axle's other wheel, if the table has it.
    """

    vehicle: Vehicle
    per_travel: bool
    other: Vehicle | None = None


def read_suspension(
    file: Path, value: object, case: Case, length: Unit, angle: Convert
) -> SuspensionTable:
    """Read the table, in SI.

    Args:
        case: the case read so far.

    Raises:
        CaseError: invalid axes, unknown points or drivers, or a wheel on the wrong side.
    """
    keys, mechanism = typed(file, "suspension", value, SuspensionKeys), case.mechanism
    forward, up = (
        direction(file, join("suspension", name), getattr(keys, name)) for name in ("forward", "up")
    )
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
    given: dict[str, Any] = {
        name: each
        for name, each in msgspec.structs.asdict(keys).items()
        if name not in _NOT_OF_VEHICLE
    }
    given |= {name: length(given[name]) for name in _LENGTHS if given[name] is not None}
    given |= {name: angle(given[name]) for name in ("static_toe", "static_camber")}
    given["kingpin"] = _kingpin(file, "suspension", keys, mechanism)
    given |= {"forward": forward, "up": up, "middle": tuple(map(length, keys.center_plane))}
    vehicle = Vehicle(**given)
    _check_side(file, "suspension", vehicle, mechanism, length)
    vehicle = _with_points(file, "suspension", vehicle, mechanism)
    travel = travel_driver(file, "suspension", keys.travel, vehicle, case)
    if keys.other is None:
        alone = [travel] == list(case.sweep.path.motions)
        named = () if travel is None or alone else (travel,)
        return SuspensionTable(replace(vehicle, travel=named), keys.per_travel)
    key = "suspension.other"
    of_other = typed(file, key, keys.other, OtherWheelKeys)
    toe, camber = of_other.static_toe, of_other.static_camber
    other = replace(
        vehicle,
        side=Side.RIGHT if vehicle.side is Side.LEFT else Side.LEFT,
        wheel_center=of_other.wheel_center,
        kingpin=_kingpin(file, key, of_other, mechanism),
        static_toe=vehicle.static_toe if toe is None else angle(toe),
        static_camber=vehicle.static_camber if camber is None else angle(camber),
        wheel_axis=of_other.wheel_axis,
        wheel_radius=keys.wheel_radius and vehicle.wheel_radius,
        wheel_contact=of_other.wheel_contact,
    )
    _check_side(file, key, other, mechanism, length)
    other = _with_points(file, key, other, mechanism)
    beside = travel_driver(file, key, of_other.travel, other, case)
    both = () if travel is None or beside is None else (travel, beside)
    return SuspensionTable(
        replace(vehicle, travel=both), keys.per_travel, replace(other, travel=both)
    )


def _kingpin(
    file: Path, key: str, keys: SuspensionKeys | OtherWheelKeys, mechanism: Mechanism
) -> tuple[str, str] | tuple[tuple[str, str], ...] | None:
    """Return the points of the steering axis, and check them and the wheel's centre."""
    rods = keys.kingpin_links
    for name, point in (
        ("wheel_center", keys.wheel_center),
        *(("kingpin", point) for point in keys.kingpin or ()),
        *(("kingpin_links", point) for rod in rods or () for point in rod),
    ):
        check_point(file, join(key, name), point, mechanism)
    if rods and keys.kingpin:
        problem = "found beside kingpin, expected one of them; remove the other"
        raise fault(file, join(key, "kingpin_links"), problem)
    return keys.kingpin or rods


def _with_points(file: Path, key: str, vehicle: Vehicle, mechanism: Mechanism) -> Vehicle:
    """Return the vehicle with the radius by the point of the wheel's contact, after checks of this
    point and of that of the axis: on the wheel carrier, instead of numbers.
    """
    carrier = mechanism.point(vehicle.wheel_center).body
    angles = vehicle.static_toe or vehicle.static_camber
    for name, given, numbers in (
        ("wheel_axis", bool(angles), "static_toe and static_camber"),
        ("wheel_contact", vehicle.wheel_radius is not None, "wheel_radius"),
    ):
        if (point := getattr(vehicle, name)) is None:
            continue
        where = join(key, name)
        check_point(file, where, point, mechanism)
        if given:
            problem = f"found beside {numbers}, expected one of them"
            raise fault(file, where, f"{problem}; remove the other")
        if (body := mechanism.point(point).body) != carrier:
            problem = f"found {shown(point)}, which is on {shown(body)}, expected a point of"
            raise fault(file, where, f"{problem} the wheel carrier {shown(carrier)}; name one")
    if vehicle.wheel_axis is not None and vehicle.aside(mechanism) <= 0.0:
        problem = f"found {shown(vehicle.wheel_axis)}, which is not outboard of the wheel's centre"
        where = join(key, "wheel_axis")
        raise fault(file, where, f"{problem}, expected a point that is; name another")
    radius = vehicle.radius(mechanism)
    if radius == 0.0:
        problem = f"found {shown(vehicle.wheel_contact)}, which is at the wheel's centre"
        where = join(key, "wheel_contact")
        raise fault(file, where, f"{problem}, expected a point at the road; name another")
    return replace(vehicle, wheel_radius=radius)


def check_point(file: Path, key: str, name: str, mechanism: Mechanism) -> None:
    """Refuse a name without a point."""
    known = [point.name for point in mechanism.points]
    if name not in known:
        raise unknown_name(file, key, name, known, "a point")


def _check_side(file: Path, key: str, vehicle: Vehicle, mechanism: Mechanism, length: Unit) -> None:
    """Refuse the most common mistake: hardpoints of the other side, or in mirrored axes."""
    point = mechanism.point(vehicle.wheel_center)
    if mechanism.is_fixed(point.body):
        problem = (
            f"found {shown(point.name)}, which is on {shown(point.body)}, expected a point of a"
            " body that moves"
        )
        raise fault(file, join(key, "wheel_center"), f"{problem}; name the centre of the wheel")
    aside = vehicle.outboard @ (vec(point.position) - vec(vehicle.middle))
    if aside <= 0.0:
        problem = (
            f"found {shown(str(vehicle.side))}, but {vehicle.wheel_center!r} is"
            f" {length.written(-aside)} on the other side"
        )
        expected = "expected the side on which it is, looking forward with up upwards"
        raise fault(
            file,
            join(key, "side"),
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
                join(key, "kingpin"),
                f"{problem}, expected the lower point, then the upper; give them in this order",
            )
