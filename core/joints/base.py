"""Base of joints: two bodies, geometry at the design position, and a composition of primitives.

A new joint type is one file: a frozen dataclass with its geometry as fields (declared with
`position`, `direction`, ...) and the method `primitives`. Declaring the class registers it: case
files can name it at once.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import MISSING, dataclass, field, fields
from enum import Enum
from functools import cache, partial
from inspect import get_annotations
from typing import Any, ClassVar, Self

from ..algebra import ZERO, Scalar, Vec3, X, Y, Z, cross, root, vec, where_larger
from ..errors import MechanismError, Phrase
from ..failures import FailureKind
from ..input_checks import held, plain, require_direction, require_finite, triple
from ..primitives import (
    GROUND_POSE,
    Dot12,
    Dot20,
    DrivenAngle,
    NamedSlide,
    NamedTurn,
    Primitive,
)
from ..primitives import Spherical as SphericalCondition


class Kind(Enum):
    """Kind of a geometry field of a joint; it sets the shape and the unit for a reader."""

    POSITION = "a point [x, y, z]"
    DIRECTION = "a direction [x, y, z]"
    POSITIONS = "two points [[x, y, z] on the first body, [x, y, z] on the second]"
    DIRECTIONS = "two directions [[x, y, z] on the first body, [x, y, z] on the second]"
    LENGTH = "a length"
    NUMBER = "a number"

    @property
    def pair(self) -> bool:
        """Whether the field has one value on each body."""
        return self is not self.single

    @property
    def single(self) -> Kind:
        """Kind of each value of a pair; the kind itself if it is no pair."""
        return _SINGLE.get(self, self)


_SINGLE = {Kind.POSITIONS: Kind.POSITION, Kind.DIRECTIONS: Kind.DIRECTION}


def _geometry(kind: Kind, **options: Any) -> Any:
    return field(metadata={"kind": kind}, **options)


def position(**options: Any) -> Any:
    """Return a field: a point common to both bodies, global at design [m]."""
    return _geometry(Kind.POSITION, **options)


def direction() -> Any:
    """Return a field: a direction common to both bodies, global at design, not zero [-]."""
    return _geometry(Kind.DIRECTION)


def positions() -> Any:
    """Return a field: a point on each body, global at design [m]."""
    return _geometry(Kind.POSITIONS)


def directions() -> Any:
    """Return a field: a direction on each body, global at design, of non-zero length [-]."""
    return _geometry(Kind.DIRECTIONS)


def length(**options: Any) -> Any:
    """Return a field: a length [m]."""
    return _geometry(Kind.LENGTH, **options)


def unit(a: Sequence[Scalar]) -> Vec3:
    """Return the direction of a, length one."""
    v = vec(a)
    return (1.0 / root(v @ v)) * v


# Hardpoint tables carry three digits or more, so rounding tilts an axis by less than this; more
# is a mistake in the table. Within it the axes keep their design angle, as the two hinges of a
# simulator do.
ROUNDED_RIGHT_ANGLE = 1e-2


def require_perpendicular(joint: object, axes: Sequence[Sequence[float]]) -> None:
    """Raise MechanismError unless the two axes are perpendicular up to the rounding of a table."""
    cosine = unit(axes[0]) @ unit(axes[1])
    if abs(cosine) > ROUNDED_RIGHT_ANGLE:
        raise MechanismError(
            f"{joint}: the axes are not perpendicular, the cosine of their angle is {cosine:.3g}; "
            "expected 0 up to rounding of the table; give the two axes of the cross",
            kind=FailureKind.WRONG_ANGLE,
        )


def triad(axis: Sequence[Scalar]) -> tuple[Vec3, Vec3, Vec3]:
    """Return f, g, h: right-handed orthonormal, h along the axis (f x g = h)."""
    h = unit(axis)
    # the global axis most nearly perpendicular to h gives the best conditioned f
    nearest = X
    for e in (Y, Z):
        nearest = vec(
            [
                where_larger(nearest @ h, e @ h, new, old)
                for new, old in zip(e, nearest, strict=True)
            ]
        )
    f = unit(tuple(cross(nearest, h)))
    return f, cross(h, f), h


@dataclass(frozen=True, slots=True)
class Attachment:
    """A body at the design position as a joint uses it: its origin, and arms from there."""

    origin: Vec3

    def arm(self, P: Vec3) -> Vec3:
        """Return the vector from the body's origin to P, global at design [m]."""
        return P - self.origin


