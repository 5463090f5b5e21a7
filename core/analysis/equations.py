"""The equations of a mechanism: its joints and drivers as primitives between bodies, over any scalar.

Lengths are measured in a power of two of metres near the mechanism's size, which is exact and makes rows of lengths and of angles
alike in size. Every moving body gets an internal origin at one of its joints, so that the arm of that joint is a literal zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from .. import primitives as p
from ..algebra import ZERO, Vec3, vec
from ..drivers import Driver, JointAngle, JointDriver, PointCoordinate
from ..errors import SolveError
from ..joints import Attachment, AxialJoint, Joint
from ..joints.base import unit
from ..mechanism import GROUND, Mechanism
from ..primitives import conventional, paper
from ..primitives.base import Drive
from ..topology import spanning_tree


@dataclass(frozen=True)
class Constraint:
    """A primitive between two bodies, and the joint or driver it belongs to."""

    owner: str
    primitive: p.Primitive
    i: str
    j: str


@dataclass(frozen=True)
class Frames:
    """How the mechanism is measured: the length unit [m] and the internal origin of every body [units]."""

    unit: float
    origins: Mapping[str, Vec3]

    def arm(self, body: str, position: Sequence[float]) -> Vec3:
        """From the internal origin of the body to a point, at design [units]."""
        return (1.0 / self.unit) * vec(position) - self.origins[body]


def frames(mechanism: Mechanism) -> Frames:
    """The length unit and the internal origins: at the joint by which the spanning tree reaches a body."""
    points = [point for joint in mechanism.joints for point in joint_points(joint)]
    extent = max((max(axis) - min(axis) for axis in zip(*points, strict=True)), default=1.0)
    length_unit = 2.0 ** round(math.log2(extent)) if extent > 0.0 else 1.0
    origins = dict.fromkeys((GROUND, *(body.name for body in mechanism.bodies if body.fixed)), ZERO)
    for branch in spanning_tree(mechanism).branches:
        at = joint_points(branch.joint) if branch.joint is not None else []
        if not at:  # a free body, or a joint without a point: the first point any joint has on it
            touching = (joint for joint in mechanism.joints if branch.child in joint.bodies)
            at = [q for joint in touching for q in joint_points(joint, branch.child)]
        position = at[0] if at else mechanism.body(branch.child).origin
        origins[branch.child] = (1.0 / length_unit) * vec(position)
    return Frames(length_unit, origins)


def joint_points(joint: Joint, body: str | None = None) -> list[tuple[float, float, float]]:
    """The points of a joint, global at design [m]; only those on the body if one is named."""
    point, pair = getattr(joint, "point", None), getattr(joint, "points", ())
    if point is not None:
        return [point]
    return [q for q, owner in zip(pair, joint.bodies, strict=False) if body in (None, owner)]


class Style(StrEnum):
    """How rows are written; the same solutions, the same machinery."""

    NATIVE = "native"
    PAPER = "paper"
    CONVENTIONAL = "conventional"


def restyled(found: Sequence[Constraint], style: Style) -> list[Constraint]:
    """The constraints with every primitive replaced by its twins in the style."""
    if style is Style.NATIVE:
        return list(found)
    twins = paper.TWINS if style is Style.PAPER else conventional.TWINS
    return [replace(c, primitive=twin) for c in found for twin in twins[type(c.primitive)](c.primitive)]


def constraints(mechanism: Mechanism, frame: Frames, drives: Mapping[str, Drive], *, keep_fixed: bool = False) -> list[Constraint]:
    """All constraints: joints in order, then drivers in order.

    Args:
        drives: the motion of each driver by name; drivers not named hold their design value.
        keep_fixed: fixed bodies move in principle and are held by ground rows, as in the paper's count; else they are ground.
    """
    found: list[Constraint] = []
    if keep_fixed:
        found += [Constraint(body.name, p.Ground(), GROUND, body.name) for body in mechanism.bodies if body.fixed]
    for original in mechanism.joints:
        # the ground as body i: its rows are constant and the simplified ones need nothing of body j
        joint = original.reversed() if mechanism.is_fixed(original.j) else original
        scaled = joint.scaled(1.0 / frame.unit)
        i, j = Attachment(frame.origins[joint.i]), Attachment(frame.origins[joint.j])
        found += [Constraint(joint.name, primitive, joint.i, joint.j) for primitive in scaled.primitives(i, j)]
    return found + [_driven(mechanism, frame, driver, drives.get(driver.name, Drive())) for driver in mechanism.drivers]


def _driven(mechanism: Mechanism, frame: Frames, driver: Driver, drive: Drive) -> Constraint:
    """The constraint of a driver that moves as the drive says."""
    if isinstance(driver, PointCoordinate):
        point = mechanism.point(driver.point)
        arm = frame.arm(point.body, point.position)
        return Constraint(driver.name, p.DrivenCoordinate(unit(driver.direction), arm, drive), GROUND, point.body)
    joint = mechanism.joint(driver.joint) if isinstance(driver, JointDriver) else None
    if not isinstance(joint, AxialJoint):
        raise SolveError(f"driver {driver.name!r} ({driver.type}) is of a kind the native formulation cannot drive")
    h, e0 = unit(joint.axis), frame.origins[joint.j] - frame.origins[joint.i]
    primitive = p.DrivenAngle(h, drive) if isinstance(driver, JointAngle) else p.LockedDisplacement(h, e0, drive)
    return Constraint(driver.name, primitive, joint.i, joint.j)
