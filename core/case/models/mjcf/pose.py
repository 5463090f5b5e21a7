"""A pose of a model's tree: places of its bodies by coordinates of its joints, and slopes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np

from ....algebra import IDENTITY, ZERO, Quat, Vec3, X, Y, Z, cross
from ....mechanism.mechanism import GROUND
from ....trajectory import Array
from .frames import HERE, Place, unit_quaternion
from .tree import ModelJoint, Tree

UNKNOWNS: Mapping[str, int] = {"hinge": 1, "slide": 1, "ball": 3, "free": 6}
AXES = (X, Y, Z)

Value: TypeAlias = float | Place
"""Change of a joint since the pose of the tree: a coordinate [rad or m]; of a ball or free joint,
the displacement of its body, in global axes there.
"""


@dataclass(frozen=True, eq=False)
class Pose:
    """Values of all joints, in the order of `Tree.chain`."""

    tree: Tree
    values: Sequence[Value]

    @staticmethod
    def of(tree: Tree) -> Pose:
        """Return the pose of the tree itself."""
        return Pose(
            tree, [0.0 if joint.type in ("hinge", "slide") else HERE for joint in tree.chain]
        )

    @cached_property
    def columns(self) -> Mapping[str, range]:
        """Unknowns of each joint, by its name."""
        found, count = dict[str, range](), 0
        for joint in self.tree.chain:
            found[joint.name] = range(count, count := count + UNKNOWNS[joint.type])
        return found

    @property
    def unknowns(self) -> int:
        """Number of unknowns: of hinges and slides one, of balls three, of free joints six."""
        return sum(UNKNOWNS[joint.type] for joint in self.tree.chain)

    @cached_property
    def carried(self) -> Mapping[str, Place]:
        """Displacement of each body of the mechanism since the pose of the tree."""
        found: dict[str, Place] = {GROUND: HERE}
        for joint, value in zip(self.tree.chain, self.values, strict=True):
            found[joint.inner] = found[joint.outer].then(_motion(joint, value))
        return found

    @cached_property
    def _paths(self) -> Mapping[str, Sequence[ModelJoint]]:
        """Joints between the ground and each body."""
        found: dict[str, Sequence[ModelJoint]] = {GROUND: ()}
        for joint in self.tree.chain:
            found[joint.inner] = (*found[joint.outer], joint)
        return found

    @cached_property
    def _coordinates(self) -> Mapping[str, float]:
        pairs = zip(self.tree.chain, self.values, strict=True)
        return {joint.name: value for joint, value in pairs if not isinstance(value, Place)}

    def value(self, joint: str) -> float:
        """Return the change of a hinge's or slide's coordinate [rad or m]."""
        return self._coordinates[joint]

    def slopes(self, body: str, point: Vec3) -> tuple[Array, Array]:
        """Return the derivatives of a point of a body and of its turn by the unknowns, global.

        Args:
            point: its present position, global [m].

        Returns:
            Two arrays of shape (3, unknowns).
        """
        along, about = np.zeros((2, 3, self.unknowns))
        for joint in self._paths[body]:
            columns, before = self.columns[joint.name], self.carried[joint.outer]
            if joint.type == "slide":
                along[:, columns[0]] = [*before.direction(joint.axis)]
                continue
            turning = columns
            if joint.type == "free":
                along[:, columns[:3]] = np.eye(3)
                turning = columns[3:]
            # a free body turns about its own point where that is now
            carrier = self.carried[joint.inner] if joint.type == "free" else before
            arm = point - carrier.point(joint.point)
            axes = (joint.axis,) if joint.type == "hinge" else AXES
            for column, axis in zip(turning, axes, strict=True):
                a = before.direction(axis)
                about[:, column], along[:, column] = [*a], [*cross(a, arm)]
        return along, about

    def moved(self, step: Array) -> Pose:
        """Return the pose after a step of the unknowns."""
        values: list[Value] = []
        for joint, value in zip(self.tree.chain, self.values, strict=True):
            change: list[float] = step[[*self.columns[joint.name]]].tolist()
            if not isinstance(value, Place):
                values.append(value + change[0])
                continue
            turn = _turn(Vec3(*change[-3:]))
            shift = Vec3(*change[:3]) if joint.type == "free" else ZERO
            values.append(_about(value.point(joint.point), turn, shift).then(value))
        return Pose(self.tree, values)

    def settled(self) -> Tree:
        """Return the tree in this pose."""
        tree, chain = self.tree, list[ModelJoint]()
        for joint, value in zip(tree.chain, self.values, strict=True):
            before = self.carried[joint.outer]
            chain.append(
                replace(
                    joint,
                    point=before.point(joint.point),
                    axis=before.direction(joint.axis),
                    moved=joint.moved + (0.0 if isinstance(value, Place) else value),
                )
            )
            if joint.type == "free":
                chain[-1] = replace(chain[-1], point=self.carried[joint.inner].point(joint.point))
        return replace(
            tree,
            chain=chain,
            joints={each.name: each for each in chain if each.name in tree.joints},
            moving={name: self.carried[name].then(place) for name, place in tree.moving.items()},
            places={
                name: self.carried[tree.carriers[name]].then(place)
                for name, place in tree.places.items()
            },
            sites={
                name: (body, self.carried[body].then(place))
                for name, (body, place) in tree.sites.items()
            },
        )


def _motion(joint: ModelJoint, value: Value) -> Place:
    """Return the displacement of the inner body, as the outer one stands in the tree."""
    if isinstance(value, Place):
        return value
    if joint.type == "slide":
        return Place(value * joint.axis, IDENTITY)
    turn = Quat(math.cos(0.5 * value), math.sin(0.5 * value) * joint.axis)
    return _about(joint.point, turn)


def _about(point: Vec3, turn: Quat, shift: Vec3 = ZERO) -> Place:
    """Return a turn about a point, followed by a shift."""
    return Place(point - Place(ZERO, turn).direction(point) + shift, turn)


def _turn(vector: Vec3) -> Quat:
    """Return the quaternion of a rotation vector."""
    angle = math.sqrt(vector @ vector)
    half = math.sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    return unit_quaternion(Quat(math.cos(0.5 * angle), half * vector))
