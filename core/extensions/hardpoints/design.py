"""Mechanism and motion of a template, one wheel or both of an axle with a rack between them; and of
its case the vehicle, the outputs defined by its points, template and options, and the rows of its
table as hardpoints.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np

from ...algebra import vec
from ...case.case import Case, Hardpoint, Quantity, Sweep, size
from ...case.io.document import decimal, fault, interval, measure, require_known, shown
from ...case.io.outputs import default, with_all_coordinates
from ...case.io.schema import MOST_SAMPLES
from ...case.quantity import AXES, with_markers
from ...case.units import LENGTHS
from ...joints import Joint, Translational
from ...kinematics import places
from ...mechanism.mechanism import GROUND, Body, Mechanism, Point, Vector
from ...mechanism.motions import Driver, JointDisplacement, Motion, PointCoordinate, Ramp, Table
from ...trajectory import Array
from ..slopes.slopes import Slope, derivatives
from .options import WheelOptions
from .suspension import SWING_ARMS, Axle, Convention, Side, SuspensionOutput, Vehicle
from .suspension.corner import MARKER_DISTANCE
from .suspension.wheel import Place
from .suspension_section import with_slopes
from .table import Axes, HardpointTable
from .templates import TIEROD_INNER, WHEEL_AXIS, WHEEL_CENTER, WHEEL_CONTACT, Template

# The middle of the wheel travel of passenger cars, which is about 0.08 m each way; samples every
# 2.5 mm.
TRAVEL, SAMPLES = 0.05, 41
# No wheel and no rack of the largest lorry goes so far: a larger number is in millimetres.
FARTHEST = 1.0


@dataclass(frozen=True, eq=False)
class Travels:
    """Travels over the samples [m].

    Attributes:
        wheel: upward travel of the wheel, or of the left wheel of an axle, or travel of the rack
            alone in steering; shape (n,).
        rack: travel of the rack to the left at the first and at the last sample, linear in the
            wheel's travel; None if the rack stands still.
    """

    wheel: Array
    rack: tuple[float, float] | None = None

    @property
    def of_rack(self) -> Motion:
        """Return the motion of the rack; its time is the wheel's travel."""
        assert self.rack is not None
        (low, high), (first, last) = (self.wheel[0], self.wheel[-1]), self.rack
        if first * high == last * low:
            return Ramp(float(last / high if high else first / low))
        return Table((float(low), float(high)), (first, last))


def read_travels(file: Path, travel: str | None, rack: str | None) -> Travels:
    """Return the travels given by options; by default, the travel of a passenger car's wheel.

    Raises:
        CaseError: an option is not a travel.
    """
    wheel = np.linspace(-TRAVEL, TRAVEL, SAMPLES)
    if travel is not None:
        wheel = travel_samples(file, travel, SAMPLES)
    ends = None if rack is None else _interval(rack.split(":"), FARTHEST)
    if rack is not None and (ends is None or ends[0] == ends[1]):
        raise fault(
            file,
            "--rack",
            f"found {shown(rack)}, expected a length such as 40mm, or START:STOP, up to"
            f" {FARTHEST:g} m, in metres unless a unit is given. Say --rack 40mm for 40 mm to the"
            " right, then to the left",
        )
    return Travels(wheel, ends)


def travel_samples(
    file: Path, text: str, count: int, *, still: bool = False, farthest: float = FARTHEST
) -> Array:
    """Return the samples of the option --travel: LENGTH:SAMPLES up and down, or
    START:STOP:SAMPLES, in metres without a unit.

    Args:
        count: number of samples, unless the text says one.
        still: whether one place is a travel too.
        farthest: longest travel [m].

    Raises:
        CaseError: the text is no travel.
    """
    *parts, last = text.split(":")
    counted = bool(parts) and last.strip().isdecimal()
    ends = _interval(parts if counted else [*parts, last], farthest)
    if counted and len(parts) == 1 and ends == (0.0, 0.0):
        ends = None
    place = ends is not None and ends[0] == ends[1]
    samples = int(last) if counted else 1 if place else count
    if ends is None or (place and not still) or not 2 - still <= samples <= MOST_SAMPLES:
        limit = f", up to {farthest:g} m" if np.isfinite(farthest) else ""
        raise fault(
            file,
            "--travel",
            f"found {shown(text)}, expected a length such as 50mm, or LENGTH:SAMPLES, 2 to"
            f" {MOST_SAMPLES} of them, or START:STOP:SAMPLES{limit}, in metres unless a unit"
            f" ({', '.join(LENGTHS)}) is given. Say --travel 50mm for 50 mm up and down"
            f"{', or --travel=20mm:20mm:1 for one place' * still}",
        )
    return np.linspace(*ends, samples)


