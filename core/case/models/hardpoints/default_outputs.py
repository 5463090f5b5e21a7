"""Suspension outputs of a case of hardpoints: all outputs defined by its points and template; and
the rows of its table as hardpoints of the case.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ....algebra import vec
from ....dual_numbers import Slope, derivatives
from ....kinematics import places
from ....mechanism.mechanism import Mechanism, Vector
from ...case import Case, Hardpoint, Quantity, size
from ...io.document import fault
from ...io.outputs import default, with_all_coordinates, with_slopes
from ...quantity import with_markers
from ...suspension import Convention, Side, SuspensionOutput, Vehicle
from ...suspension.corner import MARKER_DISTANCE
from ...suspension.wheel import Place
from .axle import STROKE, AxleMotion, Car, name_of, read_length
from .table import Axes, HardpointTable
from .templates import WHEEL_AXIS, WHEEL_CENTER, WHEEL_CONTACT, Template

WHEEL = ("toe", "camber")
STEERING_AXIS = ("caster", "kingpin_inclination")
ON_THE_ROAD = ("roll_center_height",)
AXIS_ON_THE_ROAD = ("scrub_radius", "mechanical_trail")
AXLE = ("track", "roll_angle", "axle_roll_center_height", "axle_roll_center_offset")
ACKERMANN = ("ackermann",)
RADII = (0.02, 3.0)
"""Radii of wheels [m], from model cars to haulage trucks."""


@dataclass(frozen=True)
class Wheel:
    """The wheel of a table of hardpoints.

    Attributes:
        radius: distance from the centre to the road in the wheel plane [m]; None if unknown.
        toe, camber: angles at design, unless a point gives the axis of rotation [rad].
        by_points: whether points give the axis and the radius.
    """

    radius: float | None
    toe: float
    camber: float
    by_points: tuple[bool, bool]


def wheel_of(
    table: HardpointTable,
    named: Mapping[str, str],
    at: Mapping[str, Vector],
    radius: str | None,
) -> Wheel:
    """Return the wheel; its radius and axis follow from points if the table has them.

    Args:
        named: names of the points in the file, by role.
        at: positions by role [m].
        radius: the radius from the user [m].

    Raises:
        CaseError: a length is unusable or contradicts the points, or the axis points inboard.
    """
    center = at[WHEEL_CENTER]
    if WHEEL_AXIS in at and at[WHEEL_AXIS][1] <= center[1]:
        raise fault(
            table.file,
            named[WHEEL_AXIS],
            f"found a point inboard of {named[WHEEL_CENTER]}, expected one outboard;"
            " mirror it at the wheel's centre",
        )
    contact = at.get(WHEEL_CONTACT)
    measured = None if contact is None else math.dist(center, contact)
    if radius is not None and measured is not None:
        raise fault(
            table.file,
            "--wheel-radius",
            f"found {radius}, and the point {named[WHEEL_CONTACT]}, expected one of them;"
            " leave out --wheel-radius",
        )
    given = read_length(table.file, "wheel-radius", radius) if measured is None else measured
    if given is not None and not RADII[0] <= given <= RADII[1]:
        where = "--wheel-radius" if measured is None else named[WHEEL_CONTACT]
        raise fault(
            table.file,
            where,
            f"found a wheel's radius of {given:.6g} m, expected {RADII[0]:g} to {RADII[1]:g} m;"
            " correct it",
        )
    by_points = WHEEL_AXIS in at, contact is not None
    toe, camber = (0.0, 0.0) if by_points[0] else (table.static_toe, table.static_camber)
    return Wheel(given, toe, camber, by_points)


def far_out(at: Mapping[str, Vector]) -> float:
    """Return the factor from the distance of the given point of the wheel's axis to the distance of
    markers from the wheel's centre: directions then keep all digits of positions.
    """
    axis = at.get(WHEEL_AXIS)
    return 1.0 if axis is None else MARKER_DISTANCE / math.dist(at[WHEEL_CENTER], axis)


def with_axis(at: Mapping[str, Vector], far: float) -> Mapping[str, Vector]:
    """Return the positions by role with the point of the wheel's axis so many times as far out."""
    if WHEEL_AXIS not in at:
        return at
    center = vec(at[WHEEL_CENTER])
    place = center + far * (vec(at[WHEEL_AXIS]) - center)
    return {**at, WHEEL_AXIS: (place.x, place.y, place.z)}


