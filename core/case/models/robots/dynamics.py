"""Springs and dampers of URDF and SDF: <dynamics> of a joint, and Drake's between two points.

Motion does not need them: what makes no sense is left out, and counted.
"""

from __future__ import annotations

from collections.abc import Mapping

from ...io.document import decimal, usable
from ..mjcf.elements import Element
from .robot import Robot, Spring
from .values import require_children, value_of

FRICTION = ("friction", "drake:rotor_inertia", "drake:gear_ratio")
"""Forces of joints without a place in a mechanism."""
LAW = ("damping", "spring_stiffness", "spring_reference")
"""Those that have one."""
STRUT_LAW = ("stiffness", "damping", "free_length")
"""What Drake's element between two points has of its own."""


def add_urdf_damper(robot: Robot, joint: Element) -> None:
    """Add the damper of a joint of URDF."""
    for dynamics in joint.only("dynamics"):
        dynamics.require_known((*LAW, *FRICTION), "URDF")
        if joint.attributes.get("type") in ("revolute", "continuous", "prismatic"):
            _add(robot, joint.attributes["name"], dynamics.attributes)
        else:
            robot.count("dynamics of joints")


def add_sdf_spring(robot: Robot, coordinate: str, axis: Element) -> None:
    """Add the spring and damper of an axis of SDF."""
    for dynamics in axis.only("dynamics"):
        require_children(dynamics, (*LAW, *FRICTION), closed=True)
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
    stiffness, damping, length = (
        value_of(element, f"{element.tag}_{each}", 1)[0] for each in STRUT_LAW
    )
    if min(stiffness, damping, length) < 0.0:
        raise element.fault("has a negative number, expected positive ones; correct it")
    return Spring(stiffness, damping, length)