def _interval(parts: Sequence[str], farthest: float) -> tuple[float, float] | None:
    """Return the ends of LENGTH, which goes both ways, or of START:STOP; None for another text."""
    try:
        numbers, _ = interval(parts, LENGTHS, "m")
    except ValueError:
        return None
    if len(numbers) == 1 and numbers[0] >= 0.0:
        numbers = [0.0 - numbers[0], numbers[0]]
    if len(numbers) != 2 or not all(abs(each) <= farthest for each in numbers):
        return None
    return numbers[0], numbers[1]


RACK, SLIDE, RACK_TRAVEL, STROKE = "rack", "rack_slide", "rack_travel", "stroke"


class AxleMotion(StrEnum):
    """Motion of an axle: both wheels in the same direction, in opposite directions, or the rack
    alone.
    """

    HEAVE = "heave"
    ROLL = "roll"
    STEER = "steer"


def sides_of(said: str | None, side: Side) -> dict[str, int]:
    """Return 1 for the left and -1 for the right side by the prefix of its names: of the one wheel,
    or of both of an axle.
    """
    return {"": side.left} if said is None else {f"{side}_": side.left for side in Side}


def mechanism_of(
    file: Path,
    said: str | None,
    template: Template,
    at: Mapping[str, Vector],
    travels: Travels,
    side: Side,
) -> tuple[Mechanism, Sweep]:
    """Return the mechanism of a template and its motion.

    The wheel travels up and down, with the rack if it moves. The right side mirrors the left; of an
    axle, and both wheels travel, or the rack to the left and to the right. The rack carries the
    inner joints of the tie rods, and slides along y. Without tie rods there is no rack.

    Args:
        said: motion of both wheels of an axle; None for one wheel.
        at: positions by role of a left wheel, or of the mirror image of a right one [m].
        side: of the one wheel.

    Raises:
        CaseError: an unknown motion, or the rack moves and there are no tie rods.
        MechanismError: the places do not fit the mechanism.
    """
    require_known(file, "--axle", said, AxleMotion, "a motion")
    steering = said == AxleMotion.STEER
    if (steering or travels.rack is not None) and not template.steered:
        option, what, expected = (
            ("--axle", said, "heave or roll") if steering else ("--rack", "a travel", "none")
        )
        problem = f"found {what}, but template {template.name} has no tie rod"
        raise fault(file, option, f"{problem}, expected {expected}. Leave out the steering")
    if steering and travels.rack is not None:
        problem = "found it beside --axle steer, whose --travel is that of the rack"
        raise fault(file, "--rack", f"{problem}, expected one of them. Leave it out")
    racked = bool(template.steered) and (said is not None or travels.rack is not None)
    sides = sides_of(said, side)
    joints = list[Joint]()
    points = list[Point]()
    drivers = list[Driver]()
    for prefix, left in sides.items():
        places = {role: (x, left * y, z) for role, (x, y, z) in at.items()}
        for joint in template.joints(places):
            ground = RACK if racked and joint.name == template.steered else GROUND
            i, j = (ground if each == GROUND else prefix + each for each in joint.bodies)
            joints.append(replace(joint, name=prefix + joint.name, i=i, j=j))
        for point in template.points(places):
            body = GROUND if point.body == GROUND else prefix + point.body
            points.append(Point(prefix + point.name, body, point.position))
        drivers.append(PointCoordinate(prefix + STROKE, prefix + WHEEL_CENTER, AXES["z"]))
    strokes = [driver.name for driver in drivers]
    if racked:
        x, y, z = at[TIEROD_INNER]
        middle = (x, sides.get("", 1) * y, z)
        joints.append(Translational(SLIDE, GROUND, RACK, middle, AXES["y"]))
        points += [Point(RACK, RACK, middle)] * steering
        drivers.append(JointDisplacement(RACK_TRAVEL, SLIDE))
    names = dict.fromkeys(name for joint in joints for name in joint.bodies if name != GROUND)
    bodies = [Body(name) for name in names]
    mechanism = Mechanism(file.stem, bodies, joints, points, drivers)
    if steering:
        return mechanism, Sweep(RACK_TRAVEL, travels.wheel)
    ways: dict[str, Motion] = {
        name: Ramp(1.0 if said == AxleMotion.HEAVE else -1.0) for name in strokes[1:]
    }
    if travels.rack is not None:
        ways[RACK_TRAVEL] = travels.of_rack
    return mechanism, Sweep(strokes[0], travels.wheel, motions=ways)