def _several(annotation: Any) -> bool:
    """Return whether an annotation is of several numbers, and not of a class attribute."""
    text = str(annotation)
    return "ClassVar" not in text and any(
        each in text for each in ("tuple", "Tuple", "list", "List", "Sequence", "Vector", "Vec3")
    )


def register(registry: dict[str, Any], cls: Any) -> None:
    """Register a type under its name for case files. The same class may be declared again, as when
    a module is reloaded or a cell is rerun.

    Raises:
        MechanismError: another class has the name; case files would silently mean this one instead.
    """
    known = registry.get(cls.type, cls)
    if (known.__module__, known.__qualname__) != (cls.__module__, cls.__qualname__):
        raise MechanismError(
            f"{cls.__name__}: type = {cls.type!r} is taken by"
            f" {known.__module__}.{known.__qualname__}; give it another name"
        )
    registry[cls.type] = cls


@dataclass(frozen=True)
class Joint(ABC):
    """A joint between a first body i and a second body j.

    Attributes:
        type: the name in case files.
        freedoms: the relative motions the joint leaves, as drivers name them.
        symmetric: both bodies may change places; false if geometry belongs to one of them (a line,
            a plane, a hinge).

    Raises:
        MechanismError: a number is not finite, a direction is zero, or a shape is wrong; or, at
            class declaration, another class has its type.
    """

    type: ClassVar[str]
    freedoms: ClassVar[tuple[str, ...]]
    symmetric: ClassVar[bool] = True
    registry: ClassVar[dict[str, type[Joint]]] = {}

    name: str
    i: str
    j: str

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        for name, annotation in get_annotations(cls).items():
            default = cls.__dict__.get(name)
            if _several(annotation) and "kind" not in getattr(default, "metadata", {}):
                raise MechanismError(
                    f"{cls.__name__}: {name} holds several numbers, but states no kind;"
                    f" declare it as {name}: ... = position(), direction(), positions() or"
                    " directions()"
                )
        if "type" in cls.__dict__:
            register(Joint.registry, cls)

    def __post_init__(self) -> None:
        if self.i == self.j:
            raise MechanismError(
                f"{self}: joins {self.i!r} with itself; a joint needs two different bodies"
            )
        for each in fields(self):
            if (
                each.metadata.get("kind")
                and each.default is MISSING
                and getattr(self, each.name) is None
            ):
                raise MechanismError(
                    f"{self}: {each.name} is None, expected {each.metadata['kind'].value}"
                )
        for name, kind, value in self.geometry():
            who, expected = f"{self}: {name}", kind.value
            if kind is Kind.LENGTH:
                value = plain(value)
                parts = [(value,)]
            elif kind.pair:
                value = parts = tuple(
                    triple(who, numbers, expected) for numbers in held(who, value, 2, expected)
                )
            else:
                value = triple(who, value, expected)
                parts = [value]
            object.__setattr__(self, name, value)
            for numbers in parts:
                require_finite(who, numbers, expected)
                if kind.single is Kind.DIRECTION:
                    require_direction(who, numbers)

    def __str__(self) -> str:
        return f"joint {self.name!r} ({self.type})"

    @property
    def bodies(self) -> tuple[str, str]:
        """Names of the first and the second body."""
        return self.i, self.j

    def geometry(self) -> Sequence[tuple[str, Kind, Any]]:
        """Return name, kind and value of every geometry field with a value."""
        found = [(name, kind, getattr(self, name)) for name, kind in _geometry_fields(type(self))]
        return [(name, kind, value) for name, kind, value in found if value is not None]

    def parts(self, body: str | None = None) -> Sequence[tuple[str, Kind, Any]]:
        """Return the same for single values, of a pair as "points.0" and "points.1"; only those on
        the body if one is named.
        """
        found = list[tuple[str, Kind, Any]]()
        for name, kind, value in self.geometry():
            if kind.pair:
                found += [
                    (f"{name}.{k}", kind.single, value[k])
                    for k in range(2)
                    if body in (None, self.bodies[k])
                ]
            else:
                found.append((name, kind, value))
        return found

    def points_on(self, body: str | None = None) -> list[tuple[float, float, float]]:
        """Return its points, global at design [m]; only those on the body if one is named."""
        return [value for _, kind, value in self.parts(body) if kind is Kind.POSITION]

    def mapped(self, ways: Mapping[Kind, Callable[[Any], Any]]) -> dict[str, Any]:
        """Return its geometry fields, each point, direction or length passed to the function of its
        kind, if there is one.
        """
        given = [
            (name, kind.pair, ways[kind.single], value)
            for name, kind, value in self.geometry()
            if kind.single in ways
        ]
        return {
            name: tuple(map(way, value)) if pair else way(value) for name, pair, way, value in given
        }

    def reversed(self) -> Self:
        """Return the same joint seen from its second body: i and j exchanged, and so every pair."""
        swapped = {name: value[::-1] for name, kind, value in self.geometry() if kind.pair}
        return self.changed(i=self.j, j=self.i, **swapped)

    def scaled(self, factor: float) -> Self:
        """Return the same joint with all lengths multiplied by the factor."""
        times = partial(_times, factor)
        return self.changed(**self.mapped({Kind.POSITION: times, Kind.LENGTH: times}))

    def changed(self, **values: Any) -> Self:
        """Return the joint with other fields, without checks: the values are valid, or known only
        later.
        """
        other = copy(self)
        for name, value in values.items():
            object.__setattr__(other, name, value)
        return other

    @property
    def notes(self) -> Sequence[str | Phrase]:
        """Remarks on its geometry for a reader of results: it may be intended, or a mistake."""
        return ()

    @property
    def rows(self) -> int:
        """Number of constraint equations."""
        here = Attachment(ZERO)
        return sum(primitive.n for primitive in self.primitives(here, here))

    @abstractmethod
    def primitives(self, i: Attachment, j: Attachment) -> Sequence[Primitive]:
        """Return the primitives of this joint; each takes body i first."""

    def equivalent(self) -> tuple[Sequence[Any], Sequence[Joint]] | None:
        """Return added bodies (`Body`), and joints of other types, that leave the same motion.

        None by default. Simulators without a counterpart of this type solve these instead.
        """
        return None


