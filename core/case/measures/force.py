"""Measures of forces: reactions of joints, efforts of drivers, force elements.

They read the forces of a solution, not the motion of points, and have no rates.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Self

import numpy as np

from ...algebra import Vec3, triple
from ...errors import MechanismError, SolveError
from ...forces import Forces
from ...jet import Jet
from ...mechanism.drivers import JointDriver, PointCoordinate
from ...mechanism.loads import Bushing, Force, SpringDamper, Torque, TorsionSpringDamper
from ...mechanism.mechanism import Mechanism, Point, Vector
from ...trajectory import Array
from ..quantity import HIDDEN, MARKER
from .base import Measure, place_on

NEWTON, NEWTON_METRE = "N", "N m"


class Axis(StrEnum):
    """A global axis."""

    X = "x"
    Y = "y"
    Z = "z"


@dataclass(frozen=True)
class ForceMeasure(Measure):
    """Base of the measures of forces; each reads one joint, driver or force element.

    Attributes:
        turns: whether the value is a torque or moment.
    """

    measure = NEWTON

    turns: bool = field(default=False, kw_only=True, metadata=HIDDEN)

    @property
    @abstractmethod
    def read(self) -> str:
        """Name of the joint, driver or force element."""

    @property
    def points(self) -> tuple[str, ...]:
        """The point of action; engines follow a motion by the points of outputs."""
        return (f"{MARKER}{self.read}: force",)

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return the point of action."""
        body, place = self.place(mechanism)
        return [Point(self.points[0], body, place)]

    @abstractmethod
    def place(self, mechanism: Mechanism) -> tuple[str, Vector]:
        """Return the body it acts on, and the body's point, global at design [m]."""

    @property
    def forces(self) -> tuple[str, ...]:
        """The joint, driver or force element."""
        return (self.read,)

    @property
    def unit(self) -> str:
        """Unit of the value: N, or N m of a torque or moment."""
        return NEWTON_METRE if self.turns else NEWTON

    @property
    def orders(self) -> int:
        """One: forces have no rates."""
        return 1

    def check(self, mechanism: Mechanism) -> None:
        """Raise MechanismError unless the mechanism has loads, and all its names."""
        super().check(mechanism)
        if not mechanism.has_loads:
            raise MechanismError(
                "no body has mass and no force element acts, so all forces are zero; give bodies"
                " mass, center_of_mass and inertia, or add [forces.NAME]",
                f"outputs.{self.name}.type",
            )

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Raise SolveError: forces do not follow from points."""
        raise SolveError(f"output {self.name!r} is a force, and no function of points")

    @abstractmethod
    def values(self, forces: Forces) -> Array:
        """Return the measure over the samples, NaN if missing or undetermined."""

    def undetermined(self, forces: Forces) -> str:
        """Return a message if redundant rows leave the measure undetermined, or nothing."""
        return ""


@dataclass(frozen=True)
class _JointReaction(ForceMeasure):
    joint: str
    component: Axis | None = None
    direction: Vector | None = None
    bodies: tuple[str, str] = field(default=("", ""), kw_only=True, metadata=HIDDEN)

    def check(self, mechanism: Mechanism) -> None:
        """Raise MechanismError unless the joint exists and one direction is given."""
        super().check(mechanism)
        key = f"outputs.{self.name}"
        if (self.component is None) == (self.direction is None):
            what = "neither component nor direction" if self.direction is None else "both"
            raise MechanismError(
                f'found {what}, expected one of them; give component = "x" or direction = [x, y,'
                " z], global axes",
                key,
            )
        if self.direction is not None and not any(self.direction):
            raise MechanismError(
                "found zero, expected a direction; give one of any other length",
                f"{key}.direction",
            )
        if self.joint in {joint.name for joint in mechanism.grounded}:
            raise MechanismError(
                f"joint {self.joint!r} joins two fixed bodies, and nothing determines its force;"
                " free one of the bodies",
                f"{key}.joint",
            )

    def bound(self, mechanism: Mechanism) -> Self:
        """Return the measure with the joint's bodies, which its sense names."""
        return replace(self, bodies=mechanism.joint(self.joint).bodies)

    @property
    def read(self) -> str:
        """Name of the joint."""
        return self.joint

    def place(self, mechanism: Mechanism) -> tuple[str, Vector]:
        """Return the second body, and the joint's point on it, or a place on it."""
        return _joint_place(mechanism, self.joint)

    @property
    def along(self) -> Vector:
        """The direction, global unit vector [-]."""
        if self.component is not None:
            x, y, z = (float(axis == self.component) for axis in Axis)
            return x, y, z
        direction = self.direction or (0.0, 0.0, 0.0)
        length = math.hypot(*direction)
        x, y, z = (component / length for component in direction)
        return x, y, z

    @property
    def sense(self) -> str:
        """Which body exerts it on which, about which point, along which direction."""
        along = self.component or f"[{', '.join(f'{x:.6g}' for x in self.along)}]"
        first, second = self.bodies
        return f"{self.positive}, by {first!r} on {second!r}, along global {along}"

    def values(self, forces: Forces) -> Array:
        """Return the component of the reaction [N or N m]."""
        return forces.joints[self.joint].along(self.along, moment=self.turns)

    def undetermined(self, forces: Forces) -> str:
        """Return a message if redundant rows leave the component undetermined, or nothing."""
        reaction = forces.joints[self.joint]
        loose = np.isfinite(reaction.force).all(axis=1) & ~np.isfinite(self.values(forces))
        if not loose.any():
            return ""
        force, moment, wrench = reaction.determined()
        return (
            f"rigid bodies do not determine it at {int(loose.sum())} samples: redundant rows leave"
            f" {force} of 3 directions of the joint's force determined, {moment} of 3 of its moment"
            f" and {wrench} of 6 of both; compare along one of those, or remove the redundancy"
        )