OF_WHEEL = (
    *("caster", "kingpin_inclination", "roll_center_height", "jacking_coefficient"),
    *("scrub_radius", "mechanical_trail", "wheelbase_change"),
    *("anti_dive", "anti_lift", "anti_squat"),
)
OF_AXLE = ("track", "roll_angle", "axle_roll_center_height", "axle_roll_center_offset")
WHILE_STEERING = ("ackermann", "ackermann_angles", "turning_circle")
OF_STEERING = ("mean_steer_angle", "steering_ratio")
"""Types of outputs in the order of tables."""
RADII = (0.02, 3.0)
WHEELBASES, HEIGHTS, TURNS = (0.1, 20.0), (0.005, 6.0), (1e-3, 1.0)
"""Radii of wheels, wheelbases, heights of the centre of gravity and rack travels per turn [m], from
model cars to haulage trucks.
"""


def vehicle_of(
    table: HardpointTable,
    template: Template,
    named: Mapping[str, str],
    at: Mapping[str, Vector],
    supplied: WheelOptions,
    side: Side,
) -> Vehicle:
    """Return the vehicle around the wheel; the wheel's radius and axis follow from points if
    the table has them.

    Args:
        named: names of the points in the file, by role.
        at: positions by role of a left wheel, or of the mirror image of a right one [m].

    Raises:
        CaseError: a length is unusable or contradicts the points, the axis points inboard, or an
            option is not a length, a share, or an axle.
    """
    file, center = table.file, at[WHEEL_CENTER]
    axis, contact, radius = at.get(WHEEL_AXIS), at.get(WHEEL_CONTACT), supplied.wheel_radius
    if axis is not None and axis[1] <= center[1]:
        raise fault(
            file,
            named[WHEEL_AXIS],
            f"found a point inboard of {named[WHEEL_CENTER]}, expected one outboard."
            " Mirror it at the wheel's centre",
        )
    if contact is not None and radius is not None:
        raise fault(
            file,
            "--wheel-radius",
            f"found {radius}, and the point {named[WHEEL_CONTACT]}, expected one of them."
            " Leave out --wheel-radius",
        )
    size = math.dist(center, contact) if contact else _length(file, "wheel-radius", radius, RADII)
    if contact is not None:
        _require_within(file, named[WHEEL_CONTACT], size, RADII)
    position = supplied.position
    require_known(file, "--position", position, Axle, "an axle")
    return Vehicle(
        convention=Convention.ISO_8855,
        side=side,
        forward=(1.0, 0.0, 0.0),
        up=(0.0, 0.0, 1.0),
        wheel_center=WHEEL_CENTER,
        static_toe=0.0 if axis else table.static_toe,
        static_camber=0.0 if axis else table.static_camber,
        wheel_axis=WHEEL_AXIS if axis else None,
        wheel_radius=size,
        wheel_contact=WHEEL_CONTACT if contact else None,
        axle=None if position is None else Axle(position),
        wheelbase=_length(file, "wheelbase", supplied.wheelbase, WHEELBASES),
        cg_height=_length(file, "cg-height", supplied.cg_height, HEIGHTS),
        rack_per_turn=_length(file, "rack-per-turn", supplied.rack_per_turn, TURNS),
        brake_share=_share(file, "brake-share", supplied.brake_share),
        drive_share=_share(file, "drive-share", supplied.drive_share),
        kingpin=template.kingpin or None,
    )


def _length(file: Path, option: str, text: str | None, limits: tuple[float, float]) -> float | None:
    """Return the length stated by an option [m]."""
    if text is None:
        return None
    try:
        found, _ = measure(text, LENGTHS, "m")
    except ValueError:
        raise fault(
            file,
            f"--{option}",
            f"found {shown(text)}, expected a length. Say --{option} 0.3 or 300mm",
        ) from None
    _require_within(file, f"--{option}", found, limits)
    return found


def _require_within(
    file: Path, where: str, size: float | None, limits: tuple[float, float]
) -> None:
    least, most = limits
    if size is not None and not least <= size <= most:
        unit = f", or say its unit: {size:.6g}mm" if least <= 1e-3 * size <= most else ""
        problem = f"found {size:.6g} m, expected a length of {least:g} to {most:g} m"
        raise fault(file, where, f"{problem}. Correct it{unit}")


