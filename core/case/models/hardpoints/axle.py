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
from ...io.document import decimal, fault, shown, unknown_name
from ...io.outputs import AXES
from ...io.schema import MOST_SAMPLES
from ...suspension import Side
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
                f"found {shown(travel)}, expected METRES or METRES:SAMPLES, 2 to {MOST_SAMPLES} of"
                f" them, or START:STOP:SAMPLES, up to {FARTHEST:g} m; say --travel 0.05 for 50 mm"
                " up and down",
            )
        wheel = ends
    ends = None if rack is None else _interval(rack.split(":"))
    if rack is not None and ends is None:
        raise fault(
            file,
            "--rack",
            f"found {shown(rack)}, expected METRES or START:STOP, up to {FARTHEST:g} m; say --rack"
            " 0.04 for 40 mm to the right, then to the left",
        )
    return Travels(np.linspace(*wheel, samples), ends)


def _interval(parts: Sequence[str]) -> tuple[float, float] | None:
    """Return the ends of METRES, which goes both ways, or of START:STOP; None for another text."""
    try:
        numbers = [decimal(each) for each in parts]
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


def one_wheel(
    file: Path, template: Template, at: Mapping[str, Vector], travels: Travels
) -> tuple[Mechanism, Sweep]:
    """Return the mechanism of the left wheel and its motion: up and down, with the rack if it
    moves.

    Raises:
        CaseError: the rack moves, and there are no tie rods.
        MechanismError: the places do not fit the mechanism.
    """
    joints = [*template.joints(at)]
    drivers: list[Driver] = [PointCoordinate(STROKE, WHEEL_CENTER, AXES["z"])]
    motions: dict[str, Motion] = {}
    if travels.rack is not None:
        _require_tie_rod(file, "--rack", "a travel", template)
        joints = [
            replace(joint, i=RACK) if joint.name == template.steered else joint for joint in joints
        ]
        slide, driver = _rack(at)
        joints.append(slide)
        drivers.append(driver)
        motions[RACK_TRAVEL] = travels.of_rack
    mechanism = Mechanism(file.stem, _bodies(joints), joints, template.points(at), drivers)
    return mechanism, Sweep(STROKE, travels.wheel, motions=motions)


def whole_axle(
    file: Path, said: str, template: Template, at: Mapping[str, Vector], travels: Travels
) -> tuple[Mechanism, Sweep]:
    """Return the mechanism of both wheels, and its motion. The right side mirrors the left.

    The left wheel travels up and down, or the rack to the left and to the right. The rack carries
    the inner joints of the tie rods, and slides along y. Without tie rods there is no rack.

    Raises:
        CaseError: an unknown motion, or steering without tie rods.
        MechanismError: the places do not fit the mechanism.
    """
    if said not in list(AxleMotion):
        raise unknown_name(file, "--axle", said, [*AxleMotion], "a motion")
    steered = bool(template.steered)
    if said == AxleMotion.STEER:
        _require_tie_rod(file, "--axle", said, template)
    if travels.rack is not None:
        _require_tie_rod(file, "--rack", "a travel", template)
    joints: list[Joint] = []
    points: list[Point] = []
    drivers: list[Driver] = []
    for side in Side:
        places = {role: of_side(side, place) for role, place in at.items()}
        joints += [_named(side, joint, template) for joint in template.joints(places)]
        points += [
            Point(
                name_of(side, point.name),
                _body(side, point.name, point.body, steered=steered),
                point.position,
            )
            for point in template.points(places)
        ]
        name = name_of(side, STROKE)
        drivers.append(PointCoordinate(name, name_of(side, WHEEL_CENTER), AXES["z"]))
    if steered:
        slide, driver = _rack(at)
        joints.append(slide)
        drivers.append(driver)
    mechanism = Mechanism(file.stem, _bodies(joints), joints, points, drivers)
    if said == AxleMotion.STEER:
        if travels.rack is not None:
            problem = "found it beside --axle steer, whose --travel is that of the rack"
            raise fault(file, "--rack", f"{problem}, expected one of them; leave it out")
        return mechanism, Sweep(RACK_TRAVEL, travels.wheel)
    left, right = (name_of(side, STROKE) for side in Side)
    motions: dict[str, Motion] = {right: Ramp(1.0 if said == AxleMotion.HEAVE else -1.0)}
    if travels.rack is not None:
        motions[RACK_TRAVEL] = travels.of_rack
    return mechanism, Sweep(left, travels.wheel, motions=motions)


def _require_tie_rod(file: Path, option: str, said: str, template: Template) -> None:
    if not template.steered:
        problem = f"found {said}, but template {template.name} has no tie rod"
        expected = "expected heave or roll" if option == "--axle" else "expected none"
        raise fault(file, option, f"{problem}, {expected}; leave out the steering")


def _rack(at: Mapping[str, Vector]) -> tuple[Joint, Driver]:
    """Return the slide of the rack along y, and its driver."""
    slide = Translational(SLIDE, GROUND, RACK, at[TIEROD_INNER], AXES["y"])
    return slide, JointDisplacement(RACK_TRAVEL, SLIDE)


def name_of(side: Side, name: str) -> str:
    """Return the name of a part of one side of an axle."""
    return f"{side}_{name}"


def of_side(side: Side, place: Vector) -> Vector:
    """Return the place on a side for a place on the left."""
    x, y, z = place
    return x, side.left * y, z


def _named(side: Side, joint: Joint, template: Template) -> Joint:
    """Return the joint with the names of a side; the tie rod joins the rack."""
    inner, outer = (
        RACK if body == GROUND and joint.name == template.steered else _body(side, "", body)
        for body in joint.bodies
    )
    return replace(joint, name=name_of(side, joint.name), i=inner, j=outer)


def _body(side: Side, role: str, body: str, *, steered: bool = False) -> str:
    """Return the body of a role on a side; the rack for the inner joint of a steered tie rod."""
    if body == GROUND:
        return RACK if steered and role == TIEROD_INNER else GROUND
    return name_of(side, body)


def _bodies(joints: Sequence[Joint]) -> list[Body]:
    """Return the moving bodies named by joints."""
    names = dict.fromkeys(name for joint in joints for name in joint.bodies if name != GROUND)
    return [Body(name) for name in names]
