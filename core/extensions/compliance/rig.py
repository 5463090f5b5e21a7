"""The wheels of a suspension on a rig: the places and directions of its loads.

A load is positive along the axes of the case's convention (ISO 8855: x forward, y to the left, z
up; SAE J670: y to the right, z down), or along the global axes if the case has no [suspension]:

    lateral       force along y at the contact
    longitudinal  driving force along x: at the wheel's centre if the vehicle's body carries the
                  drive's torque (an inboard drive, the default), else at the contact
    braking       force against x: at the contact if the wheel carrier carries the brake's torque
                  (outboard brakes, the default), else at the wheel's centre
    aligning      torque about z

The wheel is locked to its carrier, which carries both points along.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...case.case import Case
from ...errors import KincheckError
from ...mechanism.mechanism import Mechanism, Point, Vector
from ...mechanism.motions import PointCoordinate
from ...trajectory import Array
from ..hardpoints.suspension import Convention, Reaction, SuspensionOutput, Vehicle
from .section import Load, Rig, rig_of

PER: Mapping[Load, str] = {
    Load.LONGITUDINAL: ".per_longitudinal_force",
    Load.LATERAL: ".per_lateral_force",
    Load.BRAKING: ".per_braking_force",
    Load.ALIGNING: ".per_aligning_torque",
}
"""Suffixes of slopes by a load, as `PER_TRAVEL`."""
CONTACT, CENTER = "contact", "center"
CENTERS = ("wheel_center", "wheel_centre")
PATCHES = ("contact_patch", "wheel_contact")
# The direction of a driver that lifts the wheel, against the vertical: further off it is another.
UPRIGHT = 0.5


@dataclass(frozen=True, eq=False)
class Wheel:
    """A wheel on the rig; places and directions are global at design.

    Attributes:
        name: before the names of its load points; empty for the only wheel.
        body: its carrier.
        point: its centre's name.
        spin: axis of rotation, outboard [-].
        travel: held driver of the height of its centre.
        lift: sense of the driver, 1 up and -1 down.
        axes: x, y, z of the convention, shape (3, 3).
    """

    name: str
    body: str
    point: str
    center: Vector
    contact: Vector
    spin: Vector
    travel: str
    lift: float
    axes: Array
    vehicle: Vehicle | None

    @property
    def points(self) -> list[Point]:
        """The places of its loads."""
        places = ((CONTACT, self.contact), (CENTER, self.center))
        return [Point(f"{self.name}{what}", self.body, place) for what, place in places]

    def unit(self, load: Load) -> tuple[str, Array]:
        """Return the load point of a load, and the force and torque of its unit, shape (6,)."""
        x, y, z = self.axes
        drive = Reaction.INBOARD if self.vehicle is None else self.vehicle.drive
        brakes = Reaction.OUTBOARD if self.vehicle is None else self.vehicle.brakes
        place, force, torque = {
            Load.LATERAL: (CONTACT, y, 0.0 * z),
            Load.ALIGNING: (CONTACT, 0.0 * x, z),
            Load.LONGITUDINAL: (CONTACT if drive is Reaction.OUTBOARD else CENTER, x, 0.0 * z),
            Load.BRAKING: (CONTACT if brakes is Reaction.OUTBOARD else CENTER, -x, 0.0 * z),
        }[load]
        return f"{self.name}{place}", np.concatenate([force, torque])


def held_drivers(case: Case, rig: Rig, soft: Mechanism) -> tuple[str, ...]:
    """Return the held drivers.

    Raises:
        KincheckError: a joint with bushings has one.
    """
    left = [driver.name for driver in soft.drivers]
    for name in rig.held or ():
        if name not in left:
            raise KincheckError(
                f"{case.name}: driver {name!r} is held, and its joint gives way to bushings. Leave"
                " it out of held, or drive another joint"
            )
    return rig.held if rig.held is not None else tuple(left)


def wheels_of(case: Case, held: Sequence[str], soft: Mechanism) -> list[Wheel]:
    """Return the wheels of a case: one, or the two of an axle.

    Raises:
        KincheckError: the case does not tell the wheel's place, or nothing holds its height.
    """
    rig = rig_of(case)
    vehicles = _vehicles(case)
    if rig.wheel is not None and vehicles:
        on_body = [v for v in vehicles if soft.point(v.wheel_center).body == rig.wheel]
        vehicles = on_body[:1]
    if not vehicles:
        return [_wheel("", None, case, rig, held, soft)]
    names = [f"{each.side}_" if len(vehicles) > 1 else "" for each in vehicles]
    return [
        _wheel(name, each, case, rig, held, soft)
        for name, each in zip(names, vehicles, strict=True)
    ]


def _vehicles(case: Case) -> list[Vehicle]:
    """Return the wheels of the case's outputs by their centres, the left one first."""
    found: dict[str, Vehicle] = {each.wheel_center: each for each in case.wheels}
    for output in case.outputs:
        if isinstance(output, SuspensionOutput):
            for each in output.vehicles:
                found.setdefault(each.wheel_center, each)
    return sorted(found.values(), key=lambda each: each.side.value)


