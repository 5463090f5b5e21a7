"""Measures: outputs of joints, bodies, pairs of points, and forces.

A new type is a frozen dataclass with `type`, `measure`, `positive`, its keys as fields, and a
formula over the motion of points. The class declaration registers it: case files can name it at
once and write it, and `kincheck list --outputs` prints it. A field named in `NAMES`
holds names of the mechanism, and is checked.

Formulas read points only, and every engine gives every measure: the angle of a joint is the angle
between markers on its bodies, and rotations follow from the directions of markers. Measures of
forces read the forces of a solution instead, and have no rates.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import Field, dataclass, field
from enum import StrEnum
from typing import Any, ClassVar, Self

import numpy as np

from ..algebra import Scalar, Vec3, X, Y, cross, is_array, quat, root, triple, vec, where_larger
from ..errors import MechanismError, unknown
from ..jet import Jet, arctan2, choose, norm, sqrt
from ..joints.base import triad, unit
from ..mechanism.mechanism import GROUND, Mechanism, Point, Vector
from ..mechanism.motions import JointDriver, PointCoordinate
from ..trajectory import Array
from .quantity import MARKER, Output, Quantity, TypedQuantity, own_keys

# Below this square of |e| = sin(angle / 2) a series is exact in double precision, and a quotient by
# |e| loses digits.
_SMALL, _TERMS = 1e-3, 7


def euler_parameters(x: Vec3, y: Vec3) -> list[Jet]:
    """Return e0..e3 of the rotation from the global x and y axes to the unit vectors x and y.

    The parameters and their negatives are the same rotation, and either is returned; `signs` tells
    which along a sweep. The largest of e0..e3 is found by a root and the others by division by it,
    so that none is singular.
    """
    z = cross(x, y)
    products: list[list[Jet]] = [  # 4 e_i e_j
        [1.0 + x.x + y.y + z.z, y.z - z.y, z.x - x.z, x.y - y.x],
        [y.z - z.y, 1.0 + x.x - y.y - z.z, x.y + y.x, z.x + x.z],
        [z.x - x.z, x.y + y.x, 1.0 - x.x + y.y - z.z, y.z + z.y],
        [x.y - y.x, z.x + x.z, y.z + z.y, 1.0 - x.x - y.y + z.z],
    ]
    largest, row = products[0][0], products[0]
    for k in range(1, 4):
        size = products[k][k]
        # products are symmetric
        row = [choose(size.x, largest.x, p, q) for p, q in zip(products[k], row, strict=True)]
        largest = choose(size.x, largest.x, size, largest)
    own = sqrt(largest)
    return [each / (2.0 * own) for each in row]


def smallest(e: Sequence[Jet], within: float = 0.0) -> list[Jet]:
    """Return the Euler parameters of the same rotation with e0 not negative, for one up to half a
    turn.

    Args:
        within: a rotation that is larger by no more than this keeps its sign [rad].
    """
    # |e0 - 1| is larger where e0 is below -within / 2
    return with_signs(where_larger(e[0].x - 1.0, 1.0 + 0.5 * within, -1.0, 1.0), e)


def with_signs(sign: Scalar, e: Sequence[Jet]) -> list[Jet]:
    """Return Euler parameters with another sign at the samples."""
    return [each * sign for each in e]


def floats(e: Sequence[Jet]) -> Array:
    """Return the values of jets as doubles, shape (4, n, ...)."""
    return np.array([np.asarray(each.x).astype(np.float64) for each in e])


def angular_velocity(e: Sequence[Jet]) -> Array:
    """Return the angular velocity of Euler parameters as doubles [rad/s], global axes, shape
    (3, n, ...); NaN if unknown.
    """
    rates = np.array([np.asarray(each.v).astype(np.float64) for each in e])
    return np.array([*(2.0 * (quat(rates) * quat(floats(e)).conjugate()).e)])


def rotation_vector(e: Sequence[Jet]) -> list[Jet]:
    """Return axis times angle [rad] of Euler parameters of about half a turn at most."""
    e0, *along = e
    square = along[0] * along[0] + along[1] * along[1] + along[2] * along[2]
    size = sqrt(square)
    quotient = 2.0 * arctan2(size, e0) / size
    series, coefficient, power = 0.0 * square, 2.0, 0.0 * square + 1.0
    for k in range(_TERMS):  # of 2 arcsin(r) / r
        series = series + coefficient * power
        power = power * square
        coefficient *= (2 * k + 1) ** 2 / ((2 * k + 2) * (2 * k + 3))
    # exact numbers, which are objects, have digits enough for the quotient
    exact = is_array(square.x) and square.x.dtype == object
    factor = choose(square.x, 0.0 if exact else _SMALL, quotient, series)
    return [factor * each for each in along]


NAMES: Mapping[str, str] = {
    "points": "point",
    "joint": "joint",
    "body": "body",
    "bodies": "body",
    "driver": "driver",
    "about": "point",
    "at": "joint",
    "force": "force",
}
"""Keys that hold names, and the kind of what they name."""


@dataclass(frozen=True)
class Measure(TypedQuantity):
    """A quantity of the pose, in the unit `measure`.

    Attributes:
        atol, rtol: an error is accepted up to atol [unit] + rtol * range of the reference.
    """

    registry: ClassVar[dict[str, type[Measure]]] = {}

    name: str
    atol: float
    rtol: float
    why: str

    @property
    @abstractmethod
    def points(self) -> tuple[str, ...]:
        """Names of the points it reads."""

    def check(self, mechanism: Mechanism) -> None:
        """Raise MechanismError unless the mechanism has all its names."""
        known: Mapping[str, Iterable[str]] = {
            "point": [p.name for p in mechanism.points if not p.name.startswith(MARKER)],
            "joint": [joint.name for joint in (*mechanism.given_joints, *mechanism.grounded)],
            "body": [GROUND, *(body.name for body in mechanism.bodies)],
            "driver": [driver.name for driver in mechanism.drivers],
            "force": [force.name for force in mechanism.forces],
        }
        for each in own_keys(type(self)):
            if (kind := NAMES.get(key_of(each))) is None:
                continue
            found: str | tuple[str, ...] | None = getattr(self, each.name)
            for name in (found,) if isinstance(found, str) else found or ():
                if name not in known[kind]:
                    raise MechanismError(
                        unknown(kind, name, known[kind]), f"outputs.{self.name}.{key_of(each)}"
                    )

    def bound(self, mechanism: Mechanism) -> Self:
        """Return the measure with the facts it needs of the mechanism."""
        return self


def key_of(each: Field[Any]) -> str:
    """Return the key of a field in case files."""
    return each.metadata.get("key", each.name)


def length(design: Mapping[str, Vec3], start: str, end: str) -> Any:
    """Return the distance between two points at design [m]."""
    along = design[end] - design[start]
    return sqrt(along @ along).x


def place_on(mechanism: Mechanism, body: str) -> Vec3:
    """Return a place on a body near its joints and points [m]."""
    places = [p for joint in mechanism.joints_on.get(body, ()) for p in joint.points_on(body)]
    if places:
        return vec(places[0])
    places += [point.position for point in mechanism.points if point.body == body]
    if body != GROUND:
        places.append(mechanism.body(body).origin)
    return vec(places[0] if places else (0.0, 0.0, 0.0))


def reach_of(mechanism: Mechanism) -> float:
    """Return the distance of markers from their place [m], a power of two near the mechanism's
    size: directions then keep all digits of positions.
    """
    extent = mechanism.extent
    return 2.0 ** round(math.log2(extent)) if extent else 1.0


ROUND_OFF = 1e-9
"""Of an angle, a thousand times what engines differ by [rad]."""


class Component(StrEnum):
    """A component of the rotation vector [rad], or an Euler parameter [-]."""

    X = "x"
    Y = "y"
    Z = "z"
    E0 = "e0"
    E1 = "e1"
    E2 = "e2"
    E3 = "e3"


@dataclass(frozen=True)
class Orientation(Measure):
    """Rotation of a body since design: of its rotation vector or Euler parameters, global axes.

    The rotation vector is axis times angle, up to half a turn: beyond it, it is that of the smaller
    rotation the other way round. The sign of Euler parameters is continuous from the design.
    """

    type = "orientation"
    measure = "rad"
    positive = "about the global axis, by the right-hand rule"

    body: str
    component: Component

    @property
    def unit(self) -> str:
        return "rad" if self.component in ("x", "y", "z") else "1"

    @property
    def points(self) -> tuple[str, ...]:
        """A place on the body, and two directions from there."""
        return tuple(f"{MARKER}body {self.body}: {what}" for what in ("place", "x", "y"))

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        place, reach = place_on(mechanism, self.body), reach_of(mechanism)
        tips = (place, place + reach * X, place + reach * Y)
        marked = zip(self.points, tips, strict=True)
        return [Point(name, self.body, triple(tip)) for name, tip in marked]

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        """Return the component of the smallest rotation, [rad] or [-]."""
        return self.component_of(smallest(self.terms(at, design)))

    def terms(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Sequence[Jet]:
        """Return Euler parameters of the rotation since design, either sign."""
        place, *tips = self.points
        x, y = ((1.0 / length(design, place, tip)) * (at[tip] - at[place]) for tip in tips)
        return euler_parameters(x, y)

    def component_of(self, e: Sequence[Jet]) -> Jet:
        """Return the component of a rotation given by its Euler parameters, [rad] or [-]."""
        if self.unit == "1":
            return e[int(self.component[1])]
        # engines that agree but for round-off must not differ by a whole turn at half a turn
        rotation = rotation_vector(smallest(e, max(ROUND_OFF, self.atol)))
        return rotation["xyz".index(self.component)]


@dataclass(frozen=True)
class _JointCoordinate(Measure):
    freedom: ClassVar[str]

    joint: str
    at_design: float = field(default=0.0, metadata={"unless": 0.0})
    """Its value at the design position: that of a model's coordinate, whose zero is elsewhere."""

    def check(self, mechanism: Mechanism) -> None:
        super().check(mechanism)
        joint = mechanism.joint(self.joint)
        if self.freedom not in joint.freedoms:
            raise MechanismError(
                f"{joint} has no {self.freedom} to measure; its freedoms:"
                f" {', '.join(joint.freedoms) or 'none'}",
                f"outputs.{self.name}.joint",
            )

    def _marker(self, what: str) -> str:
        return f"{MARKER}joint {self.joint}: {what}"

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        """Return the points it reads: of both bodies, on the joint's axis and beside it."""
        joint: Any = mechanism.joint(self.joint)
        f, g, h = triad(joint.axis)
        place, reach = vec(joint.point), reach_of(mechanism)
        tips = {
            "": place,
            " f": place + reach * f,
            " g": place + reach * g,
            " axis": place + reach * h,
        }
        every = [
            Point(self._marker(f"{which}{what}"), body, triple(tip))
            for which, body in (("first", joint.i), ("second", joint.j))
            for what, tip in tips.items()
        ]
        return [point for point in every if point.name in self.points]

    def _from_design(self, gone: Jet) -> Jet:
        return gone + self.at_design if self.at_design else gone


