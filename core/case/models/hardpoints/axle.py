"""Mechanism and motion of a template: one wheel, or both of an axle with a rack between them; and
the travels that options state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np

from ....joints import Joint, Translational
from ....mechanism.mechanism import GROUND, Body, Mechanism, Point, Vector
from ....mechanism.motions import Driver, JointDisplacement, Motion, PointCoordinate, Ramp, Table
from ....trajectory import Array
from ...case import Sweep
from ...io.document import fault, interval, shown, unknown_name
from ...io.outputs import AXES
from ...io.schema import MOST_SAMPLES
from ...suspension import Side
from ...units import LENGTHS
from .templates import TIEROD_INNER, WHEEL_CENTER, Template

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
    wheel, samples = (-TRAVEL, TRAVEL), SAMPLES
    if travel is not None:
        parts = travel.split(":")
        count = parts.pop() if len(parts) > 1 else str(SAMPLES)
        ends = _interval(parts)
        with suppress(ValueError):
            samples = int(count)
        if ends is None or ends[0] == ends[1] or not 1 < samples <= MOST_SAMPLES:
            raise fault(
                file,
                "--travel",
                f"found {shown(travel)}, expected a length such as 50mm, or LENGTH:SAMPLES, 2 to"
                f" {MOST_SAMPLES} of them, or START:STOP:SAMPLES, up to {FARTHEST:g} m, in metres"
                " unless a unit is given; say --travel 50mm for 50 mm up and down",
            )
        wheel = ends
    ends = None if rack is None else _interval(rack.split(":"))
    if rack is not None and ends is None:
        raise fault(
            file,
            "--rack",
            f"found {shown(rack)}, expected a length such as 40mm, or START:STOP, up to"
            f" {FARTHEST:g} m, in metres unless a unit is given; say --rack 40mm for 40 mm to the"
            " right, then to the left",
        )
    return Travels(np.linspace(*wheel, samples), ends)


def _interval(parts: Sequence[str]) -> tuple[float, float] | None:
    """Return the ends of LENGTH, which goes both ways, or of START:STOP; None for another text."""
    try:
        numbers, _ = interval(parts, LENGTHS, "m")
    except ValueError:
        return None
    if len(numbers) == 1 and numbers[0] > 0.0:
        numbers = [-numbers[0], numbers[0]]
    if len(numbers) != 2 or not all(abs(each) <= FARTHEST for each in numbers):
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
    if said is not None and said not in list(AxleMotion):
        raise unknown_name(file, "--axle", said, [*AxleMotion], "a motion")
    steering = said == AxleMotion.STEER
    if (steering or travels.rack is not None) and not template.steered:
        option, what, expected = (
            ("--axle", said, "heave or roll") if steering else ("--rack", "a travel", "none")
        )
        problem = f"found {what}, but template {template.name} has no tie rod"
        raise fault(file, option, f"{problem}, expected {expected}; leave out the steering")
    if steering and travels.rack is not None:
        problem = "found it beside --axle steer, whose --travel is that of the rack"
        raise fault(file, "--rack", f"{problem}, expected one of them; leave it out")
    racked = bool(template.steered) and (said is not None or travels.rack is not None)
    sides = sides_of(said, side)
    joints: list[Joint] = []
    points: list[Point] = []
    drivers: list[Driver] = []
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