def _wheel(
    name: str, vehicle: Vehicle | None, case: Case, rig: Rig, held: Sequence[str], soft: Mechanism
) -> Wheel:
    points = {point.name: point for point in soft.points}
    lifts = [d for d in map(soft.driver, held) if isinstance(d, PointCoordinate)]
    if vehicle is not None:
        center = points[vehicle.wheel_center]
    else:
        known = [points[each] for each in CENTERS if each in points]
        driven = [points[d.point] for d in lifts]
        on_wheel = [p for p in (*known, *driven) if rig.wheel in (None, p.body)]
        if not on_wheel:
            raise KincheckError(
                f"{case.name}: no point is the wheel's centre. Add [suspension], or a point"
                " 'wheel_center' of the wheel's carrier"
            )
        center = on_wheel[0]
    up = np.array([0.0, 0.0, 1.0] if vehicle is None else vehicle.up)
    travels = [
        d
        for d in lifts
        if soft.point(d.point).body == center.body
        and abs(up @ np.array(d.direction)) > UPRIGHT * np.linalg.norm(d.direction)
    ]
    if not travels:
        raise KincheckError(
            f"{case.name}: no held driver lifts the wheel of {center.body!r}. Add a driver of type"
            f" point_coordinate at {center.name!r}, and name it in [compliance] held"
        )
    spin = (
        (0.0, 1.0 if center.position[1] >= 0.0 else -1.0, 0.0)
        if vehicle is None
        else tuple(vehicle.spin(case.mechanism))
    )
    contact = _contact(name, case, rig, vehicle, center.position, spin, up)
    forward = np.array([1.0, 0.0, 0.0] if vehicle is None else vehicle.forward)
    axes = np.array([forward, np.cross(up, forward), up])
    if vehicle is not None and vehicle.convention is not Convention.ISO_8855:
        axes[1:] *= -1.0
    at = next((d for d in travels if d.point == center.name), travels[0])
    lift = float(np.sign(up @ np.array(at.direction)))
    places = center.body, center.name, center.position, contact, spin
    return Wheel(name, *places, at.name, lift, axes, vehicle)


def _contact(
    name: str,
    case: Case,
    rig: Rig,
    vehicle: Vehicle | None,
    center: Vector,
    spin: Sequence[float],
    up: Array,
) -> Vector:
    points = {point.name: point.position for point in case.mechanism.points}
    if rig.contact is not None and (vehicle is None or not name):
        return points[rig.contact]
    if vehicle is not None and vehicle.wheel_contact is not None:
        return points[vehicle.wheel_contact]
    if vehicle is not None and vehicle.wheel_radius is not None:
        s = np.array(spin)
        rise = up - (up @ s) * s
        x, y, z = (np.array(center) - vehicle.wheel_radius * rise / np.linalg.norm(rise)).tolist()
        return x, y, z
    for each in PATCHES:
        if each in points and not name:
            return points[each]
    raise KincheckError(
        f"{case.name}: no point is where the wheel touches the road. Give [compliance] contact ="
        " POINT, or [suspension] wheel_radius"
    )