@dataclass(frozen=True)
class JointAngle(_JointCoordinate):
    """Rotation of a joint's second body relative to its first, from its value at design, or zero;
    turns count.

    If a study varies the axis, the measured axis stays nominal: the error is of second order.
    """

    type = "joint_angle"
    measure = "rad"
    positive = "second body about the axis, by the right-hand rule"
    freedom = "rotation"

    @property
    def points(self) -> tuple[str, ...]:
        """Two directions of the first body across the axis, and one of the second."""
        marked = ("first", "first f", "first g", "second", "second f")
        return tuple(map(self._marker, marked))

    @property
    def period(self) -> float:
        return 2.0 * math.pi

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        first, f, g, second, turned = (at[name] for name in self.points)
        arm = turned - second
        return self._from_design(arctan2((g - first) @ arm, (f - first) @ arm))


@dataclass(frozen=True)
class JointDisplacement(_JointCoordinate):
    """Displacement of a joint's second body relative to its first along the axis, from its value at
    design, or zero.

    If a study varies the axis, the measured axis stays nominal: the error is of second order.
    """

    type = "joint_displacement"
    measure = "m"
    positive = "second body along the axis"
    freedom = "translation"

    @property
    def points(self) -> tuple[str, ...]:
        """The axis on the first body, and the joint's point on the second."""
        return tuple(map(self._marker, ("first", "first axis", "second")))

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        first, tip, second = (at[name] for name in self.points)
        gone = ((tip - first) @ (second - first)) / length(design, *self.points[:2])
        return self._from_design(gone)


