"""Measures of forces: reactions of joints, efforts of drivers, force elements.

They read the forces of a solution, and have no rates.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Any, ClassVar, Self

import numpy as np

from ..algebra import ZERO, Vec3, quat, triple, vec
from ..errors import MechanismError, SolveError
from ..forces import Forces
from ..jet import Jet
from ..joints.base import triad
from ..mechanism.loads import Bushing, Force, SpringDamper, Torque, TorsionSpringDamper
from ..mechanism.mechanism import GROUND, Mechanism, Point, Vector
from ..mechanism.motions import JointDriver, PointCoordinate
from ..primitives.base import Pose
from ..trajectory import Array
from .case import HELD_BUT
from .pose_measures import COORDINATES, Measure, coordinate_of, place_on
from .quantity import AXES, FACT, HIDDEN, MARKER, Axis, Quantity

NEWTON, NEWTON_METRE = "N", "N m"


# A coordinate that moves by less than this part of the driver's does not determine the motion
# there [rad or m by rad or m]: the effort at it would have lost all digits.
DEAD_CENTRE = 1e-9


class Frame(StrEnum):
    """Axes of a reaction's components: global; those of the second body, as its Euler parameters
    have them; or of the joint, z along its axis, carried by the second body.
    """

    GLOBAL = "global"
    BODY = "body"
    JOINT = "joint"


@dataclass(frozen=True)
class ForceMeasure(Measure):
    """Base of the measures of forces; each reads one joint, driver or force element.

    Attributes:
        of_key: the key that names it.
        turns: whether the value is a torque or moment.
    """

    measure = NEWTON

    of_key: ClassVar[str]

    turns: bool = field(default=False, kw_only=True, metadata=FACT)

    @property
    def read(self) -> str:
        """Name of the joint, driver or force element."""
        return getattr(self, self.of_key)

    @property
    def points(self) -> tuple[str, ...]:
        return (f"{MARKER}{self.read}: force",)  # engines follow a motion by the points of outputs

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        body, place = self.place(mechanism)
        return [Point(self.points[0], body, place)]

    @abstractmethod
    def place(self, mechanism: Mechanism) -> tuple[str, Vector]:
        """Return the body it acts on, and the body's point, global at design [m]."""

    @property
    def follows_points(self) -> bool:
        """Whether the value needs the places of points at the samples; see `with_points`."""
        return False

    def with_points(self, at: Mapping[str, Vec3]) -> Self:
        """Return the measure at samples.

        Args:
            at: positions of its points as jets [m].
        """
        return self

    @property
    def forces(self) -> tuple[str, ...]:
        return (self.read,)

    @property
    def unit(self) -> str:
        return NEWTON_METRE if self.turns else NEWTON

    @property
    def orders(self) -> int:
        return 1

    def check(self, mechanism: Mechanism) -> None:
        super().check(mechanism)
        if not mechanism.has_loads:
            raise MechanismError(
                "no body has mass and no force element acts, so all forces are zero; give bodies"
                " mass, center_of_mass and inertia, or add [forces.NAME]",
                f"outputs.{self.name}.type",
            )

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        raise SolveError(f"output {self.name!r} is a force, and no function of points")

    @abstractmethod
    def values(self, forces: Forces) -> Array:
        """Return the measure over the samples, NaN if missing or undetermined."""

    def undetermined(self, forces: Forces) -> str:
        """Return a message if redundant rows leave the measure undetermined, or nothing."""
        return ""


