"""A mechanism as Exudyn's bodies and algebraic equations; private to the adapter of Exudyn.

Rows of Exudyn, measured on version 1.13.6 against rotation matrices, markers 0 and 1 being at p0
and p1, with d = p1 - p0:

    object                  constrained axes            rows
    generic joint           some translations           those of x0 . d, y0 . d, z0 . d
                            all translations            d, global
                            rotations x, y              z0 . x1, z0 . y1
                            rotations x, y, z           z0 . y1, z0 . x1, x0 . y1
                            rotation z                  x0 . y1
    revolute joint Z                                    d, z0 . x1, z0 . y1
    prismatic joint X                                   y0 . d, z0 . d, z0 . y1, z0 . x1, x0 . y1

A free axis of a generic joint leaves an empty row, which is dropped.

A row may follow a value: that of a driver, or an unknown that is added for two rows to share. Two
coordinates in a fixed ratio (screw, gear, rack and pinion) follow the same unknown, and so do the
two products whose difference a constant-velocity joint keeps at zero. A displacement is compared
with its value. An angle is followed by turning the frame on the first body, which leaves the sine
of what is missing: any number of turns can be followed, in steps that leave less than a quarter
turn missing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core import joints
from ...core.joints.base import unit
from ...core.mechanism.drivers import (
    Driver,
    JointAngle,
    JointDisplacement,
    JointDriver,
    PointCoordinate,
)
from ...core.mechanism.mechanism import GROUND, Mechanism
from ...core.trajectory import Array
from ..shared.poses import frame_along, middle

# Constrained axes of a generic joint.
X, Y, Z, ABOUT_X, ABOUT_Y, ABOUT_Z = range(6)
NO_ROTATION = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Equation:
    """An equation: a row of an object of Exudyn keeps a value [m or -]."""

    item: int
    index: int
    keeps: float


@dataclass(frozen=True)
class Following:
    """A row follows the weight times a value: one of the drivers, or a further unknown."""

    row: int
    value: int
    weight: float


class Rows:
    """The bodies of a mechanism and the equations between them, as objects of an Exudyn system.

    Attributes:
        bodies: Exudyn's number and the origin [m] of each body; fixed ones are Exudyn's ground.
        nodes: numbers of the nodes, one for each moving body.
        rows: all equations, in order.
        following: which of them follow a value.
        turning: rows that follow an angle, and their markers on the first and second body; the
            first turns about its z axis.
        values: the number of drivers and further unknowns.
    """

    def __init__(self, mbs: Any, items: Any, mechanism: Mechanism) -> None:
        self.mbs, self.items, self.mechanism = mbs, items, mechanism
        self.ground = int(mbs.AddObject(items.ObjectGround()))
        self.bodies = {GROUND: (self.ground, np.zeros(3))}
        self.nodes: list[int] = []
        self.rows: list[Equation] = []
        self.following: list[Following] = []
        self.turning: dict[int, tuple[int, int]] = {}
        self.values = len(mechanism.drivers)
        self._add_bodies()
        for joint in mechanism.joints:
            JOINTS[type(joint)](self, joint)
            for relation in joint.relations if isinstance(joint, joints.AxialJoint) else ():
                self.relate([(joint.name, freedom, weight) for freedom, weight in relation.items()])
        for coupler in mechanism.couplers:
            self.relate(coupler.terms)
        for value, driver in enumerate(mechanism.drivers):
            self.drive(driver, value)

    def _add_bodies(self) -> None:
        for body in self.mechanism.bodies:
            if body.fixed:
                self.bodies[body.name] = self.bodies[GROUND]
                continue
            # Points and axes are given in global coordinates, so every node starts parallel to the
            # global axes. It stands amid the body's joints: case files may leave the origin far
            # away, and long arms cost digits of the differences.
            origin = middle(self.mechanism, body)
            node = self.mbs.AddNode(
                self.items.NodeRigidBodyEP(referenceCoordinates=[*origin, *NO_ROTATION])
            )
            # Exudyn asks for a mass and inertias; kinematics does not depend on them.
            rigid = self.items.ObjectRigidBody(
                mass=1.0, inertia=[1.0, 1.0, 1.0, 0.0, 0.0, 0.0], nodeNumber=node
            )
            self.bodies[body.name] = int(self.mbs.AddObject(rigid)), origin
            self.nodes.append(node)

    def marker(
        self, body: str, position: Sequence[float] | Array, rotation: Array | None = None
    ) -> int:
        """A frame on a body: its origin [m] and rotation matrix (aligned if None), both global at
        design.
        """
        number, origin = self.bodies[body]
        frame = np.eye(4)
        frame[:3, 3] = np.array(position) - origin
        if rotation is not None:
            frame[:3, :3] = rotation
        return self.mbs.AddMarker(self.items.MarkerBodyRigid(bodyNumber=number, localHT=frame))

    def markers(
        self, joint: joints.Joint, position: Sequence[float] | Array, rotation: Array | None = None
    ) -> list[int]:
        """The same frame on both bodies of a joint."""
        return [self.marker(body, position, rotation) for body in joint.bodies]

    def connect(self, item: Any, indices: Sequence[int], keeps: float = 0.0) -> int:
        """Add an object of which these rows are equations; the last keeps a value. Returns the
        place of the last row.
        """
        number = self.mbs.AddObject(item)
        self.rows += [
            Equation(number, index, keeps if index == indices[-1] else 0.0) for index in indices
        ]
        return len(self.rows) - 1

    def connect_generic(
        self, markers: Sequence[int], axes: Sequence[int], keeps: float = 0.0
    ) -> int:
        """A generic joint that constrains these axes; see `connect`."""
        constrained = [int(axis in axes) for axis in range(6)]
        item = self.items.ObjectJointGeneric(
            markerNumbers=list(markers), constrainedAxes=constrained
        )
        return self.connect(item, axes, keeps)

    def coordinate(self, name: str, freedom: str) -> int:
        """A row that is the rotation about or the translation along the axis of a joint, for it to
        follow a value.
        """
        joint: Any = self.mechanism.joint(name)
        if freedom == "translation":
            return self.connect_generic(
                self.markers(joint, joint.point, frame_along(joint.axis, 0)), (X,)
            )
        # exchanged, so that the row is the sine of the angle and not of its negative
        first, second = self.markers(joint, joint.point, frame_along(joint.axis, 2))
        row = self.connect_generic((second, first), (ABOUT_Z,))
        self.turning[row] = first, second
        return row

    def unknown(self) -> int:
        """A further unknown, zero at design; returns its place among the values."""
        self.values += 1
        return self.values - 1

    def follow(self, row: int, value: int, weight: float = 1.0) -> None:
        """Let a row follow a value."""
        self.following.append(Following(row, value, weight))

    def drive(self, driver: Driver, value: int) -> None:
        """The driver's coordinate follows its value."""
        self.follow(DRIVERS[type(driver)](self, driver), value)

    def relate(self, terms: Sequence[tuple[str, str, float]]) -> None:
        """The weighted sum of two coordinates (joint, freedom, weight) stays zero."""
        (first, freedom, weight), (second, other_freedom, other) = terms
        value, size = self.unknown(), math.hypot(weight, other)
        self.follow(self.coordinate(first, freedom), value, other / size)
        self.follow(self.coordinate(second, other_freedom), value, -weight / size)


