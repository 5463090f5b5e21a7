"""The constraints of a mechanism: joints and drivers as primitives between bodies, over any scalar.

The unit of length is a power of two of metres near the mechanism's size: conversion is exact, and
rows of lengths and of angles are of similar size. The internal origin of a moving body is at one of
its joints, so that the arm of this joint is a literal zero.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from ... import primitives as p
from ...algebra import ZERO, Vec3, vec
from ...errors import SolveError
from ...joints import Attachment, AxialJoint, Joint, PiecewisePolynomial
from ...joints.base import unit
from ...mechanism.mechanism import GROUND, Mechanism, Vector, extent
from ...mechanism.motions import Driver, JointDriver, PointCoordinate
from ...mechanism.tree import spanning_tree
from ...primitives.base import Drive
from ...program import Traced
from .formulation import Relation as Relation


@dataclass(frozen=True)
class Constraint:
    """A primitive between two bodies, and its joint or driver.

    Attributes:
        coordinate: the unknown that drives the primitive, as JOINT.rotation or JOINT.translation;
            empty without one.
    """

    owner: str
    primitive: p.Primitive
    i: str
    j: str
    coordinate: str = ""

    @property
    def n(self) -> int:
        """Number of rows."""
        return self.primitive.n


_Joint = TypeVar("_Joint", bound=Joint)


@dataclass(frozen=True)
class Frames:
    """The length unit [m], the internal origin of every body [units], and the moving bodies."""

    unit: float
    origins: Mapping[str, Vec3]
    moving: tuple[str, ...]

    def arm(self, body: str, position: Sequence[float]) -> Vec3:
        """Return the vector from a body's internal origin to a point, at design [units]."""
        return (1.0 / self.unit) * vec(position) - self.origins[body]

    def end(self, body: str, position: Vector) -> tuple[Vector, Vec3]:
        """Return a point of a body: its position and arm."""
        return position, self.arm(body, position)

    def attach(self, joint: _Joint) -> tuple[_Joint, Attachment, Attachment]:
        """Return a joint in units, and how it is attached to both bodies."""
        i, j = (Attachment(self.origins[body]) for body in joint.bodies)
        return joint.scaled(1.0 / self.unit), i, j

    def in_units(self, unit: float) -> Frames:
        """Return the same frames with another length unit, a power of two of metres."""
        scaled = {name: (self.unit / unit) * origin for name, origin in self.origins.items()}
        return Frames(unit, scaled, self.moving)


def frames(mechanism: Mechanism, length_unit: float | None = None) -> Frames:
    """Return the length unit, unless it is given, and the internal origins.

    The origin of a body is at the joint by which the spanning tree reaches it.
    """
    if length_unit is None:
        length_unit = unit_near(mechanism.size)
    origins = dict.fromkeys((GROUND, *(body.name for body in mechanism.bodies if body.fixed)), ZERO)
    touching: dict[str, list[Joint]] = {}
    for joint in mechanism.joints:
        for body in joint.bodies:
            touching.setdefault(body, []).append(joint)
    for branch in spanning_tree(mechanism).branches:
        at = branch.joint.points_on() if branch.joint is not None else []
        if not at:  # a free body, or a joint without a point: the first point any joint has on it
            at = [
                q for joint in touching.get(branch.child, ()) for q in joint.points_on(branch.child)
            ]
        position = at[0] if at else mechanism.body(branch.child).origin
        origins[branch.child] = (1.0 / length_unit) * vec(position)
    return Frames(length_unit, origins, tuple(body.name for body in mechanism.moving))