@dataclass(frozen=True)
class _JointReaction(ForceMeasure):
    of_key = "joint"

    joint: str
    component: Axis | None = None
    direction: Vector | None = None
    frame: Frame = Frame.GLOBAL
    about: str | None = None
    bodies: tuple[str, str] = field(default=("", ""), kw_only=True, metadata=FACT)
    tip: Vector | None = field(default=None, kw_only=True, metadata=HIDDEN)
    now: Array | None = field(default=None, kw_only=True, metadata=HIDDEN, compare=False)
    arm: Array | None = field(default=None, kw_only=True, metadata=HIDDEN, compare=False)

    def check(self, mechanism: Mechanism) -> None:
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
        if self.about is not None and not self.turns:
            raise MechanismError(
                "found about for a force, which is the same about any point; remove it, or give"
                " type = 'joint_moment'",
                f"{key}.about",
            )
        if self.frame == Frame.JOINT and not hasattr(mechanism.joint(self.joint), "axis"):
            raise MechanismError(
                f"joint {self.joint!r} is {mechanism.joint(self.joint).type} and has no axis, which"
                ' its frame needs; give frame = "body" or "global"',
                f"{key}.frame",
            )

    def bound(self, mechanism: Mechanism) -> Self:
        """Return the measure with the joint's bodies, which its sense names, and the tip of its
        direction on the second body.
        """
        joint: Any = mechanism.joint(self.joint)
        bodies: tuple[str, str] = joint.bodies
        if self.frame == Frame.GLOBAL:
            return replace(self, bodies=bodies)
        axes = np.eye(3)
        if self.frame == Frame.JOINT:
            axes = np.array([[*each] for each in triad(joint.axis)])
        elif bodies[1] != GROUND:
            frame = Pose.of(ZERO, quat(mechanism.body(bodies[1]).euler_parameters))
            axes = np.array([[*frame.turn(vec(each))] for each in np.eye(3).tolist()])
        x, y, z = (np.array(self.place(mechanism)[1]) + self.unit_direction @ axes).tolist()
        return replace(self, bodies=bodies, tip=(x, y, z))

    @property
    def points(self) -> tuple[str, ...]:
        """The point of action, the tip of the direction, and the point of the moment."""
        tip = (f"{super().points[0]} along {self.name}",) if self.frame != Frame.GLOBAL else ()
        return (*super().points, *tip, *((self.about,) if self.about is not None else ()))

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return the point of action, and the tip of the direction."""
        found = super().markers(mechanism)
        if self.tip is None:
            return found
        return [*found, Point(self.points[1], self.place(mechanism)[0], self.tip)]

    @property
    def follows_points(self) -> bool:
        """Whether direction or point move."""
        return self.frame != Frame.GLOBAL or self.about is not None

    def with_points(self, at: Mapping[str, Vec3]) -> Self:
        """Return the measure with its direction and its moment's arm at the samples."""
        if not self.follows_points:
            return self
        places = [np.stack([jet.x for jet in at[name]], axis=1) for name in self.points]
        now = places[1] - places[0] if self.frame != Frame.GLOBAL else None
        arm = places[0] - places[-1] if self.about is not None else None
        return replace(self, now=now, arm=arm)

    def place(self, mechanism: Mechanism) -> tuple[str, Vector]:
        return _joint_place(mechanism, self.joint)

    @property
    def unit_direction(self) -> Vector:
        """The direction, global unit vector [-]."""
        if self.component is not None:
            return AXES[self.component]
        direction = self.direction or (0.0, 0.0, 0.0)
        length = math.hypot(*direction)
        x, y, z = (component / length for component in direction)
        return x, y, z

    @property
    def sense(self) -> str:
        """Which body exerts it on which, about which point, along which direction."""
        along = self.component or f"[{', '.join(f'{x:.6g}' for x in self.unit_direction)}]"
        first, second = self.bodies
        where = {
            Frame.GLOBAL: "global",
            Frame.BODY: f"{second!r}'s own",
            Frame.JOINT: "the joint's own",
        }[self.frame]
        positive = self.positive
        if self.about is not None:
            positive = f"moment about {self.about!r}"
        return f"{positive}, by {first!r} on {second!r}, along {where} {along}"

    def values(self, forces: Forces) -> Array:
        reaction = forces.joints[self.joint]
        if self.follows_points and self.now is None and self.arm is None:
            raise SolveError(
                f"output {self.name!r} turns with a body or is about a point, which this study does"
                ' not follow; give frame = "global" without about'
            )
        if self.arm is not None:
            reaction = reaction.about(self.arm)
        return reaction.along(
            self.unit_direction if self.now is None else self.now, moment=self.turns
        )

    def undetermined(self, forces: Forces) -> str:
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
    """Force of a joint's first body on its second, along an axis or direction of the frame:
    "global", or of the second "body" or the "joint" (z along its axis), both turning along.
    """

    type = "joint_force"
    positive = "force"


@dataclass(frozen=True)
class JointMoment(_JointReaction):
    """Moment of a joint's first body on its second, about the joint's point on the second body, or
    a point named by `about`; frame as of a force.
    """

    type = "joint_moment"
    measure = NEWTON_METRE
    positive = "moment about the joint's point on the second body"

    turns: bool = field(default=True, kw_only=True, metadata=FACT)