@dataclass(frozen=True)
class AxialJoint(Joint):
    """A joint about or along an axis through a point, both common to the two bodies; its freedoms
    can be driven and coupled.

    Its coordinates are the rotation about and the displacement along the axis of body j relative to
    body i, zero at design.
    """

    point: tuple[float, float, float] = position()
    axis: tuple[float, float, float] = direction()

    def measured(self, freedom: str, i: Attachment, j: Attachment) -> Primitive:
        """Return the primitive between one of its coordinates, "rotation" or "translation", and a
        drive.

        Its rows are exact by themselves, because a driver's or coupler's force acts by them: about
        the axis, or along it through the point.
        """
        P, h = vec(self.point), unit(self.axis)
        if freedom == "rotation":
            return DrivenAngle(h)
        return Dot20(h, i.arm(P), j.arm(P), ZERO)

    def mixed(self, i: Attachment, j: Attachment) -> Sequence[tuple[Primitive, str]]:
        """Return the joint with its coordinates named: TraX and RotX of formulation section 4, and
        the coordinate of each.
        """
        P, h = vec(self.point), unit(self.axis)
        slide = (
            NamedSlide(i.arm(P), j.arm(P), h=h)
            if "translation" in self.freedoms
            else SphericalCondition(i.arm(P), j.arm(P))
        )
        turn = NamedTurn(h) if "rotation" in self.freedoms else Dot12()
        return (slide, "translation"), (turn, "rotation")

    @property
    def rows(self) -> int:
        """Number of constraint equations, with the relations between its own coordinates."""
        return super().rows + len(self.relations)

    @property
    def relations(self) -> Sequence[Mapping[str, float]]:
        """Linear relations between its own coordinates [m, rad]: coefficients by freedom of a sum
        equal to zero.
        """
        return ()


@cache
def _geometry_fields(joint: type[Joint]) -> Sequence[tuple[str, Kind]]:
    """Return name and kind of every geometry field of a joint type."""
    kinds = [(each.name, each.metadata.get("kind")) for each in fields(joint)]
    return [(name, kind) for name, kind in kinds if kind is not None]


def _times(factor: float, value: float | Sequence[float]) -> Any:
    return tuple(factor * x for x in value) if isinstance(value, Sequence) else factor * value


def gap(joint: Joint) -> float:
    """Return the largest residual of a joint at the design position [m]; zero unless lengths
    contradict points.
    """
    here = Attachment(ZERO)
    return max(
        abs(x) for each in joint.primitives(here, here) for x in each.phi(GROUND_POSE, GROUND_POSE)
    )