def _share(file: Path, option: str, text: str | None) -> float | None:
    if text is None:
        return None
    try:
        found = decimal(text)
    except ValueError:
        found = float("nan")
    if not 0.0 <= found <= 1.0:
        raise fault(
            file,
            f"--{option}",
            f"found {shown(text)}, expected the part of a force, 0 to 1. Say --{option} 0.6",
        )
    return found


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
    vehicle: Vehicle,
    at: Mapping[str, Vector],
    motion: str | None,
    *,
    steered: bool = False,
    swing_arms: bool = False,
) -> Case:
    """Return the case with the suspension outputs, their slopes, and the coordinates of the
    template's watched points.

    Args:
        vehicle: the vehicle around the wheel.
        motion: motion of both wheels; None for one wheel.
        steered: whether the rack moves during the wheel's travel.
        swing_arms: whether instant centres and swing arms are among them.
    """
    extent, types = size(case), SuspensionOutput.registry
    outputs = list[Quantity]()
    watched = list[str]()

    def add(name: str, kind: str, wheel: Vehicle, **own: Any) -> None:
        """Add an output if the vehicle's data define it."""
        cls = types[kind]
        if all(getattr(wheel, need) is not None for need in cls.needs):
            output = cls(name, wheel, *default(extent, cls.measure), **own)
            outputs.extend([output] * (not output.problem))

    vehicles = {"": replace(vehicle, travel=(STROKE,) * steered)}
    if motion is not None:
        vehicles = {f"{side}_": _on_side(vehicle, side) for side in Side}
    place = Place.WHEEL_CENTER if vehicle.wheel_radius is None else Place.CONTACT
    arms = [each.type for each in SWING_ARMS] * swing_arms
    for prefix, wheel in vehicles.items():
        for kind in ("toe", "camber", *arms, *OF_WHEEL):
            add(prefix + kind, kind, wheel)
        add(f"{prefix}half_track_change", "half_track_change", wheel, at=place)
        for name, ends in template.springs.items():
            if at.keys() >= {*ends}:
                between = tuple(prefix + role for role in ends)
                add(prefix + name, "motion_ratio", wheel, between=between)
        for name, roles in template.twists.items():
            if at.keys() >= {*roles}:
                about = tuple(prefix + role for role in roles[:3])
                add(prefix + name, "twist", wheel, about=about)
        watched += [prefix + role for role in template.watched]
    if motion is not None:
        left, right = vehicles.values()
        for name, ends in template.across.items():
            if at.keys() >= {*ends}:
                between = tuple(f"{side}_{role}" for side, role in zip(Side, ends, strict=True))
                # heave does not move an unlike pair of ends: one wheel travels, the other is held
                alone = left if len({*ends}) == 1 else replace(left, travel=left.travel[:1])
                add(name, "motion_ratio", alone, between=between)
        steering = motion == AxleMotion.STEER
        turned = WHILE_STEERING * (steering or steered)
        for kind in (*OF_AXLE, *turned, *OF_STEERING * steering):
            own = {"rack": RACK} if kind == "steering_ratio" else {}
            add(kind, kind, left, other=right, **own)
    outputs += with_all_coordinates(case, watched).outputs
    return replace(
        case,
        mechanism=with_markers(case.mechanism, outputs),
        outputs=with_slopes(outputs, extent),
    )


def _on_side(vehicle: Vehicle, side: Side) -> Vehicle:
    """Return the vehicle with the names of a side of an axle."""
    prefix = f"{side}_"
    kingpin: Any = tuple(
        prefix + each if isinstance(each, str) else tuple(prefix + end for end in each)
        for each in vehicle.kingpin or ()
    )
    return replace(
        vehicle,
        side=side,
        wheel_center=prefix + vehicle.wheel_center,
        wheel_axis=vehicle.wheel_axis and prefix + vehicle.wheel_axis,
        wheel_contact=vehicle.wheel_contact and prefix + vehicle.wheel_contact,
        kingpin=kingpin or None,
        travel=tuple(f"{each}_{STROKE}" for each in Side),
    )


def hardpoints_of(
    named: Mapping[str, str],
    at: Mapping[str, Vector],
    axes: Axes,
    mechanism_at: Callable[[Mapping[str, Vector]], Mechanism],
    shims: Mapping[str, Array],
    no_bump_steer: Mapping[str, Array],
) -> tuple[Hardpoint, ...]:
    """Return a hardpoint for each row that fills a role.

    The template itself states what follows: its mechanism is made once more, of positions with
    their derivatives by the coordinates of the rows. Places are linear in positions.

    Args:
        named: names of the rows by role.
        at: positions by role [m], axes of the case.
        axes: of the table.
        mechanism_at: makes the mechanism from positions by role.
        shims: derivatives of toe, camber and caster by role and axes of the case.
        no_bump_steer: moves of the tie rod's ends that leave none, by role and axes of the case.
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
    hardpoints = list[Hardpoint]()
    for row, name in enumerate(rows):
        roles = tuple(role for role, filled in named.items() if filled == name)
        own = {place: each[:, 3 * row : 3 * row + 3] for place, each in slopes.items()}
        moves = {place: each for place, each in own.items() if each.any()}
        along, signs = zip(*axes, strict=True)
        shim = moved = None
        if turned := [shims[role] for role in roles if role in shims]:
            shim = np.sum(turned, axis=0)[:, along] * signs
        if roles[0] in no_bump_steer and len(roles) == 1:
            moved = no_bump_steer[roles[0]][..., along] * signs
        hardpoints.append(Hardpoint(name, roles, at[roles[0]], axes, moves, shim, moved))
    return tuple(hardpoints)