@dataclass(frozen=True)
class DriverEffort(ForceMeasure):
    """Force or torque of a driver, in the positive sense of its coordinate: effort times rate is
    the power it puts in. With `at`, that of an actuator at this joint in the driver's place, by
    virtual work; other drivers hold.
    """

    type = "driver_effort"
    positive = "along the driver's coordinate, so that effort times rate is the power put in"
    of_key = "driver"

    driver: str
    at: str | None = None
    rates: tuple[Quantity, ...] = field(default=(), kw_only=True, metadata=HIDDEN)
    alone: tuple[str, ...] = field(default=(), kw_only=True, metadata=HIDDEN)
    ratio: Array | None = field(default=None, kw_only=True, metadata=HIDDEN, compare=False)

    @property
    def facts(self) -> Mapping[str, Any]:
        """All keys and the unit; the driver whose motion alone counts, if there are others."""
        return {**super().facts, **({HELD_BUT: [*self.alone]} if self.alone else {})}

    @property
    def sense(self) -> str:
        """The coordinate of the effort."""
        if self.at is None:
            return super().sense
        return f"positive: along the coordinate of joint {self.at!r}, in place of {self.driver!r}"

    def check(self, mechanism: Mechanism) -> None:
        """Raise MechanismError unless the joint of `at`, if any, has a coordinate to drive."""
        super().check(mechanism)
        if self.at is not None:
            joint = mechanism.joint(self.at)
            if not COORDINATES.keys() & {*joint.freedoms}:
                raise MechanismError(
                    f"joint {self.at!r} is {joint.type} and has no rotation or translation for an"
                    " effort; name another joint",
                    f"outputs.{self.name}.at",
                )

    def bound(self, mechanism: Mechanism) -> Self:
        """Return the measure with the unit of the effort, and the rates of both coordinates."""
        driver: Any = mechanism.driver(self.driver)
        if self.at is None:
            return replace(self, turns=driver.turns)
        joint = mechanism.joint(self.at)
        there = next(each for each in COORDINATES if each in joint.freedoms)
        own = coordinate_of(driver, relative=False)
        rates = COORDINATES[there](self.name, 0.0, 0.0, "", joint=self.at), own
        alone = (self.driver,) if len(mechanism.drivers) > 1 else ()
        return replace(self, turns=there == "rotation", rates=rates, alone=alone)

    @property
    def points(self) -> tuple[str, ...]:
        """The point of action, and those of both coordinates."""
        every = [name for rate in self.rates for name in rate.points]
        return tuple(dict.fromkeys((*super().points, *every)))

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return the point of action, and the markers of both coordinates."""
        own = [point for rate in self.rates for point in rate.markers(mechanism)]
        return [*super().markers(mechanism), *own]

    @property
    def follows_points(self) -> bool:
        """Whether rates convert the effort."""
        return self.at is not None

    def with_points(self, at: Mapping[str, Vec3]) -> Self:
        """Return the measure with the ratio of rates at the samples; NaN at a dead centre."""
        if not self.rates:
            return self
        there, own = (rate.of(at, at).v for rate in self.rates)
        with np.errstate(all="ignore"):
            still = np.abs(there) <= DEAD_CENTRE * np.abs(own)
            return replace(self, ratio=np.where(still, np.nan, own / there))

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
        if self.at is None:
            return forces.drivers[self.driver]
        if self.ratio is None:
            raise SolveError(
                f"output {self.name!r} is an effort at another joint, which this study does not"
                " follow; leave out at"
            )
        return forces.drivers[self.driver] * self.ratio

    def undetermined(self, forces: Forces) -> str:
        if self.ratio is None or not (still := int(np.isnan(self.ratio).sum())):
            return ""
        return (
            f"at {still} of {len(self.ratio)} samples joint {self.at!r} is at a dead centre of the"
            f" motion of driver {self.driver!r}, where no effort at it holds"
        )


@dataclass(frozen=True)
class ElementForce(ForceMeasure):
    """Force of a force element: tension of a spring-damper; torque of a torsional one on the
    joint's second body; amount of a constant force or torque, or of a bushing's force, or of its
    torque if it gives no force.
    """

    type = "element_force"
    positive = "tension of a spring; torque on the joint's second body of a torsional one"
    of_key = "force"

    force: str

    def bound(self, mechanism: Mechanism) -> Self:
        element = mechanism.force(self.force)
        turns = isinstance(element, TorsionSpringDamper | Torque)
        turns |= isinstance(element, Bushing) and element.turns_only
        return replace(self, turns=turns)

    def place(self, mechanism: Mechanism) -> tuple[str, Vector]:
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
        return forces.elements[self.force]


def _joint_place(mechanism: Mechanism, name: str) -> tuple[str, Vector]:
    joint = mechanism.joint(name)
    known = joint.points_on(joint.j)
    return joint.j, known[0] if known else triple(place_on(mechanism, joint.j))