@dataclass(frozen=True)
class JointForce(_JointReaction):
    """Force of a joint's first body on its second, along a global axis or direction."""

    type = "joint_force"
    positive = "force"


@dataclass(frozen=True)
class JointMoment(_JointReaction):
    """Moment of a joint's first body on its second, about the joint's point on the second body."""

    type = "joint_moment"
    measure = NEWTON_METRE
    positive = "moment about the joint's point on the second body"

    turns: bool = field(default=True, kw_only=True, metadata=HIDDEN)


@dataclass(frozen=True)
class DriverEffort(ForceMeasure):
    """Force or torque of a driver, in the positive sense of its coordinate: effort times rate is
    the power it puts in.
    """

    type = "driver_effort"
    positive = "along the driver's coordinate, so that effort times rate is the power put in"

    driver: str

    def bound(self, mechanism: Mechanism) -> Self:
        """Return the measure with the unit of the driver's effort."""
        return replace(self, turns=mechanism.driver(self.driver).turns)

    @property
    def read(self) -> str:
        """Name of the driver."""
        return self.driver

    def place(self, mechanism: Mechanism) -> tuple[str, Vector]:
        """Return the driven body, and the driven point or a place of the joint."""
        driver = mechanism.driver(self.driver)
        if isinstance(driver, PointCoordinate):
            point = mechanism.point(driver.point)
            return point.body, point.position
        assert isinstance(driver, JointDriver)
        return _joint_place(mechanism, driver.joint)

    def values(self, forces: Forces) -> Array:
        """Return the effort [N or N m]."""
        return forces.drivers[self.driver]


@dataclass(frozen=True)
class ElementForce(ForceMeasure):
    """Force of a force element: tension of a spring-damper; torque of a torsional one on the
    joint's second body; amount of a constant force or torque, or of a bushing's force, or of its
    torque if it gives no force.
    """

    type = "element_force"
    positive = "tension of a spring; torque on the joint's second body of a torsional one"

    force: str

    def bound(self, mechanism: Mechanism) -> Self:
        """Return the measure with the unit of the element's force."""
        element = mechanism.force(self.force)
        turns = isinstance(element, TorsionSpringDamper | Torque)
        turns |= isinstance(element, Bushing) and element.turns_only
        return replace(self, turns=turns)

    @property
    def read(self) -> str:
        """Name of the force element."""
        return self.force

    def place(self, mechanism: Mechanism) -> tuple[str, Vector]:
        """Return the last body it acts on, and the body's point."""
        element = mechanism.force(self.force)
        if isinstance(element, TorsionSpringDamper):
            return _joint_place(mechanism, element.joint)
        body = element.bodies[-1]
        if isinstance(element, SpringDamper):
            return body, element.points[1]
        if isinstance(element, Force | Bushing):
            return body, element.point
        return body, triple(place_on(mechanism, body))

    def values(self, forces: Forces) -> Array:
        """Return the force [N or N m]."""
        return forces.elements[self.force]


def _joint_place(mechanism: Mechanism, name: str) -> tuple[str, Vector]:
    joint = mechanism.joint(name)
    known = joint.points_on(joint.j)
    return joint.j, known[0] if known else triple(place_on(mechanism, joint.j))
