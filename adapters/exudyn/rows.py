"""A mechanism as Exudyn's bodies and algebraic equations; private to its adapter.

A row may follow a value: the value of a driver, or an additional unknown that two rows share. Two
coordinates in a fixed ratio (screw, gear, rack and pinion) follow the same unknown, and so do the
two products whose difference a constant-velocity joint keeps at zero. A displacement is compared
with its value. For an angle, the frame on the first body is turned by the value, and the row is the
sine of the remaining angle: any number of turns can be followed, in steps of less than a quarter
turn.

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

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from ...core import joints
from ...core.joints.base import unit
from ...core.mechanism.mechanism import GROUND, Body, Mechanism
from ...core.mechanism.motions import (
    Driver,
    JointAngle,
    JointDisplacement,
    JointDriver,
    PointCoordinate,
)
from ...core.trajectory import Array
from ..shared.poses import frame_along
from ..shared.tree_forces import mass_properties
from ..shared.tree_plan import middle

# Constrained axes of a generic joint.
X, Y, Z, ABOUT_X, ABOUT_Y, ABOUT_Z = range(6)
NO_ROTATION = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Equation:
    """An equation: a row of an Exudyn object equals a constant [m or -]."""

    item: int
    index: int
    keeps: float


@dataclass(frozen=True)
class Following:
    """A row that follows a weight times a value: a driver's value or a further unknown."""

    row: int
    value: int
    weight: float


