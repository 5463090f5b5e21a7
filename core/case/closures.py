"""Outputs that no closure of a mechanism enters: they follow from the drivers alone."""

from __future__ import annotations

from ..joints.base import unit
from ..mechanism.drivers import JointDriver, PointCoordinate
from ..mechanism.mechanism import GROUND, Mechanism
from .case import Case
from .quantity import Output


def no_output_depends_on_a_closure(case: Case) -> bool:
    """Return whether the mechanism has bodies that a closure moves, and no output reads them.

    An output of the coordinate that is driven reads nothing else either.
    """
    mechanism = case.mechanism
    placed = _placed_by_drivers(mechanism)
    if all(body.name in placed for body in mechanism.moving):
        return False
    driven = [each for each in mechanism.drivers if isinstance(each, PointCoordinate)]
    return all(
        (
            not output.forces  # a force depends on the closures
            and all(mechanism.point(name).body in placed for name in output.points)
        )
        or (
            isinstance(output, Output)
            and any(
                each.point == output.point and tuple(unit(each.direction)) == output.direction
                for each in driven
            )
        )
        for output in case.outputs
    )


def _placed_by_drivers(mechanism: Mechanism) -> set[str]:
    """Return the bodies that joints from the ground place, all of whose freedoms are driven."""
    placed = {GROUND, *(body.name for body in mechanism.bodies if body.fixed)}
    driven = {
        (each.joint, each.freedom) for each in mechanism.drivers if isinstance(each, JointDriver)
    }
    beside: dict[str, list[str]] = {}
    for joint in mechanism.joints:
        moved = sum((joint.name, each) in driven for each in joint.freedoms)
        if (moved or not joint.freedoms) and joint.rows + moved == 6:
            for here, there in (joint.bodies, joint.bodies[::-1]):
                beside.setdefault(here, []).append(there)
    waiting = [*placed]
    while waiting:
        new = [body for body in beside.get(waiting.pop(), ()) if body not in placed]
        placed.update(new)
        waiting += new
    return placed
