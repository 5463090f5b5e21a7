"""Mechanism: bodies, points, joints and drivers as data, names and shapes checked, no numerics.

All points and axes are global, at the design position, in SI units, as in a table of hardpoints.
`with_equivalents` gives the same mechanism with joints of known types only, by the equivalents
that joints declare.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

from ..caches import ByContent
from ..errors import MechanismError, Phrase, UnknownNameError, unknown, with_article
from ..input_checks import finite_numbers, held
from ..joints import Distance
from ..joints.base import AxialJoint, Joint, Kind, gap, unit
from ..joints.coupler import Coupler
from ..tabular import notebook
from ..trajectory import MARKER
from .body import Body, Vector
from .loads import Bushing, ForceElement, TorsionSpringDamper
from .motions import Driver, JointAngle, JointDisplacement, JointDriver, PointCoordinate
from .rods import end_of

GROUND = "ground"
"""The name of the global frame; it can be used like a body and needs no declaration."""

# Largest gap of a joint between fixed bodies [m]: the tightest default tolerance of any output.
HOLDS = 1e-9


@dataclass(frozen=True, slots=True)
class Point:
    """An output point of a body: position global at design [m]."""

    name: str
    body: str
    position: Vector

    def __post_init__(self) -> None:
        who = f"point {self.name!r}: position"
        position = finite_numbers(who, self.position, 3, Kind.POSITION.value)
        object.__setattr__(self, "position", position)


@dataclass(frozen=True)
class Reduced:
    """A joint with rows left out, since others hold them within the digits of a file.

    Attributes:
        joint: as given, with all its rows.
        kept: names of joints of the mechanism, in its place with the rest of its conditions.
        left_out: joints with the conditions left out.
    """

    joint: Joint
    kept: tuple[str, ...]
    left_out: tuple[Joint, ...]

    def changed(self, way: Callable[[Joint], Any]) -> Reduced:
        """Return the same with its joints changed by a function."""
        return replace(self, joint=way(self.joint), left_out=tuple(map(way, self.left_out)))


KINDS: Mapping[str, type] = {
    "bodies": Body,
    "joints": Joint,
    "points": Point,
    "drivers": Driver,
    "couplers": Coupler,
    "forces": ForceElement,
    "bushings": Bushing,
}
"""Members of a mechanism, and the class of each."""


@dataclass(frozen=True, eq=False)
class Mechanism(ByContent):
    """A named set of bodies, joints, points, drivers and loads.

    Attributes:
        grounded: joints between two fixed bodies, as in CAD exports. They are removed from
            `joints`: they hold in any motion, and no engine has rows for them.
        gravity: acceleration of free fall, global axes [m/s^2].
        forces: force elements.
        reduced: joints with fewer rows in `joints` than given. A motion needs no more, but loads
            are shared with the rows left out.
        bushings: of joints; see `released`.

    Raises:
        MechanismError: a name is used twice or does not exist, or a joint between fixed bodies does
            not hold at the design position, or is driven or coupled.
    """

    name: str
    bodies: Sequence[Body]
    joints: Sequence[Joint]
    points: Sequence[Point] = field(default=())
    drivers: Sequence[Driver] = field(default=())
    couplers: Sequence[Coupler] = field(default=())
    grounded: Sequence[Joint] = field(default=())
    gravity: Vector = (0.0, 0.0, 0.0)
    forces: Sequence[ForceElement] = field(default=())
    reduced: Sequence[Reduced] = field(default=())
    bushings: Sequence[Bushing] = field(default=())

    def __post_init__(self) -> None:
        object.__setattr__(self, "reduced", tuple(self.reduced))
        if self.grounded:
            object.__setattr__(self, "joints", (*self.joints, *self.grounded))
        for what, kind in KINDS.items():
            who, one = f"mechanism {self.name!r}: {what}", with_article(kind.__name__)
            members = held(who, getattr(self, what), None, f"a list, each {one}")
            for each in members:
                if not isinstance(each, kind):
                    raise MechanismError(
                        f"{who} has {each!r}, expected {one}; check the order of the arguments"
                    )
            object.__setattr__(self, what, members)
            twice = [name for name, k in Counter(x.name for x in members).items() if k > 1]
            if twice:
                raise MechanismError(
                    f"{what}: the name {min(twice)!r} is used more than once; names must be unique",
                    what,
                )
        if any(body.name == GROUND for body in self.bodies):
            raise MechanismError(
                f"body {GROUND!r} exists by itself; give the fixed body another name or leave"
                " it out",
                "bodies",
            )
        for joint in self.joints:
            for name in joint.bodies:
                self._require_body(str(joint), name, f"joints.{joint.name}.bodies")
        self._leave_out_grounded()
        for point in self.points:
            self._require_body(f"point {point.name!r}", point.body, f"points.{point.name}.body")
        for coupler in self.couplers:
            who, key = str(coupler), f"joints.{coupler.name}.joints"
            for name, freedom in zip(coupler.joints, coupler.freedoms, strict=True):
                joint = self._require("joint", who, name, key)
                _require_freedom(who, joint, freedom, f"{freedom} to couple", key)
        for driver in self.drivers:
            if isinstance(driver, PointCoordinate):
                who, key = f"driver {driver.name!r}", f"drivers.{driver.name}.point"
                point = self._require("point", who, driver.point, key)
                if self.is_fixed(point.body):
                    raise MechanismError(
                        f"{who}: point {driver.point!r} is on {point.body!r}, which is fixed; drive"
                        " a point of a moving body",
                        key,
                    )
            elif isinstance(driver, JointDriver):
                who, key = f"driver {driver.name!r}", f"drivers.{driver.name}.joint"
                joint, wanted = self._require("joint", who, driver.joint, key), driver.freedom
                who = f"{who} ({driver.type})"
                _require_freedom(who, joint, wanted, f"{wanted} to drive", key)
        self._check_loads()

    def __repr__(self) -> str:
        """Return the names of the members in one line; a point that the case reader adds is none
        of the user's.
        """
        named = {
            "bodies": self.bodies,
            "joints": self.joints,
            "grounded": self.grounded,
            "couplers": self.couplers,
            "points": [each for each in self.points if not each.name.startswith(MARKER)],
            "drivers": self.drivers,
            "forces": self.forces,
        }
        told = [
            f"{what}: {', '.join(each.name for each in found)}"
            for what, found in named.items()
            if found
        ]
        return f"<Mechanism: {'; '.join([self.name, *told])}>"

    def _repr_html_(self) -> str:
        """Return the design position for a notebook."""
        return self.to_html(repr(self))

    def to_html(self, title: str) -> str:
        """Return the design position as HTML, below a title."""
        return notebook("mechanism", title, self)

    def _check_loads(self) -> None:
        gravity = finite_numbers("gravity", self.gravity, 3, "three numbers [m/s^2]")
        object.__setattr__(self, "gravity", gravity)
        for force in self.forces:
            key = f"forces.{force.name}"
            if isinstance(force, TorsionSpringDamper):
                joint = self._require("joint", str(force), force.joint, f"{key}.joint")
                _require_freedom(str(force), joint, "rotation", "rotation", f"{key}.joint")
                continue
            key = f"{key}.{'body' if len(force.bodies) == 1 else 'bodies'}"
            for name in force.bodies:
                self._require_body(str(force), name, key)

        for bushing in self.bushings:
            key = f"joints.{bushing.joint}.bushings"
            rod = self._require("joint", str(bushing), bushing.joint, key)
            for name in bushing.bodies:
                self._require_body(str(bushing), name, key)
            if isinstance(rod, Distance):
                end_of(rod, bushing)

    def _require_body(self, who: str, name: str, key: str) -> None:
        if name != GROUND:
            self._require("body", who, name, key)

    def _require(self, what: str, who: str, name: str, key: str) -> Any:
        """Return a member that something names.

        Raises:
            MechanismError: there is none.
        """
        known = self._members["bodies" if what == "body" else f"{what}s"]
        if name in known:
            return known[name]
        names = [GROUND, *known] if what == "body" else known
        raise MechanismError(f"{who}: {unknown(what, name, names)}", key)

    def _leave_out_grounded(self) -> None:
        """Separate the joints between fixed bodies from all others."""
        still = tuple(joint for joint in self.joints if all(map(self.is_fixed, joint.bodies)))
        object.__setattr__(self, "grounded", still)
        if not still:
            return
        names = {joint.name for joint in still}
        object.__setattr__(
            self, "joints", tuple(joint for joint in self.joints if joint.name not in names)
        )
        needed = {
            driver.joint: f"driver {driver.name!r}"
            for driver in self.drivers
            if isinstance(driver, JointDriver)
        }
        needed |= {name: str(coupler) for coupler in self.couplers for name in coupler.joints}
        for joint in still:
            who = f"{joint}: {joint.i!r} and {joint.j!r} are both fixed"
            if joint.name in needed:
                raise MechanismError(
                    f"{who}, and {needed[joint.name]} needs it to move; free one of them",
                    f"joints.{joint.name}.bodies",
                )
            if (off := gap(joint)) > HOLDS:
                raise MechanismError(
                    Phrase(
                        f"{who}, and at the design position it is off by ",
                        float(f"{off:.3g}"),
                        "; correct its length, free one of them or remove the joint",
                    ),
                    f"joints.{joint.name}",
                )

    def is_fixed(self, name: str) -> bool:
        """Return whether the named body is the ground or fixed to it."""
        return name == GROUND or self.body(name).fixed

    def body(self, name: str) -> Body:
        """Return the body of this name.

        Raises:
            UnknownNameError: there is none.
        """
        return self._member("bodies", "body", name)

    def joint(self, name: str) -> Joint:
        """Return the joint of this name, as given.

        Raises:
            UnknownNameError: there is none.
        """
        return self._member("joints", "joint", name)

    def point(self, name: str) -> Point:
        """Return the point of this name.

        Raises:
            UnknownNameError: there is none.
        """
        return self._member("points", "point", name)

    def driver(self, name: str) -> Driver:
        """Return the driver of this name.

        Raises:
            UnknownNameError: there is none.
        """
        return self._member("drivers", "driver", name)

    def force(self, name: str) -> ForceElement:
        """Return the force element of this name.

        Raises:
            UnknownNameError: there is none.
        """
        return self._member("forces", "force element", name)

    def _member(self, kind: str, what: str, name: str) -> Any:
        named = self._members[kind]
        try:
            return named[name]
        except (KeyError, TypeError):
            raise UnknownNameError(what, name, named) from None

    def reaction_point(self, joint: Joint) -> Vector:
        """Return the point of a joint's reaction, which its second body carries, global at design
        [m]: the joint's own, or else the origin of the second body, or of the first if the second
        is fixed.
        """
        free = joint.i if self.is_fixed(joint.j) else joint.j
        return next(iter(joint.points_on(joint.j)), None) or self.body(free).origin

    def with_joints(self, way: Callable[[Joint], Any], **changes: Any) -> Mechanism:
        """Return the mechanism with all joints changed by a function, and with other changes."""
        reduced = [each.changed(way) for each in self.reduced]
        return replace(self, joints=[*map(way, self.joints)], reduced=reduced, **changes)

    @property
    def given_joints(self) -> tuple[Joint, ...]:
        """The joints as given: those of `joints`, the reduced ones whole; those without a row left
        are last.
        """
        every = [self.joint(self.given_name(joint.name)) for joint in self.joints]
        every += [each.joint for each in self.reduced]
        return tuple({joint.name: joint for joint in every}.values())

    def given_name(self, name: str) -> str:
        """Return the name of the given joint of a joint of the mechanism."""
        return self._parts.get(name, name)

    def parts_of(self, name: str) -> tuple[str, ...]:
        """Return the names of the mechanism's joints in place of a given joint."""
        return tuple(each.name for each in self.joints if self.given_name(each.name) == name)

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields alone: what was computed from them must not change the pickle, which
        keys the cache of compiled programs.
        """
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @cached_property
    def _parts(self) -> Mapping[str, str]:
        return {part: each.joint.name for each in self.reduced for part in each.kept}

    @property
    def has_loads(self) -> bool:
        """Whether a body has mass or a force element acts: otherwise all forces are zero."""
        return bool(self.forces) or any(body.mass > 0.0 for body in self.moving)

    def design_value(self, name: str) -> float:
        """Return the value of a driver at the design position: the coordinate of its point [m] if
        absolute, else zero.
        """
        driver = self.driver(name)
        if not isinstance(driver, PointCoordinate) or driver.relative:
            return 0.0
        return sum(
            (
                d * x
                for d, x in zip(
                    unit(driver.direction), self.point(driver.point).position, strict=True
                )
            ),
            0.0,
        )

    @cached_property
    def joints_on(self) -> Mapping[str, Sequence[Joint]]:
        """Joints by the bodies that they join."""
        found: dict[str, list[Joint]] = {}
        for joint in self.joints:
            for body in joint.bodies:
                found.setdefault(body, []).append(joint)
        return found

    @cached_property
    def _places(self) -> Sequence[Vector]:
        return [place for joint in self.joints for place in joint.points_on()]

    @cached_property
    def extent(self) -> float:
        """Largest extent along a global axis of the points of joints, and of those that are no
        markers [m].
        """
        points = (p.position for p in self.points if not p.name.startswith(MARKER))
        return extent([*self._places, *points])

    @cached_property
    def size(self) -> float:
        """Extent of the joints' points [m], or of all points if the joints' have none.

        A single pivot has joints without extent. A metre instead would be the unit of a mechanism
        of micrometres, whose residuals and singular values would be too small to detect.
        """
        points = [point.position for point in self.points]
        return extent(self._places) or extent([*self._places, *points]) or 1.0

    @cached_property
    def _members(self) -> Mapping[str, Mapping[str, Any]]:
        """Members by kind and name."""
        all_of = {
            "bodies": self.bodies,
            "joints": (*self.joints, *self.grounded),
            "points": self.points,
            "drivers": self.drivers,
            "forces": self.forces,
        }
        named = {what: {each.name: each for each in found} for what, found in all_of.items()}
        named["joints"] |= {each.joint.name: each.joint for each in self.reduced}
        return named

    @cached_property
    def moving(self) -> tuple[Body, ...]:
        """The bodies not fixed, in order."""
        return tuple(body for body in self.bodies if not body.fixed)


def _require_freedom(who: str, joint: Joint, freedom: str, missing: str, key: str) -> None:
    if freedom not in joint.freedoms:
        raise MechanismError(
            f"{who}: joint {joint.name!r} is {joint.type} and has no {missing}; its freedoms:"
            f" {', '.join(joint.freedoms) or 'none'}",
            key,
        )


def extent(points: Sequence[Sequence[float]]) -> float:
    """Return the largest extent of points along a global axis [m]; zero without points."""
    return max((max(axis) - min(axis) for axis in zip(*points, strict=True)), default=0.0)


def coordinates(mechanism: Mechanism) -> dict[str, Driver]:
    """Return the drivers by name; and of every joint the drivers of its coordinates, as
    JOINT.rotation or JOINT.translation, and as JOINT where it has one.
    """
    found: dict[str, Driver] = {}
    for joint in mechanism.joints:
        if not isinstance(joint, AxialJoint):
            continue
        for freedom in joint.freedoms:
            kind = JointAngle if freedom == JointAngle.freedom else JointDisplacement
            name = f"{joint.name}.{freedom}"
            found[name] = kind(name, joint.name)
        if len(joint.freedoms) == 1:
            found[joint.name] = found[f"{joint.name}.{joint.freedoms[0]}"]
    return found | {each.name: each for each in mechanism.drivers}


def with_equivalents(mechanism: Mechanism, known: Collection[type[Joint]]) -> Mechanism:
    """Return the mechanism with joints of other types replaced by their equivalents.

    Bodies that are added have no mass. Joints without an equivalent stay. A driver or a coupler
    that names a joint needs a joint of this name among the equivalents.

    Args:
        known: exact types of the joints that stay.
    """
    if all(type(joint) in known for joint in mechanism.joints):
        return mechanism
    parts = [part for joint in mechanism.joints for part in _parts(joint, known)]
    added = [part for part in parts if isinstance(part, Body)]
    joints = [part for part in parts if isinstance(part, Joint)]
    if joints == list(mechanism.joints):
        return mechanism
    return replace(mechanism, bodies=[*mechanism.bodies, *added], joints=joints)


def replaced_joints(mechanism: Mechanism, known: Collection[type[Joint]]) -> dict[str, list[str]]:
    """Return the joints that have equivalents in place, by name: the types of those joints."""
    return {
        joint.name: [part.type for part in _parts(joint, known) if isinstance(part, Joint)]
        for joint in mechanism.joints
        if type(joint) not in known and declared_equivalent(joint) is not None
    }


def _parts(
    joint: Joint, known: Collection[type[Joint]], inside: tuple[type[Joint], ...] = ()
) -> Iterator[Body | Joint]:
    """Yield the bodies and joints in place of a joint, or the joint itself."""
    offered = None if type(joint) in (*known, *inside) else declared_equivalent(joint)
    if offered is None:
        yield joint
        return
    bodies, joints = offered
    yield from bodies
    for each in joints:
        yield from _parts(each, known, (*inside, type(joint)))


def declared_equivalent(joint: Joint) -> tuple[list[Body], list[Joint]] | None:
    """Return the equivalent of a joint; None if its type declares none.

    An equivalent is of the primitives beside it: a subclass with other primitives inherits none.
    """
    for cls in type(joint).__mro__:
        if "equivalent" in vars(cls):
            found = joint.equivalent()
            return None if found is None else ([*found[0]], [*found[1]])
        if "primitives" in vars(cls):
            return None
    return None
