"""Joints of USD: the moves that each kind leaves, and the coordinates between two frames.

Conventions: UsdPhysics of OpenUSD. An axis of a joint is one of its frame in the first body.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import cast

from ....algebra import Vec3, X, Y, Z
from .element import Element
from .tree import Kind

AXES = {"X": X, "Y": Y, "Z": Z}
TYPES: Mapping[str, Kind | None] = {
    "PhysicsRevoluteJoint": "hinge",
    "PhysicsPrismaticJoint": "slide",
    "PhysicsSphericalJoint": "ball",
    "PhysicsFixedJoint": None,
}
"""Joints with the one move they leave."""
GENERIC, ROD = "PhysicsJoint", "PhysicsDistanceJoint"


@dataclass(frozen=True)
class Axis:
    """A move that a joint leaves, along or about an axis of its frame.

    Attributes:
        end: of its name, which begins with the joint's.
        bounds: keys of its limits.
        key: of its drive and its state, as names of schemas end.
    """

    end: str
    kind: Kind
    axis: Vec3
    bounds: tuple[str, str]
    key: str


def axes_of(element: Element) -> list[Axis]:
    """Return the moves that a joint leaves.

    Raises:
        CaseError: no joint leaves them, or limits make no sense.
    """
    return _generic(element) if element.tag == GENERIC else _single(element)


def _single(element: Element) -> list[Axis]:
    """Return the move of a joint of one kind."""
    kind = TYPES[element.tag]
    if kind is None:
        return []
    letter = element.choice("physics:axis", (*AXES,), "X")
    key = {"hinge": "angular", "slide": "linear"}.get(kind, "")
    bounds = "physics:lowerLimit", "physics:upperLimit"
    return [Axis("", kind, AXES[letter], bounds, key)]


def _generic(element: Element) -> list[Axis]:
    """Return the moves of a joint whose limits lock axes."""
    apis = element.attributes["apis"].split()
    free: dict[str, Axis] = {}
    for prefix, kind in (("trans", "slide"), ("rot", "hinge")):
        for letter, axis in AXES.items():
            key = f"{prefix}{letter}"
            low, high = (f"limit:{key}:physics:{end}" for end in ("low", "high"))
            limited = f"PhysicsLimitAPI:{key}" in apis
            if not limited and (low in element.attributes or high in element.attributes):
                raise element.fault(
                    f"limit:{key}: found without the schema PhysicsLimitAPI:{key}, so that programs"
                    " do not read it alike; apply the schema, or remove the limit"
                )
            bounds = [element.attributes.get(each, "inf") for each in (low, high)]
            if limited and "inf" not in bounds and "-inf" not in bounds:
                least, most = element.number(low), element.number(high)
                if least > most:
                    continue
                if least == most == 0.0:
                    continue
                if least == most:
                    raise element.fault(
                        f"{low}: found {least:g} for both limits, which lock the joint out of its"
                        " frames, expected low above high for a lock; move the frame"
                    )
            free[key] = Axis(f".{key}", cast("Kind", kind), axis, (low, high), key)
    if "PhysicsLimitAPI:distance" in apis:
        raise element.fault(
            "limits a distance, which acts at its ends alone; write a"
            " PhysicsDistanceJoint, or leave it out by --without " + element.attributes["name"]
        )
    turns = [each for each in free.values() if each.kind == "hinge"]
    found = [each for each in free.values() if each.kind == "slide"]
    found += [Axis(".rot", "ball", X, ("", ""), "")] if len(turns) == 3 else turns
    return [replace(found[0], end="")] if len(found) == 1 else found
