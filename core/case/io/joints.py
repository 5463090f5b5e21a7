"""Joints and couplers of case files, [joints.NAME] and [couplers.NAME]."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...joints import Coupler, Joint, Polynomial
from ..units import Unit
from .class_keys import joint_keys, kind_of, own_fields
from .document import explained, fault, join
from .in_si import geometry_in_si
from .schema import CaseKeys
from .typed_tables import as_table, class_of, typed


def read_joints(
    file: Path, keys: CaseKeys, length: Unit, angle: Unit
) -> tuple[list[Joint], list[Coupler]]:
    """Return the joints and couplers of a file, in SI units.

    Raises:
        CaseError: an unknown type or key, a name in both tables, or invalid values of a joint.
    """
    joints, couplers = list[Joint](), list[Coupler]()
    for name, value in keys.joints.items():
        key = join("joints", name)
        cls = class_of(file, key, "joint", value, Joint.registry | Coupler.registry)
        found = _made(file, key, name, value, cls, length)
        if isinstance(found, Coupler):
            couplers.append(found)
        else:
            joints.append(found)
    for name, value in keys.couplers.items():
        key = join("couplers", name)
        if name in keys.joints:
            raise fault(
                file, key, f"found {name!r} in [joints] too, expected one name; rename one of them"
            )
        cls = class_of(file, key, "coupler", value, Coupler.registry)
        couplers.append(_made(file, key, name, value, cls, length))
    freedoms = {joint.name: joint.freedoms for joint in joints}
    tables = keys.joints | keys.couplers
    return joints, [
        _polynomial(each, freedoms, tables[each.name], length, angle)
        if isinstance(each, Polynomial)
        else each
        for each in couplers
    ]


def _polynomial(
    coupler: Polynomial,
    freedoms: Mapping[str, Sequence[str]],
    given: Any,
    length: Unit,
    angle: Unit,
) -> Polynomial:
    """Return a polynomial between freedoms of its joints, in SI units."""
    if "freedoms" not in given:
        first, second = ((*freedoms.get(name, ()), "rotation")[0] for name in coupler.joints)
        coupler = replace(coupler, freedoms=(first, second))
    return coupler.in_units(length.size, angle.size)


def _made(file: Path, key: str, name: str, value: object, cls: Any, length: Unit) -> Any:
    own = as_table(file, key, value)
    if issubclass(cls, Joint):  # they are read with the forces
        own = {name: each for name, each in own.items() if name != "bushings"}
    keys: Any = typed(file, key, own, joint_keys(cls))
    given = {
        each.name: geometry_in_si(kind_of(each), getattr(keys, each.name), length)
        for each in own_fields(cls)
    }
    with explained(file, key, length, value):
        return (
            cls(name, keys.joints, **given)
            if issubclass(cls, Coupler)
            else cls(name, *keys.bodies, **given)
        )