def turned(angle: float) -> Array:
    """The frame turned about its z axis, as homogeneous matrix."""
    frame = np.eye(4)
    c, s = math.cos(angle), math.sin(angle)
    frame[:2, :2] = [[c, -s], [s, c]]
    return frame


def _generic(*axes: int, along: int = 2) -> Callable[[Rows, Any], None]:
    """A joint that is a generic joint with these axes constrained, its axis being x (0), y or z of
    the frame.
    """

    def add(rows: Rows, joint: Any) -> None:
        rows.connect_generic(
            rows.markers(
                joint, getattr(joint, "point", (0.0, 0.0, 0.0)), frame_along(joint.axis, along)
            ),
            axes,
        )

    return add


def _spherical(rows: Rows, joint: joints.Spherical | joints.ConstantVelocity) -> None:
    rows.connect(
        rows.items.ObjectJointSpherical(markerNumbers=rows.markers(joint, joint.point)), range(3)
    )


def _revolute(rows: Rows, joint: joints.Revolute) -> None:
    markers = rows.markers(joint, joint.point, frame_along(joint.axis, 2))
    rows.connect(rows.items.ObjectJointRevoluteZ(markerNumbers=markers), range(5))


def _translational(rows: Rows, joint: joints.Translational) -> None:
    markers = rows.markers(joint, joint.point, frame_along(joint.axis, 0))
    rows.connect(rows.items.ObjectJointPrismaticX(markerNumbers=markers), range(5))