COORDINATES: Mapping[str, type[JointAngle | JointDisplacement]] = {
    cls.freedom: cls for cls in (JointAngle, JointDisplacement)
}
"""Measures of a joint's coordinates, by their freedom."""


def coordinate_of(driver: PointCoordinate | JointDriver, *, relative: bool = True) -> Quantity:
    """Return the coordinate of a driver, without a tolerance.

    Args:
        relative: whether that of a point is measured from the design position.
    """
    if isinstance(driver, JointDriver):
        cls = COORDINATES[driver.freedom]
        return cls(driver.name, 0.0, 0.0, "", joint=driver.joint)
    along = triple(unit(driver.direction))
    return Output(driver.name, driver.point, along, relative, 0.0, 0.0, "")


@dataclass(frozen=True)
class Distance(Measure):
    """Distance between two points, such as the length of a damper.

    Its rates are unknown while the points coincide.
    """

    type = "distance"
    measure = "m"
    positive = "longer"

    between: tuple[str, str] = field(metadata={"key": "points"})
    relative: bool = False

    @property
    def points(self) -> tuple[str, ...]:
        return self.between

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        return self._distance(at) - self._distance(design) if self.relative else self._distance(at)

    def _distance(self, at: Mapping[str, Vec3]) -> Jet:
        first, second = (at[name] for name in self.between)
        sizes = [norm(each, 0.0).x for each in (first, second)]
        return norm(second - first, where_larger(*sizes, *sizes))


