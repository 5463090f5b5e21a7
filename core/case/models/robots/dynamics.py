"""Springs and dampers of URDF and SDF: <dynamics> of a joint, and Drake's between two points.

Motion does not need them: what makes no sense is left out, and counted.
"""

from __future__ import annotations

from collections.abc import Mapping

from ...io.document import decimal, usable
from ..mjcf.elements import Element
from .robot import Robot, Spring
from .values import numbers_of, only_child

FRICTION = ("friction", "drake:rotor_inertia", "drake:gear_ratio")
"""Forces of joints without a place in a mechanism."""


def add_urdf_damper(robot: Robot, joint: Element) -> None:
    """Add the damper of a joint of URDF."""
    for dynamics in joint.only("dynamics"):
        if joint.attributes.get("type") in ("revolute", "continuous", "prismatic"):
            _add(robot, joint.attributes["name"], dynamics.attributes)
        else:
            robot.count("dynamics of joints")


def add_sdf_spring(robot: Robot, coordinate: str, axis: Element) -> None:
    """Add the spring and damper of an axis of SDF."""
    for dynamics in axis.only("dynamics"):
        _add(robot, coordinate, {child.tag: child.text for child in dynamics.children})


def _add(robot: Robot, coordinate: str, values: Mapping[str, str]) -> None:
    def number(name: str) -> float:
        value = decimal(values.get(name) or "0")
        if not usable(value):
            raise ValueError(name)
        return value

    try:
        if any(map(number, FRICTION)):
            robot.count("friction and rotors of joints")
        law = number("spring_stiffness"), number("damping")
        if min(law) < 0.0:
            raise ValueError(coordinate)
        if any(law):
            robot.springs[coordinate] = Spring(*law, number("spring_reference"))
    except ValueError:
        robot.count("dynamics of joints")


def strut_spring(element: Element) -> Spring:
    """Return the spring of Drake's element between two points.

    Raises:
        CaseError: a number is missing, or makes no sense.
    """
    values: list[float] = []
    for each in ("stiffness", "damping", "free_length"):
        child = only_child(element, f"{element.tag}_{each}")
        values += (0.0,) if child is None else numbers_of(child, (1,))
    stiffness, damping, length = values
    if min(stiffness, damping, length) < 0.0:
        raise element.fault("has a negative number, expected positive ones; correct it")
    return Spring(stiffness, damping, length)