class Equations:
    """The bodies of a mechanism and the equations between them, as objects of an Exudyn system.

    Attributes:
        bodies: Exudyn's number and the origin [m] of each body; fixed bodies are Exudyn's ground.
        nodes: numbers of the nodes, one for each moving body.
        rows: all equations, in order.
        following: the equations that follow a value.
        turning: rows that follow an angle, with their markers on the first and second body; the
            first marker turns about its z axis.
        bent: rows that follow a polynomial of a value: row, value, polynomial.
        values: the number of drivers and further unknowns.
    """

    def __init__(self, mbs: Any, items: Any, mechanism: Mechanism, *, loaded: bool = False) -> None:
        self.loaded = loaded
        self.mbs, self.items, self.mechanism = mbs, items, mechanism
        self.ground = int(mbs.AddObject(items.ObjectGround()))
        self.bodies = {GROUND: (self.ground, np.zeros(3))}
        self.nodes: list[int] = []
        self.rows: list[Equation] = []
        self.following: list[Following] = []
        self.turning: dict[int, tuple[int, int]] = {}
        self.bent: list[tuple[int, int, Polynomial]] = []
        self.values = len(mechanism.drivers)
        self._add_bodies()

    def _add_bodies(self) -> None:
        for body in self.mechanism.bodies:
            if body.fixed:
                self.bodies[body.name] = self.bodies[GROUND]
                continue
            # Points and axes are global, so every node starts parallel to the global axes. It is
            # amid the body's joints: the origin in a case file may be far away, and long arms cost
            # digits of the differences.
            origin = middle(self.mechanism, body)
            node = self.mbs.AddNode(
                self.items.NodeRigidBodyEP(referenceCoordinates=[*origin, *NO_ROTATION])
            )
            rigid = self.items.ObjectRigidBody(**self._inertial(body, origin), nodeNumber=node)
            self.bodies[body.name] = int(self.mbs.AddObject(rigid)), origin
            self.nodes.append(node)

    def _inertial(self, body: Body, origin: Array) -> dict[str, Any]:
        """Return mass, centre of mass, and inertia about the node in Exudyn's form."""
        if not self.loaded:
            # Exudyn requires mass and inertia, which kinematics does not depend on.
            return {"mass": 1.0, "inertia": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]}
        mass, c, central = mass_properties(body, origin)
        about_node = central + mass * ((c @ c) * np.eye(3) - np.outer(c, c))
        entries = about_node[[0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]]
        return {"mass": mass, "centerOfMass": c, "inertia": [*entries]}

    def marker(
        self, body: str, position: Sequence[float] | Array, rotation: Array | None = None
    ) -> int:
        """Return a marker with this frame on a body: origin [m] and rotation matrix (aligned if
        None), both global at design.
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
        """Return new markers of the same frame on both bodies of a joint."""
        return [self.marker(body, position, rotation) for body in joint.bodies]

    def connect(self, item: Any, indices: Sequence[int], keeps: float = 0.0) -> int:
        """Add an object with these rows as equations; return the number of the last row.

        Args:
            keeps: value of the last row [m or -]; the other rows are zero.
        """
        number = self.mbs.AddObject(item)
        self.rows += [
            Equation(number, index, keeps if index == indices[-1] else 0.0) for index in indices
        ]
        return len(self.rows) - 1

    def connect_generic(
        self, markers: Sequence[int], axes: Sequence[int], keeps: float = 0.0
    ) -> int:
        """Add a generic joint that constrains these axes; see `connect`."""
        constrained = [int(axis in axes) for axis in range(6)]
        item = self.items.ObjectJointGeneric(
            markerNumbers=list(markers), constrainedAxes=constrained
        )
        return self.connect(item, axes, keeps)

    def coordinate(self, name: str, freedom: str) -> int:
        """Add a row for the rotation about or translation along a joint's axis; return its number.

        A later call of `follow` gives the row its value.
        """
        joint: Any = self.mechanism.joint(name)
        if freedom == "translation":
            return self.connect_generic(
                self.markers(joint, joint.point, frame_along(joint.axis, 0)), (X,)
            )
        # exchanged, so that the row is the sine of the angle, not of its negative
        first, second = self.markers(joint, joint.point, frame_along(joint.axis, 2))
        row = self.connect_generic((second, first), (ABOUT_Z,))
        self.turning[row] = first, second
        return row

    def unknown(self) -> int:
        """Add an unknown, zero at design; return its number among the values."""
        self.values += 1
        return self.values - 1

    def follow(self, row: int, value: int, weight: float = 1.0) -> None:
        """Let a row follow a value."""
        self.following.append(Following(row, value, weight))


def turned(angle: float) -> Array:
    """Return the rotation about z by an angle [rad] as a homogeneous matrix, shape (4, 4)."""
    frame = np.eye(4)
    c, s = math.cos(angle), math.sin(angle)
    frame[:2, :2] = [[c, -s], [s, c]]
    return frame


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


class Rows(Equations):
    """The equations of all joints, couplers and drivers of a mechanism.

    Attributes:
        owned: the rows of each joint.
    """

    def __init__(self, mbs: Any, items: Any, mechanism: Mechanism, *, loaded: bool = False) -> None:
        super().__init__(mbs, items, mechanism, loaded=loaded)
        self.owned: dict[str, slice] = {}
        for joint in mechanism.joints:
            first = len(self.rows)
            JOINTS[type(joint)](self, joint)
            for relation in joint.relations if isinstance(joint, joints.AxialJoint) else ():
                self.relate([(joint.name, freedom, weight) for freedom, weight in relation.items()])
            self.owned[joint.name] = slice(first, len(self.rows))
        for coupler in mechanism.couplers:
            if coupler.curve:
                self.curve(coupler.terms, coupler.curve)
            else:
                self.relate(coupler.terms)
        for value, driver in enumerate(mechanism.drivers):
            self.drive(driver, value)

    def drive(self, driver: Driver, value: int) -> None:
        """Make the driver's coordinate follow its value."""
        self.follow(DRIVERS[type(driver)](self, driver), value)

    def curve(self, terms: Sequence[tuple[str, str, float]], curve: Sequence[float]) -> None:
        """Make the first coordinate, of weight one, follow the polynomial of the second."""
        (first, freedom, _), (second, other_freedom, weight) = terms
        value = self.unknown()
        self.follow(self.coordinate(second, other_freedom), value)
        bent = -Polynomial(curve) - Polynomial([0.0, weight])
        self.bent.append((self.coordinate(first, freedom), value, bent))

    def relate(self, terms: Sequence[tuple[str, str, float]]) -> None:
        """Keep the weighted sum of two coordinates (joint, freedom, weight) at zero."""
        (first, freedom, weight), (second, other_freedom, other) = terms
        value, size = self.unknown(), math.hypot(weight, other)
        self.follow(self.coordinate(first, freedom), value, other / size)
        self.follow(self.coordinate(second, other_freedom), value, -weight / size)