@dataclass(frozen=True)
class Angle(Measure):
    """Angle between a direction of one body and a direction of another, 0 to pi.

    Its rates are unknown while they are parallel, to 1e-6 rad.

    Attributes:
        directions: global at design, any length but zero [-].
    """

    type = "angle"
    measure = "rad"
    positive = "wider"

    bodies: tuple[str, str]
    directions: tuple[Vector, Vector]
    relative: bool = False

    def check(self, mechanism: Mechanism) -> None:
        super().check(mechanism)
        if not all(map(any, self.directions)):
            raise MechanismError(
                "found zero, expected a direction; give one of any other length",
                f"outputs.{self.name}.directions",
            )

    @property
    def points(self) -> tuple[str, ...]:
        """A place on each body and the tip of its direction there."""
        marked = zip(self.bodies, self.directions, strict=True)
        return tuple(
            f"{MARKER}body {body}: {what}"
            for body, along in marked
            for what in ("place", " ".join(map(repr, along)))
        )

    def markers(self, mechanism: Mechanism) -> Sequence[Point]:
        reach, names = reach_of(mechanism), iter(self.points)
        found = list[Point]()
        for body, along in zip(self.bodies, self.directions, strict=True):
            place, d = place_on(mechanism, body), vec(along)
            tip = place + (reach / math.sqrt(d @ d)) * d
            found += [Point(next(names), body, triple(each)) for each in (place, tip)]
        return found

    def of(self, at: Mapping[str, Vec3], design: Mapping[str, Vec3]) -> Jet:
        return self._angle(at) - self._angle(design) if self.relative else self._angle(at)

    def _angle(self, at: Mapping[str, Vec3]) -> Jet:
        first, a, second, b = (at[name] for name in self.points)
        a, b = a - first, b - second
        size = root((a @ a).x * (b @ b).x)
        return arctan2(norm(cross(a, b), size), a @ b)
