"""The conditions of a mechanism, written independently of the solver: full products of vectors, in
extended precision, without simplification.

They share only the meaning of a joint's fields with the tested primitives, rows and programs. A
joint consists of a few rows. A row is a sum of terms of four kinds, minus a constant: the value at
design, or zero. Here a and b are directions fixed in bodies i and j, and d leads from a point of
body i to a point of body j; all move with the bodies.

    dot     a . b
    slide   a . d
    rod     (d . d - L^2) / 2 L
    turn    the angle from i to j about h

Lengths are measured in a unit near the mechanism's size, so a row is about as large as its
violation. A turn is an arc tangent plus the full turns that bring it nearest to a given angle.
"""

from __future__ import annotations

from typing import Any

from ....errors import KincheckError
from ....mechanism.mechanism import Mechanism
from ....mechanism.motions import JointDriver, PointCoordinate
from .constraint_rows import Conditions, Writer
from .joint_conditions import JOINTS
from .long_double import extended, unit


class NotStatedError(KincheckError):
    """A joint or driver has no conditions here."""


def conditions(mechanism: Mechanism) -> Conditions:
    """Return the rows of all joints, couplers and drivers.

    Raises:
        NotStatedError: a joint or driver of an unknown type.
    """
    writer = Writer(mechanism)
    for joint in mechanism.joints:
        stated = JOINTS.get(joint.type)
        if stated is None:
            raise NotStatedError(
                f"{joint}: the stress truth has no conditions for this type; known:"
                f" {', '.join(JOINTS)}"
            )
        stated(writer, joint)
    for coupler in mechanism.couplers:
        if coupler.curve:
            raise NotStatedError(
                f"{coupler}: the stress truth has no polynomial conditions; use a linear coupler"
            )
        row = writer.row(coupler.name)
        largest = max(
            abs(k) * (writer.unit if f == "translation" else 1.0) for f, k in _weights(coupler)
        )
        for name, (freedom, k) in zip(coupler.joints, _weights(coupler), strict=True):
            metres = writer.unit if freedom == "translation" else 1.0
            writer.coordinate(row, mechanism.joint(name), freedom, k * metres / largest)
    driven: list[tuple[int, float]] = []
    for driver in mechanism.drivers:
        row = writer.row(driver.name)
        if isinstance(driver, PointCoordinate):
            point = mechanism.point(driver.point)
            direction = unit(extended(driver.direction))
            writer.slide(
                row, 0, writer.index(point.body), direction, point.position, point.position
            )
            driven.append((row, 1.0 / writer.unit))
        elif isinstance(driver, JointDriver):
            writer.coordinate(row, mechanism.joint(driver.joint), driver.freedom, 1.0)
            driven.append((row, 1.0 if driver.turns else 1.0 / writer.unit))
        else:
            raise NotStatedError(
                f"driver {driver.name!r} ({driver.type}): the stress truth cannot drive it"
            )
    return writer.finished(driven)


def _weights(coupler: Any) -> list[tuple[str, float]]:
    return list(zip(coupler.freedoms, coupler.weights, strict=True))