def _universal(rows: Rows, joint: joints.Universal) -> None:
    _cross(rows, joint, joint.point, (X, Y, Z, ABOUT_Z))


def _perpendicular_axes(rows: Rows, joint: joints.PerpendicularAxes) -> None:
    _cross(rows, joint, (0.0, 0.0, 0.0), (ABOUT_Z,))


def _cross(
    rows: Rows,
    joint: joints.Universal | joints.PerpendicularAxes,
    point: Sequence[float],
    axes: Sequence[int],
) -> None:
    # The last row is x0 . y1, the cosine of the cross: an angle the table has rounded stays as it
    # is.
    first, second = joint.axes
    markers = [
        rows.marker(joint.i, point, frame_along(first, 0)),
        rows.marker(joint.j, point, frame_along(second, 1)),
    ]
    rows.connect_generic(markers, axes, keeps=unit(first) @ unit(second))


def _constant_velocity(rows: Rows, joint: joints.ConstantVelocity) -> None:
    _spherical(rows, joint)
    h, k = (np.array(tuple(unit(axis))) for axis in joint.axes)
    first = frame_along(joint.axes[0], 2)
    # The shortest turn from h to k is two reflections, in the plane across h and in the plane
    # between the shafts, across h + k.
    between = (h + k) / np.linalg.norm(h + k)
    second = first - 2.0 * np.outer(between, between @ first)
    second[:, 2] = k
    i, j = rows.marker(joint.i, joint.point, first), rows.marker(joint.j, joint.point, second)
    # x0 . y1 - x1 . y0 stays zero: both products keep to the same unknown, and so do not twist
    product, common = float(first[:, 0] @ second[:, 1]), rows.unknown()
    for markers in ((i, j), (j, i)):
        rows.follow(rows.connect_generic(markers, (ABOUT_Z,), keeps=product), common)


def _distance(rows: Rows, joint: joints.Distance) -> None:
    _rod(rows, joint, joint.rod_length)


def _revolute_spherical(rows: Rows, joint: joints.RevoluteSpherical) -> None:
    link = np.subtract(joint.points[1], joint.points[0])
    _rod(rows, joint, float(np.linalg.norm(link)))
    frame = frame_along(joint.axis, 0)
    markers = [
        rows.marker(body, point, frame)
        for body, point in zip(joint.bodies, joint.points, strict=True)
    ]
    rows.connect_generic(markers, (X,), keeps=float(frame[:, 0] @ link))


def _rod(rows: Rows, joint: joints.Distance | joints.RevoluteSpherical, length: float) -> None:
    markers = [
        rows.marker(body, point) for body, point in zip(joint.bodies, joint.points, strict=True)
    ]
    rows.connect(
        rows.items.ObjectConnectorDistance(markerNumbers=markers, distance=length), range(1)
    )


def _fixed(rows: Rows, joint: joints.Fixed) -> None:
    point = rows.bodies[joint.j][1] if joint.point is None else joint.point
    rows.connect_generic(rows.markers(joint, point), range(6))


def _orientation_lock(rows: Rows, joint: joints.OrientationLock) -> None:
    rows.connect_generic(rows.markers(joint, (0.0, 0.0, 0.0)), (ABOUT_X, ABOUT_Y, ABOUT_Z))


def _point_coordinate(rows: Rows, driver: PointCoordinate) -> int:
    point, frame = rows.mechanism.point(driver.point), frame_along(driver.direction, 0)
    return rows.connect_generic(
        [rows.marker(body, point.position, frame) for body in (GROUND, point.body)], (X,)
    )


def _joint_driver(rows: Rows, driver: JointDriver) -> int:
    return rows.coordinate(driver.joint, driver.freedom)


# By exact type: a subclass may mean something else.
JOINTS: Mapping[type[joints.Joint], Callable[[Rows, Any], None]] = {
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
DRIVERS: Mapping[type[Driver], Callable[[Rows, Any], int]] = {
    JointAngle: _joint_driver,
    JointDisplacement: _joint_driver,
    PointCoordinate: _point_coordinate,
}