def measured(mechanism: Mechanism) -> tuple[float, Frames]:
    """Return the size of a large mechanism, and frames with a unit near the size of its bodies.

    Both lengths are powers of two of metres.
    """
    whole = frames(mechanism)
    points: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
    for joint in mechanism.joints:
        for body in joint.bodies:
            points[body] += joint.points_on(body)
    sizes = sorted(size for body in whole.moving if (size := extent(points[body])) > 0.0)
    unit = unit_near(sizes[len(sizes) // 2]) if sizes else whole.unit
    return whole.unit, whole.in_units(unit)


def unit_near(length: float) -> float:
    """Return the power of two nearest to a positive length [m]; division by it is exact."""
    return 2.0 ** round(math.log2(length))


def constraints(
    mechanism: Mechanism,
    frame: Frames,
    drives: Mapping[str, Drive],
    named: Collection[str] = (),
    *,
    mixed: bool = False,
) -> list[Constraint | Relation]:
    """Return all constraints: joints in order, then couplers, then drivers in order.

    Args:
        drives: the motion of each driver by name; drivers not named hold their design value.
        named: coordinates to name beside those of couplers, as JOINT.rotation or JOINT.translation.
        mixed: name the coordinates of all axial joints.
    """
    coupled = {
        f"{joint}.{freedom}"
        for coupler in mechanism.couplers
        for joint, freedom, _ in coupler.terms
    }.union(named)
    found: list[Constraint | Relation] = []
    for joint in mechanism.joints:
        if isinstance(joint, AxialJoint):
            fixed_last = mechanism.is_fixed(joint.j)
            found += _axial(joint, frame, coupled, mixed=mixed, fixed_last=fixed_last)
        else:
            found += _compose(mechanism, joint, frame)
    for coupler in mechanism.couplers:
        weights = {f"{joint}.{freedom}": k for joint, freedom, k in coupler.terms}
        found.append(_relation(coupler.name, weights, frame, coupler.curve))
    return found + [
        _driver_constraint(mechanism, frame, each, drives.get(each.name, Drive()), mixed)
        for each in mechanism.drivers
    ]


def constraints_left_out(mechanism: Mechanism, frame: Frames) -> list[Constraint]:
    """Return the constraints of reduced joints that are left out."""
    joints = (joint for each in mechanism.reduced for joint in each.left_out)
    return [each for joint in joints for each in _compose(mechanism, joint, frame)]


def _compose(mechanism: Mechanism, original: Joint, frame: Frames) -> list[Constraint]:
    # the ground as body i: its rows are constant and the simplified ones need nothing of body j
    backwards = original.symmetric and mechanism.is_fixed(original.j)
    joint = original.reversed() if backwards else original
    scaled, i, j = frame.attach(joint)
    composed = scaled.primitives(i, j)
    return [Constraint(joint.name, primitive, joint.i, joint.j) for primitive in composed]


def _axial(
    original: AxialJoint, frame: Frames, coupled: Collection[str], *, mixed: bool, fixed_last: bool
) -> list[Constraint | Relation]:
    """Return the constraints of an axial joint.

    Its coordinates are named if they are coupled, related to each other, or named by the style.
    """
    related = {
        f"{original.name}.{freedom}" for relation in original.relations for freedom in relation
    }
    names = {freedom: f"{original.name}.{freedom}" for freedom in original.freedoms}
    named = [
        freedom for freedom, name in names.items() if mixed or name in coupled or name in related
    ]
    # the ground as body i: its rows are constant; but a named coordinate is that of body j relative
    # to body i, in this order
    joint = original.reversed() if fixed_last and not named else original
    scaled, i, j = frame.attach(joint)
    composed = (
        [*scaled.mixed(i, j)]
        if mixed
        else [
            *((primitive, "") for primitive in scaled.primitives(i, j)),
            *((scaled.measured(freedom, i, j), freedom) for freedom in named),
        ]
    )
    found: list[Constraint | Relation] = [
        Constraint(joint.name, primitive, joint.i, joint.j, names.get(freedom, ""))
        for primitive, freedom in composed
    ]
    weights = (
        {f"{joint.name}.{freedom}": k for freedom, k in relation.items()}
        for relation in original.relations
    )
    return found + [_relation(joint.name, each, frame) for each in weights]


def _relation(
    owner: str,
    weights: Mapping[str, float],
    frame: Frames,
    curve: PiecewisePolynomial | None = None,
) -> Relation:
    """Convert weights from metres and radians to units and radians, with the largest at one."""
    units = [frame.unit if name.endswith(".translation") else 1.0 for name in weights]
    scaled = [k * unit for k, unit in zip(weights.values(), units, strict=True)]
    slopes = [*scaled, curve.at(0.0)[1] * units[-1]] if curve else scaled
    # a traced lead is known only later
    largest = max(abs(k) for k in slopes if not isinstance(k, Traced))
    return Relation(
        owner,
        {name: k / largest for name, k in zip(weights, scaled, strict=True)},
        curve=curve and curve.scaled(units[-1], 1.0 / largest),
    )


def _driver_constraint(
    mechanism: Mechanism, frame: Frames, driver: Driver, drive: Drive, mixed: bool
) -> Constraint | Relation:
    """Return the constraint of a driver with the motion of its drive."""
    if isinstance(driver, PointCoordinate):
        point = mechanism.point(driver.point)
        arm = frame.arm(point.body, point.position)
        return Constraint(
            driver.name, p.DrivenCoordinate(unit(driver.direction), arm, drive), GROUND, point.body
        )
    joint = mechanism.joint(driver.joint) if isinstance(driver, JointDriver) else None
    if joint is not None and not isinstance(joint, AxialJoint):
        raise SolveError(
            f"driver {driver.name!r} ({driver.type}): joint {joint.name!r} is {joint.type}, which"
            " measures no coordinate; derive its class from kincheck.core.joints.base.AxialJoint,"
            " or drive a point"
        )
    if joint is None or not isinstance(driver, JointDriver):
        raise SolveError(
            f"driver {driver.name!r} ({driver.type}) is of a kind the native formulation cannot"
            " drive"
        )
    if mixed:
        return Relation(driver.name, {f"{joint.name}.{driver.freedom}": 1.0}, drive)
    scaled, i, j = frame.attach(joint)
    primitive: Any = scaled.measured(driver.freedom, i, j)
    return Constraint(driver.name, replace(primitive, drive=drive), joint.i, joint.j)
