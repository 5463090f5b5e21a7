"""Mechanism and motion of a template: one wheel, or both of an axle with a rack between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path

from ....errors import remedy
from ....joints import Joint, Translational
from ....mechanism.drivers import Driver, JointDisplacement, PointCoordinate
from ....mechanism.mechanism import GROUND, Body, Mechanism, Point, Vector
from ....mechanism.motions import Ramp
from ....trajectory import Array
from ...case import Sweep
from ...io.coordinates import AXES
from ...io.document import fault, shown
from ...suspension import Side
from .templates.base import TIEROD_INNER, WHEEL_CENTER, Template

RACK, RACK_TRAVEL, STROKE = "rack", "rack_travel", "stroke"


class AxleMotion(StrEnum):
    """Motion of an axle: wheels alike, wheels opposed, the rack alone."""

    HEAVE = "heave"
    ROLL = "roll"
    STEER = "steer"


def one_wheel(
    name: str, template: Template, at: Mapping[str, Vector], travel: Array
) -> tuple[Mechanism, Sweep]:
    """Return the mechanism of the left wheel, and its travel up and down.

    Raises:
        MechanismError: the places make no such mechanism.
    """
    joints = template.joints(at)
    drivers = [PointCoordinate(STROKE, WHEEL_CENTER.name, AXES["z"])]
    mechanism = Mechanism(name, _bodies(joints), joints, template.points(at), drivers)
    return mechanism, Sweep(STROKE, travel)


def whole_axle(
    file: Path, said: str, template: Template, at: Mapping[str, Vector], travel: Array
) -> tuple[Mechanism, Sweep]:
    """Return the mechanism of both wheels, the right one being the mirror image of the left, and
    its motion.

    The travel is that of the left wheel up and down, or of the rack to the left and to the right.
    The rack carries the inner joints of the tie rods, and slides along y; without tie rods there is
    none.

    Raises:
        CaseError: an unknown motion, or steering without tie rods.
        MechanismError: the places make no such mechanism.
    """
    if said not in list(AxleMotion):
        raise fault(
            file, "--axle", f"found {shown(said)}, expected a motion; {remedy(said, [*AxleMotion])}"
        )
    steered = TIEROD_INNER.name in at
    if said == AxleMotion.STEER and not steered:
        problem = (
            f"found {said}, but template {template.name} has no tie rod, expected heave or roll"
        )
        raise fault(file, "--axle", f"{problem}; choose one of them")
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
        drivers.append(PointCoordinate(name, name_of(side, WHEEL_CENTER.name), AXES["z"]))
    if steered:
        joints.append(Translational("rack_slide", GROUND, RACK, at[TIEROD_INNER.name], AXES["y"]))
        drivers.append(JointDisplacement(RACK_TRAVEL, "rack_slide"))
    mechanism = Mechanism(file.stem, _bodies(joints), joints, points, drivers)
    if said == AxleMotion.STEER:
        return mechanism, Sweep(RACK_TRAVEL, travel)
    left, right = (name_of(side, STROKE) for side in Side)
    rate = 1.0 if said == AxleMotion.HEAVE else -1.0
    return mechanism, Sweep(left, travel, motions={right: Ramp(rate)})


def name_of(side: Side, name: str) -> str:
    """Return the name of a part of one side of an axle."""
    return f"{side}_{name}"


def of_side(side: Side, place: Vector) -> Vector:
    """Return the place on a side of one that is given on the left."""
    x, y, z = place
    return x, side.left * y, z


def _named(side: Side, joint: Joint, template: Template) -> Joint:
    """Return the joint with the names of a side; the tie rod is on the rack."""
    inner, outer = (
        RACK if body == GROUND and joint.name == template.steered else _body(side, "", body)
        for body in joint.bodies
    )
    return replace(joint, name=name_of(side, joint.name), i=inner, j=outer)


def _body(side: Side, role: str, body: str, *, steered: bool = False) -> str:
    """Return the body of a side; a point on the rack is not the chassis'."""
    if body == GROUND:
        return RACK if steered and role == TIEROD_INNER.name else GROUND
    return name_of(side, body)


def _bodies(joints: Sequence[Joint]) -> list[Body]:
    """Return the moving bodies that joints name."""
    names = dict.fromkeys(name for joint in joints for name in joint.bodies if name != GROUND)
    return [Body(name) for name in names]