def with_suspension_outputs(
    case: Case,
    template: Template,
    wheel: Wheel,
    car: Car,
    at: Mapping[str, Vector],
    motion: str | None,
    *,
    steered: bool = False,
) -> Case:
    """Return the case with the suspension outputs, their slopes, and the coordinates of the
    template's watched points.

    Args:
        motion: motion of both wheels; None for one wheel.
        steered: whether the rack moves during the wheel's travel.
    """
    axle = motion is not None
    extent = size(case)
    outputs: list[Quantity] = []
    watched: list[str] = []
    travel = tuple(name_of(each, STROKE) for each in Side) if axle else (STROKE,) * steered
    vehicles = [
        replace(_vehicle(side, template, wheel, car, axle), travel=travel)
        for side in (Side if axle else [Side.LEFT])
    ]
    for vehicle in vehicles:
        prefix = f"{vehicle.side}_" if axle else ""
        for name, cls, own in _types(template, wheel, car, at):
            ends = {key: tuple(prefix + each for each in own[key]) for key in own if key != "at"}
            given = default(extent, cls.measure)
            outputs.append(cls(prefix + name, vehicle, *given, **{**own, **ends}))
        watched += [prefix + role for role in template.watched]
    if axle and wheel.radius is not None:
        turning = steered or motion == AxleMotion.STEER
        names = [*AXLE, *(ACKERMANN if car.wheelbase and turning else ())]
        for name in names:
            cls = SuspensionOutput.registry[name]
            given = default(extent, cls.measure)
            beside: Mapping[str, Any] = {"other": vehicles[1]}
            outputs.append(cls(name, vehicles[0], *given, **beside))
    outputs += with_all_coordinates(case, watched).outputs
    return replace(
        case,
        mechanism=with_markers(case.mechanism, outputs),
        outputs=with_slopes(outputs, extent),
    )


def _vehicle(side: Side, template: Template, wheel: Wheel, car: Car, axle: bool) -> Vehicle:
    """Return the vehicle with the wheel of a side."""
    prefix, (axis, contact) = f"{side}_" if axle else "", wheel.by_points
    kingpin: list[Any] = [
        prefix + each if isinstance(each, str) else tuple(prefix + end for end in each)
        for each in template.kingpin
    ]
    return Vehicle(
        convention=Convention.ISO_8855,
        side=side,
        forward=(1.0, 0.0, 0.0),
        up=(0.0, 0.0, 1.0),
        wheel_center=prefix + WHEEL_CENTER,
        static_toe=wheel.toe,
        static_camber=wheel.camber,
        wheel_axis=prefix + WHEEL_AXIS if axis else None,
        wheel_radius=wheel.radius,
        wheel_contact=prefix + WHEEL_CONTACT if contact else None,
        axle=car.position,
        wheelbase=car.wheelbase,
        cg_height=car.cg_height,
        brake_share=car.brake_share,
        drive_share=car.drive_share,
        kingpin=tuple(kingpin) or None,
    )


def _types(
    template: Template, wheel: Wheel, car: Car, at: Mapping[str, Vector]
) -> Iterator[tuple[str, type[SuspensionOutput], Mapping[str, Any]]]:
    """Yield name, class and own fields of each defined output."""
    types = [*WHEEL]
    if template.kingpin:
        types += STEERING_AXIS
    if wheel.radius is not None:
        types += [*ON_THE_ROAD, *(AXIS_ON_THE_ROAD if template.kingpin else ())]
        types += car.anti_outputs
    for name in types:
        yield name, SuspensionOutput.registry[name], {}
    place = Place.WHEEL_CENTER if wheel.radius is None else Place.CONTACT
    yield "half_track_change", SuspensionOutput.registry["half_track_change"], {"at": place}
    for name, ends in template.springs.items():
        if all(role in at for role in ends):
            yield name, SuspensionOutput.registry["motion_ratio"], {"between": ends}


def hardpoints_of(
    named: Mapping[str, str],
    at: Mapping[str, Vector],
    axes: Axes,
    mechanism_at: Callable[[Mapping[str, Vector]], Mechanism],
) -> tuple[Hardpoint, ...]:
    """Return a hardpoint for each row that fills a role.

    The template itself states what follows: its mechanism is made once more, of positions with
    their derivatives by the coordinates of the rows. Places are linear in positions.

    Args:
        named: names of the rows by role.
        at: positions by role [m], axes of the case.
        axes: of the table.
        mechanism_at: makes the mechanism from positions by role.
    """
    rows = list(dict.fromkeys(named.values()))
    by_table = np.zeros((len(rows), 3, 3 * len(rows)))
    for row, seeds in enumerate(by_table):
        for column, (k, sign) in enumerate(axes):
            seeds[k, 3 * row + column] = sign
    moving: dict[str, Any] = {
        role: tuple(
            Slope(x, seed) for x, seed in zip(place, by_table[rows.index(named[role])], strict=True)
        )
        for role, place in at.items()
    }
    found = places(mechanism_at(moving))
    slopes = {
        place: np.array([np.broadcast_to(derivatives(x), by_table.shape[2]) for x in value])
        for place, value in found.items()
    }
    return tuple(
        Hardpoint(
            name,
            tuple(role for role, filled in named.items() if filled == name),
            {
                place: each[:, 3 * row : 3 * row + 3]
                for place, each in slopes.items()
                if each[:, 3 * row : 3 * row + 3].any()
            },
        )
        for row, name in enumerate(rows)
    )
