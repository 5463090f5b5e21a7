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
    [forces.NAME]        type = "spring_damper": bodies = [first, second], points = [on first, on
                         second], stiffness [N/length], (damping) = 0 [N s/length],
                         (free_length), default: the length at design; tension is positive
                         type = "torsion_spring_damper": joint with a rotation, stiffness
                         [N length/angle], (damping) = 0 [N length s/angle], (free_angle) = 0: the
                         joint's angle is zero at design
                         type = "force": body, point, vector [N], (frame) = "global": its direction
                         is constant; "body": it turns with the body
                         type = "torque": body, vector [N length], (frame) = "global"
                         `kincheck list --joints` prints these types too
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from ...mechanism.body import ANGLE, INERTIA, Inertia, checked_inertia, dimension_of
from ...mechanism.loads import ELEMENTS, ForceElement, SpringDamper
from ..units import RADIAN, Unit
from .class_keys import key_of, kind_of, own_fields, shape_of
from .document import explained, join
from .in_si import geometry_in_si, load_in_si
from .schema import (
    Bodies,
    Number,
    Numbers3,
    Size,
    Text,
)
from .typed_tables import class_of, typed

Frame = Annotated[Literal["global", "body"], Meta(description='"global" or "body"')]
_NAMED: Mapping[str, Any] = {"frame": Frame, "body": Text, "joint": Text, "vector": Numbers3}


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
    given = {
        each.name: load_in_si(dimension, getattr(keys, each.name), length, angle)
        if (dimension := dimension_of(each))
        else geometry_in_si(kind_of(each), getattr(keys, each.name), length)
        for each in own_fields(cls)
    }
    with explained(file, key, length, value):
        return cls(name, *getattr(keys, "bodies", ()), **given)


@cache
def force_keys(cls: type[ForceElement]) -> type[msgspec.Struct]:
    """Return the keys of a force element: type, the bodies of a spring, and its fields."""
    keys: list[Any] = [("type", Text)]
    if issubclass(cls, SpringDamper):
        keys.append(("bodies", Bodies))
    for each in own_fields(cls):
        dimension = dimension_of(each)
        shape = Number if dimension is ANGLE else Size if dimension else shape_of(each)
        keys.append(key_of(each, _NAMED.get(each.name, shape)))
    return msgspec.defstruct(cls.__name__, keys, forbid_unknown_fields=True)
