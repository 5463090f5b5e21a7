"""A mechanism as Exudyn's bodies and algebraic equations; private to its adapter.

A row may follow a value: the value of a driver, or an additional unknown that two rows share. Two
coordinates in a fixed ratio (screw, gear, rack and pinion) follow the same unknown, and so do the
two products whose difference a constant-velocity joint keeps at zero. A displacement is compared
with its value. For an angle, the frame on the first body is turned by the value, and the row is the
sine of the remaining angle: any number of turns can be followed, in steps of less than a quarter
turn. The objects are those of `exudyn_joints`.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core import joints
from ...core.joints import PiecewisePolynomial
from ...core.joints.base import unit
from ...core.mechanism.mechanism import GROUND, Body, Mechanism
from ...core.mechanism.motions import Driver, JointDriver, PointCoordinate
from ...core.trajectory import Array
from ..shared.exudyn_joints import ABOUT_Z, X, frame_along, objects_of
from ..shared.tree_forces import mass_properties
from ..shared.tree_plan import ends_of, middle

NO_ROTATION = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Equation:
    """An equation: a row of an Exudyn object equals a constant [m or -]."""

    item: int
    index: int
    keeps: float


class System:
    """An empty system of Exudyn.

    Attributes:
        exu, items: Exudyn's package, and its objects.
        container: owner of the system, which must live as long as it.
        kinds: Exudyn's output variables.
    """

    def __init__(self) -> None:
        self.exu: Any = importlib.import_module("exudyn")
        self.items: Any = importlib.import_module("exudyn.itemInterface")
        # the harness reports results; Exudyn's banners would mix with them
        self.exu.config.printToConsole = False
        self.container: Any = self.exu.SystemContainer()
        self.mbs: Any = self.container.AddSystem()
        self.kinds: Any = self.exu.OutputVariableType

    def settings(self) -> Any:
        """Return settings of a solver that writes no files."""
        found = self.exu.SimulationSettings()
        found.solution.file.write = False
        return found


class Rows:
    """The bodies of a mechanism and the equations between them, as objects of an Exudyn system.

    Attributes:
        bodies: Exudyn's number and the origin [m] of each body; fixed bodies are Exudyn's ground.
        nodes: numbers of the nodes, one for each moving body.
        rows: all equations, in order.
        owned: the rows of each joint.
        following: rows that follow a weight times a value, a driver's or a further unknown: row,
            value, weight.
        turning: rows that follow an angle, with their markers on the first and second body; the
            first marker turns about its z axis.
        bent: rows that follow a function of a value: row, value, minus the function.
        values: the number of drivers and further unknowns.
    """

    def __init__(self, system: System, mechanism: Mechanism, *, loaded: bool = False) -> None:
        self.loaded, self.mechanism = loaded, mechanism
        self.mbs, self.items, self.kinds = system.mbs, system.items, system.kinds
        self.ground = int(self.mbs.AddObject(self.items.ObjectGround()))
        self.bodies = {GROUND: (self.ground, np.zeros(3))}
        self.nodes: list[int] = []
        self.rows: list[Equation] = []
        self.following: list[tuple[int, int, float]] = []
        self.turning: dict[int, tuple[int, int]] = {}
        self.bent: list[tuple[int, int, PiecewisePolynomial]] = []
        self.values = len(mechanism.drivers)
        self._add_bodies()
        self.owned: dict[str, slice] = {}
        for joint in mechanism.joints:
            first = len(self.rows)
            self._join(joint)
            self.owned[joint.name] = slice(first, len(self.rows))
        for coupler in mechanism.couplers:
            if coupler.curve:
                self.curve(coupler.terms, coupler.curve)
            else:
                self.relate(coupler.terms)
        for value, driver in enumerate(mechanism.drivers):
            self.drive(driver, value)

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

    def _join(self, joint: joints.Joint) -> None:
        for each in objects_of(joint, ends_of(self.mechanism, joint)):
            places = zip(joint.bodies, each.points, each.frames, strict=True)
            markers = [self.marker(*place) for place in places]
            item = getattr(self.items, each.kind)(markerNumbers=markers, **each.options)
            self.connect(item, each.rows, each.keeps)
        if isinstance(joint, joints.ConstantVelocity):
            self._prevent_twist(joint)
        for relation in joint.relations if isinstance(joint, joints.AxialJoint) else ():
            self.relate([(joint.name, freedom, weight) for freedom, weight in relation.items()])

    def _prevent_twist(self, joint: joints.ConstantVelocity) -> None:
        h, k = (np.array(tuple(unit(axis))) for axis in joint.axes)
        first = frame_along(joint.axes[0], 2)
        # The shortest rotation from h to k is two reflections, in the planes normal to h and to
        # h + k.
        between = (h + k) / np.linalg.norm(h + k)
        second = first - 2.0 * np.outer(between, between @ first)
        second[:, 2] = k
        i, j = self.marker(joint.i, joint.point, first), self.marker(joint.j, joint.point, second)
        # x0 . y1 - x1 . y0 stays zero: both products follow the same unknown, which prevents twist
        product, common = float(first[:, 0] @ second[:, 1]), self.unknown()
        for markers in ((i, j), (j, i)):
            self.follow(self.connect_generic(markers, (ABOUT_Z,), keeps=product), common)

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
        self.following.append((row, value, weight))

    def drive(self, driver: Driver, value: int) -> None:
        """Make the driver's coordinate follow its value."""
        if isinstance(driver, PointCoordinate):
            point, frame = self.mechanism.point(driver.point), frame_along(driver.direction, 0)
            ends = [self.marker(body, point.position, frame) for body in (GROUND, point.body)]
            row = self.connect_generic(ends, (X,))
        else:
            assert isinstance(driver, JointDriver)
            row = self.coordinate(driver.joint, driver.freedom)
        self.follow(row, value)

    def curve(self, terms: Sequence[tuple[str, str, float]], curve: PiecewisePolynomial) -> None:
        """Keep the sum of the first coordinate, of weight one, and a function of the second."""
        (first, freedom, _), (second, other_freedom, _) = terms
        value = self.unknown()
        self.follow(self.coordinate(second, other_freedom), value)
        self.bent.append((self.coordinate(first, freedom), value, curve))

    def relate(self, terms: Sequence[tuple[str, str, float]]) -> None:
        """Keep the weighted sum of coordinates (joint, freedom, weight) at zero: they follow as
        many unknowns less one.
        """
        weights = [weight for *_, weight in terms]
        if len(terms) == 2:
            (a, b), size = weights, math.hypot(*weights)
            free = [[b / size], [-a / size]]
        else:
            free = np.linalg.svd(np.array([weights]))[2][1:].T.tolist()
        values = [self.unknown() for _ in terms[1:]]
        for (joint, freedom, _), row in zip(terms, free, strict=True):
            number = self.coordinate(joint, freedom)
            for value, weight in zip(values, row, strict=True):
                self.follow(number, value, weight)


def rotation_about_z(angle: float) -> Array:
    """Return the rotation about z by an angle [rad] as a homogeneous matrix, shape (4, 4)."""
    frame = np.eye(4)
    c, s = math.cos(angle), math.sin(angle)
    frame[:2, :2] = [[c, -s], [s, c]]
    return frame
