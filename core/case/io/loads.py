"""Masses and loads of a case file: their keys, and their numbers in SI.

Reference. All keys may be left out. A case without masses and loads has no forces. The motion does
not depend on masses and loads. Mass is in kg, time in s and force in N, for any [units]. All other
numbers follow the file's units of length and angle. With length = "mm" and angle = "deg", as in
Adams: lengths in mm, torque in N mm, stiffness in N/mm, damping in N s/mm, torsional stiffness in
N mm/deg, torsional damping in N mm s/deg, inertia in kg mm^2, gravity in mm/s^2 (-9806.65 on
Earth). Points and vectors are global, at the design position. Results are always in SI.

    (gravity) = [0, 0, 0]   acceleration of free fall, global axes [length/s^2]
    [bodies.NAME]        (mass) = 0 [kg]
                         (center_of_mass), global: the body's origin unless given
                         (inertia) = [Ixx, Iyy, Izz, Ixy, Iyz, Ixz], entries of the matrix about the
                         centre of mass, global axes at design [kg length^2]; the products have the
                         sign of the matrix entry, Ixy = -sum of m x y; default: zero, a point mass
    [joints.NAME.bushings.X]   keys of a bushing; bodies and point are the joint's unless given; it
                         stands for its bushings in `run`, and they for it in `kc` and at rest
    [forces.NAME]        type = "spring_damper": bodies = [first, second], points = [on first, on
                         second], stiffness [N/length], (damping) = 0 [N s/length],
                         (free_length), default: the length at design; tension is positive
                         type = "torsion_spring_damper": joint with a rotation, stiffness
                         [N length/angle], (damping) = 0 [N length s/angle], (free_angle) = 0: the
                         joint's angle is zero at design
                         both: (curve) = [[deflection, force or torque], ...], of progressive rates
                         and bump stops, smooth through the rows and straight beyond; it adds to the
                         stiffness, which may then be left out
                         type = "bushing": bodies = [first, second], point, (axes), the first and
                         second, fixed in the first body, default: global; one number or three, by
                         the axes: (stiffness) = 0 [N/length], (damping) = 0 [N s/length],
                         (preload) = 0 [N], on the first body; about them:
                         (turning_stiffness) = 0 [N length/angle], (turning_damping) = 0;
                         (curve), one or one for each axis; (law) = "euler_parameters" or "cardan"
                         type = "force": body, point, vector [N], (frame) = "global": its direction
                         is constant; "body": it turns with the body
                         type = "torque": body, vector [N length], (frame) = "global"
                         `kincheck list --joints` prints these types too
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import Field
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from ...joints import Joint
from ...mechanism.body import Inertia, checked_inertia
from ...mechanism.curves import dimensions_of, scaled
from ...mechanism.dimension import ANGLE, INERTIA, dimension_of
from ...mechanism.loads import (
    ELEMENTS,
    Bushing,
    ForceElement,
    Law,
    SpringDamper,
    TorsionSpringDamper,
)
from ...mechanism.mechanism import Vector
from ..units import RADIAN, Unit
from .class_keys import key_of, kind_of, own_fields, shape_of
from .document import explained, fault, join
from .in_si import geometry_in_si, load_in_si
from .schema import (
    Bodies,
    Number,
    Numbers3,
    Size,
    Text,
)
from .typed_tables import as_table, class_of, typed

Frame = Annotated[Literal["global", "body"], Meta(description='"global" or "body"')]
Laws = Annotated[
    Literal["euler_parameters", "cardan"], Meta(description=f"one of {', '.join(Law)}")
]
Pairs = Annotated[
    tuple[tuple[float, float], ...] | None, Meta(description="a table of pairs of numbers")
]
Curves = Annotated[
    tuple[tuple[float | tuple[float, float], ...], ...] | None,
    Meta(description="a table [[displacement, force], ...], or one for each axis"),
]
Directions = Annotated[
    tuple[Vector, Vector], Meta(description="two directions [[x, y, z], [x, y, z]]")
]
OneOrThree = Annotated[float | Vector, Meta(description="a number, or three along the axes")]
_NAMED: Mapping[str, Any] = {
    "frame": Frame,
    "body": Text,
    "joint": Text,
    "vector": Numbers3,
    "axes": Directions,
    "law": Laws,
}


def inertia_in_si(body: str, inertia: Inertia | None, length: Unit) -> Inertia | None:
    """Return an inertia of a file in kg m^2.

    Raises:
        MechanismError: no rigid body can have this inertia; the message is in the file's unit.
    """
    if inertia is None:
        return None
    checked = checked_inertia(body, inertia, INERTIA.of(length.name, RADIAN.name))
    return load_in_si(INERTIA, checked, length, RADIAN)


def read_forces(
    file: Path, tables: Mapping[str, Any], length: Unit, angle: Unit
) -> list[ForceElement]:
    """Read the force elements of [forces], in SI; the mechanism checks their names."""
    return [
        _force(file, join("forces", name), name, value, length, angle)
        for name, value in tables.items()
    ]


def _force(
    file: Path, key: str, name: str, value: object, length: Unit, angle: Unit
) -> ForceElement:
    cls: Any = class_of(file, key, "force", value, ELEMENTS)
    keys: Any = typed(file, key, value, force_keys(cls))
    sprung = issubclass(cls, SpringDamper | TorsionSpringDamper)
    if sprung and not {"stiffness", "curve"} & as_table(file, key, value).keys():
        raise fault(
            file, join(key, "stiffness"), "missing, expected a number; add the key, or a curve"
        )
    with explained(file, key, length, value):
        return cls(name, *getattr(keys, "bodies", ()), **_in_si(cls, keys, length, angle))


def read_bushings(
    file: Path, tables: Mapping[str, Any], joints: Sequence[Joint], length: Unit, angle: Unit
) -> list[Bushing]:
    """Read the bushings of joints, [joints.NAME.bushings.X], in SI; a point is the joint's own
    unless given.
    """
    found = list[Bushing]()
    for joint in joints:
        given = tables[joint.name].get("bushings", {})
        for own, value in as_table(file, f"{join('joints', joint.name)}.bushings", given).items():
            key = join(f"{join('joints', joint.name)}.bushings", own)
            keys: Any = typed(file, key, value, bushing_keys())
            numbers: dict[str, Any] = _in_si(Bushing, keys, length, angle)
            places = joint.points_on()
            if numbers["point"] is None and not places:
                raise fault(file, join(key, "point"), "missing, expected a point [x, y, z]; add it")
            numbers["point"] = numbers["point"] or places[0]
            with explained(file, key, length, value):
                name = f"{joint.name}.{own}"
                i, j = keys.bodies or joint.bodies
                found.append(Bushing(name, i, j, joint=joint.name, **numbers))
    return found


def _in_si(cls: Any, keys: Any, length: Unit, angle: Unit) -> dict[str, Any]:
    """Return the fields of a force element."""

    def field_in_si(each: Field[Any]) -> Any:
        value = getattr(keys, each.name)
        if (dimension := dimension_of(each)) is not None:
            return load_in_si(dimension, value, length, angle)
        if (pair := dimensions_of(each)) is not None and value is not None:
            factors = [load_in_si(each, 1.0, length, angle) for each in pair]
            try:
                return scaled(value, factors)
            except (TypeError, ValueError):  # a row of another length, or rows and numbers mixed
                return value  # the element's own check names it
        return geometry_in_si(kind_of(each), value, length)

    return {each.name: field_in_si(each) for each in own_fields(cls)}


@cache
def force_keys(cls: type[ForceElement]) -> type[msgspec.Struct]:
    """Return the keys of a force element: type, the bodies of a spring, and its fields."""
    keys: list[Any] = [("type", Text)]
    if issubclass(cls, SpringDamper | Bushing):
        keys.append(("bodies", Bodies))
    keys += [key_of(each, _shape(cls, each)) for each in own_fields(cls)]
    return msgspec.defstruct(cls.__name__, keys, forbid_unknown_fields=True)


@cache
def bushing_keys() -> type[msgspec.Struct]:
    """Return the keys of a joint's bushing; its point is by default the joint's."""
    keys = [key_of(each, _shape(Bushing, each)) for each in own_fields(Bushing)]
    point = Annotated[Vector | None, Meta(description="a point [x, y, z]")]
    keys = [("point", point, None) if each[0] == "point" else each for each in keys]
    bodies = Annotated[Bodies | None, Meta(description="two names of bodies")]
    keys.append(("bodies", bodies, None))
    return msgspec.defstruct("BushingKeys", keys, forbid_unknown_fields=True)


def _shape(cls: type[ForceElement], each: Field[Any]) -> Any:
    if each.name in _NAMED:
        return _NAMED[each.name]
    if dimensions_of(each) is not None:
        return Curves if cls is Bushing else Pairs
    dimension = dimension_of(each)
    if dimension is not None and cls is Bushing:
        return OneOrThree
    return Number if dimension is ANGLE else Size if dimension else shape_of(each)
