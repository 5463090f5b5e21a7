"""Joints and drivers as objects of Exudyn; private to its adapter.

Rows of Exudyn, measured on version 1.13.6 against rotation matrices; markers 0 and 1 are at p0 and
p1, d = p1 - p0:

    object                  constrained axes            rows
    generic joint           some translations           those of x0 . d, y0 . d, z0 . d
                            all translations            d, global
                            rotations x, y              z0 . x1, z0 . y1
                            rotations x, y, z           z0 . y1, z0 . x1, x0 . y1
                            rotation z                  x0 . y1
    revolute joint Z                                    d, z0 . x1, z0 . y1
    prismatic joint X                                   y0 . d, z0 . d, z0 . y1, z0 . x1, x0 . y1

A free axis of a generic joint gives an empty row, which is dropped.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...core import joints
from ...core.joints.base import unit
from ...core.mechanism.mechanism import GROUND
from ...core.mechanism.motions import (
    Driver,
    JointAngle,
    JointDisplacement,
    JointDriver,
    PointCoordinate,
)
from ..shared.poses import frame_along
from .equations import ABOUT_X, ABOUT_Y, ABOUT_Z, Equations, X, Y, Z


def _generic(*axes: int, along: int = 2) -> Callable[[Equations, Any], None]:
    """Return the function for a joint that is a generic joint with these constrained axes; the
    joint's axis is x (0), y or z of the frame.
    """

    def add(rows: Equations, joint: Any) -> None:
        rows.connect_generic(
            rows.markers(
                joint, getattr(joint, "point", (0.0, 0.0, 0.0)), frame_along(joint.axis, along)
            ),
            axes,
        )

    return add


def _spherical(rows: Equations, joint: joints.Spherical | joints.ConstantVelocity) -> None:
    rows.connect(
        rows.items.ObjectJointSpherical(markerNumbers=rows.markers(joint, joint.point)), range(3)
    )


def _revolute(rows: Equations, joint: joints.Revolute) -> None:
    markers = rows.markers(joint, joint.point, frame_along(joint.axis, 2))
    rows.connect(rows.items.ObjectJointRevoluteZ(markerNumbers=markers), range(5))


def _translational(rows: Equations, joint: joints.Translational) -> None:
    markers = rows.markers(joint, joint.point, frame_along(joint.axis, 0))
    rows.connect(rows.items.ObjectJointPrismaticX(markerNumbers=markers), range(5))


def _universal(rows: Equations, joint: joints.Universal) -> None:
    _cross(rows, joint, joint.point, (X, Y, Z, ABOUT_Z))


def _perpendicular_axes(rows: Equations, joint: joints.PerpendicularAxes) -> None:
    _cross(rows, joint, (0.0, 0.0, 0.0), (ABOUT_Z,))


def _cross(
    rows: Equations,
    joint: joints.Universal | joints.PerpendicularAxes,
    point: Sequence[float],
    axes: Sequence[int],
) -> None:
    # The last row is x0 . y1, the cosine of the cross: an angle rounded by a table is kept.
    first, second = joint.axes
    markers = [
        rows.marker(joint.i, point, frame_along(first, 0)),
        rows.marker(joint.j, point, frame_along(second, 1)),
    ]
    rows.connect_generic(markers, axes, keeps=unit(first) @ unit(second))


def _constant_velocity(rows: Equations, joint: joints.ConstantVelocity) -> None:
    _spherical(rows, joint)
    h, k = (np.array(tuple(unit(axis))) for axis in joint.axes)
    first = frame_along(joint.axes[0], 2)
    # The shortest rotation from h to k is two reflections, in the planes normal to h and to h + k.
    between = (h + k) / np.linalg.norm(h + k)
    second = first - 2.0 * np.outer(between, between @ first)
    second[:, 2] = k
    i, j = rows.marker(joint.i, joint.point, first), rows.marker(joint.j, joint.point, second)
    # x0 . y1 - x1 . y0 stays zero: both products follow the same unknown, which prevents twist
    product, common = float(first[:, 0] @ second[:, 1]), rows.unknown()
    for markers in ((i, j), (j, i)):
        rows.follow(rows.connect_generic(markers, (ABOUT_Z,), keeps=product), common)


def _distance(rows: Equations, joint: joints.Distance) -> None:
    _rod(rows, joint, joint.rod_length)


def _revolute_spherical(rows: Equations, joint: joints.RevoluteSpherical) -> None:
    link = np.subtract(joint.points[1], joint.points[0])
    _rod(rows, joint, float(np.linalg.norm(link)))
    frame = frame_along(joint.axis, 0)
    markers = [
        rows.marker(body, point, frame)
        for body, point in zip(joint.bodies, joint.points, strict=True)
    ]
    rows.connect_generic(markers, (X,), keeps=float(frame[:, 0] @ link))


def _rod(rows: Equations, joint: joints.Distance | joints.RevoluteSpherical, length: float) -> None:
    markers = [
        rows.marker(body, point) for body, point in zip(joint.bodies, joint.points, strict=True)
    ]
    rows.connect(
        rows.items.ObjectConnectorDistance(markerNumbers=markers, distance=length), range(1)
    )


def _fixed(rows: Equations, joint: joints.Fixed) -> None:
    point = rows.bodies[joint.j][1] if joint.point is None else joint.point
    rows.connect_generic(rows.markers(joint, point), range(6))


def _orientation_lock(rows: Equations, joint: joints.OrientationLock) -> None:
    rows.connect_generic(rows.markers(joint, (0.0, 0.0, 0.0)), (ABOUT_X, ABOUT_Y, ABOUT_Z))


def _point_coordinate(rows: Equations, driver: PointCoordinate) -> int:
    point, frame = rows.mechanism.point(driver.point), frame_along(driver.direction, 0)
    return rows.connect_generic(
        [rows.marker(body, point.position, frame) for body in (GROUND, point.body)], (X,)
    )


def _joint_driver(rows: Equations, driver: JointDriver) -> int:
    return rows.coordinate(driver.joint, driver.freedom)


# By exact type: a subclass may have another meaning.
JOINTS: Mapping[type[joints.Joint], Callable[[Equations, Any], None]] = {
    joints.ConstantVelocity: _constant_velocity,
    joints.Cylindrical: _generic(X, Y, ABOUT_X, ABOUT_Y),
    joints.Distance: _distance,
    joints.Fixed: _fixed,
    joints.InPlane: _generic(X, along=0),
    joints.Inline: _generic(X, Y),
    joints.OrientationLock: _orientation_lock,
    joints.ParallelAxes: _generic(ABOUT_X, ABOUT_Y),
    joints.PerpendicularAxes: _perpendicular_axes,
    joints.Planar: _generic(Z, ABOUT_X, ABOUT_Y),
    joints.Revolute: _revolute,
    joints.RevoluteSpherical: _revolute_spherical,
    joints.Screw: _generic(X, Y, ABOUT_X, ABOUT_Y),  # and its relation
    joints.Spherical: _spherical,
    joints.Translational: _translational,
    joints.Universal: _universal,
}
DRIVERS: Mapping[type[Driver], Callable[[Equations, Any], int]] = {
    JointAngle: _joint_driver,
    JointDisplacement: _joint_driver,
    PointCoordinate: _point_coordinate,
}
