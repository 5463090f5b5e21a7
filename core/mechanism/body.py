"""Bodies: a frame at the design position, mass and inertia, as data; dimensions of masses and
loads: a number of them changes with the units of length and angle.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import Field, dataclass, field, replace
from typing import Any, TypeAlias

import numpy as np

from ..errors import MechanismError
from ..input_checks import finite, finite_numbers, plain
from ..joints.base import Kind
from ..trajectory import Array


@dataclass(frozen=True, slots=True)
class Dimension:
    """Powers of force, length and angle in a quantity; mass is in kg and time in s everywhere.

    Attributes:
        unit: the unit, with places for those of length and angle.
    """

    unit: str
    force: int = 0
    length: int = 0
    angle: int = 0

    def __str__(self) -> str:
        return self.of("m", "rad")

    def of(self, length: str, angle: str) -> str:
        """Return the unit with names for the units of length and angle."""
        return self.unit.format(length=length, angle=angle)

    def in_kg_and_s(self, number: float, unit: float) -> float:
        """Return a number in SI as one in kg, s and a unit of length [m], which sets the force."""
        return number / unit ** (self.force + self.length)


MASS = Dimension("kg")
LENGTH = Dimension("{length}", length=1)
ANGLE = Dimension("{angle}", angle=1)
ACCELERATION = Dimension("{length}/s^2", length=1)
INERTIA = Dimension("kg {length}^2", length=2)
FORCE = Dimension("N", force=1)
TORQUE = Dimension("N {length}", force=1, length=1)
STIFFNESS = Dimension("N/{length}", force=1, length=-1)
DAMPING = Dimension("N s/{length}", force=1, length=-1)
TURNING_STIFFNESS = Dimension("N {length}/{angle}", force=1, length=1, angle=-1)
TURNING_DAMPING = Dimension("N {length} s/{angle}", force=1, length=1, angle=-1)


def quantity(dimension: Dimension, **options: Any) -> Any:
    """Return a field of a load: a number or numbers of a dimension."""
    return field(metadata={"dimension": dimension}, **options)


def dimension_of(each: Field[Any]) -> Dimension | None:
    """Return the dimension of a field of a load; None for a name or a point."""
    return each.metadata.get("dimension")


Vector: TypeAlias = tuple[float, float, float]
FOUR_NUMBERS = "four numbers, e0 first"
Inertia: TypeAlias = tuple[float, float, float, float, float, float]
"""Ixx, Iyy, Izz, Ixy, Iyz, Ixz about the centre of mass: entries of the matrix [kg m^2]."""
SIX_NUMBERS = "six numbers [Ixx, Iyy, Izz, Ixy, Iyz, Ixz]"
# Tables print about six digits: the roundings of three moments break the rule by a few 1e-6.
DIGITS = 1e-5
# Four Euler parameters that were divided by their length have length one to a few roundings; what
# is written and read again stays the same number.
NORMALISED = 4.0 * float(np.finfo(np.float64).eps)


def inertia_matrix(inertia: Inertia | None) -> Array:
    """Return the matrix of six entries, shape (3, 3); zero of a point mass."""
    xx, yy, zz, xy, yz, xz = inertia or (0.0,) * 6
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], dtype=np.float64)


def checked_inertia(body: str, inertia: Any, unit: str = str(INERTIA)) -> Inertia:
    """Return the inertia about the centre of mass, in the unit it is given in.

    Raises:
        MechanismError: no rigid body has it: a principal moment is not positive, or larger than the
            sum of the two others.
    """
    what, key = f"body {body!r}: inertia", f"bodies.{body}.inertia"
    numbers = finite_numbers(what, inertia, 6, SIX_NUMBERS)
    found: Inertia = tuple(float(x) for x in numbers)  # pyright: ignore[reportAssignmentType]
    least, middle, most = (float(x) for x in np.linalg.eigvalsh(inertia_matrix(found)))
    principal = f"its principal moments are {least:.6g}, {middle:.6g} and {most:.6g} {unit}"
    if not least > 0.0:
        raise MechanismError(
            f"{what} {[*found]} is not positive definite: {principal}, expected positive ones;"
            " check signs and the order [Ixx, Iyy, Izz, Ixy, Iyz, Ixz], or leave inertia out for a"
            " point mass",
            key,
        )
    if most > (least + middle) * (1.0 + DIGITS):
        raise MechanismError(
            f"{what} {[*found]} breaks the triangle inequality: {principal}, and no rigid body has"
            " one larger than the sum of the two others; check the entries and their unit",
            key,
        )
    return found


@dataclass(frozen=True, slots=True)
class Body:
    """A rigid body and its reference frame at the design position.

    Attributes:
        origin: reference point, global [m].
        euler_parameters: e0..e3 of the rotation body -> global [-]; normalised to length one.
        fixed: the body is part of the ground; it costs nothing and can carry joints.
        mass: [kg]; forces need it, motion does not.
        center_of_mass: global [m]; the origin unless given.
        inertia: about the centre of mass, global axes [kg m^2]; that of a point mass unless given.

    Raises:
        MechanismError: a shape is wrong, a number is not finite, or no rigid body has that mass or
            inertia.
    """

    name: str
    origin: Vector = (0.0, 0.0, 0.0)
    euler_parameters: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    fixed: bool = False
    mass: float = 0.0
    center_of_mass: Vector | None = None
    inertia: Inertia | None = None

    def __post_init__(self) -> None:
        who = f"body {self.name!r}"
        origin = finite_numbers(f"{who}: origin", self.origin, 3, Kind.POSITION.value)
        object.__setattr__(self, "origin", origin)
        p = finite_numbers(f"{who}: euler_parameters", self.euler_parameters, 4, FOUR_NUMBERS)
        length = math.sqrt(sum(e * e for e in p))
        # Tables print Euler parameters to about four digits: a longer defect is a mistake, a
        # shorter one rounding.
        if not abs(length - 1.0) < 1e-3:
            raise MechanismError(
                f"{who}: euler_parameters {[*p]} have length {length:.6g}, expected"
                " four numbers of length 1; e0 = sqrt(1 - e1^2 - e2^2 - e3^2)"
            )
        if abs(length - 1.0) > NORMALISED:
            p = tuple(e / length for e in p)
        object.__setattr__(self, "euler_parameters", p)
        if self.mass == 0.0 and self.center_of_mass is None and self.inertia is None:
            return
        mass = plain(self.mass)
        if not finite(mass) or mass < 0.0:
            raise MechanismError(
                f"{who}: mass is {mass!r}, expected a number of kg, zero or more",
                f"bodies.{self.name}.mass",
            )
        object.__setattr__(self, "mass", float(mass))
        center = self.origin if self.center_of_mass is None else self.center_of_mass
        center = finite_numbers(f"{who}: center_of_mass", center, 3, Kind.POSITION.value)
        object.__setattr__(self, "center_of_mass", center)
        if self.inertia is None:
            return
        object.__setattr__(self, "inertia", checked_inertia(self.name, self.inertia))
        if self.mass == 0.0:
            raise MechanismError(
                f"{who}: has an inertia, but no mass; give mass, or leave inertia out",
                f"bodies.{self.name}.inertia",
            )

    @property
    def center(self) -> Vector:
        """The centre of mass, which is the origin unless given."""
        return self.center_of_mass or self.origin

    def in_frame(self, place: Callable[[Any], Any], unit: float = 1.0) -> Body:
        """Return the body with its points passed to a function, and its inertia in kg and a unit of
        length [m].
        """
        moved = replace(self, origin=place(self.origin), center_of_mass=None, inertia=None)
        if self.center_of_mass is None:
            return moved
        scaled = self.inertia and tuple(INERTIA.in_kg_and_s(x, unit) for x in self.inertia)
        return replace(moved, center_of_mass=place(self.center_of_mass), inertia=scaled)
