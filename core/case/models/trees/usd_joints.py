"""Joints of USD: the moves that each kind leaves, and the coordinates between two frames.

Conventions: UsdPhysics of OpenUSD. An axis of a joint is one of its frame in the first body.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import cast

from ....algebra import X, Y, Z
from .element import Element
from .framed import Freedom
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


def freedoms_of(element: Element, name: str) -> list[Freedom]:
    """Return the moves that a joint leaves.

    Raises:
        CaseError: no joint leaves them, or limits make no sense.
    """
    if element.tag == GENERIC:
        return _generic(element, name)
    kind = TYPES[element.tag]
    if kind is None:
        return []
    letter = element.choice("physics:axis", (*AXES,), "X")
    key = {"hinge": "angular", "slide": "linear"}.get(kind, "")
    return [Freedom(name, kind, AXES[letter], element, key=key)]


def bounds_of(key: str) -> tuple[str, str]:
    """Return the names of the limits of a move."""
    if key in ("angular", "linear"):
        return "physics:lowerLimit", "physics:upperLimit"
    return f"limit:{key}:physics:low", f"limit:{key}:physics:high"


def _generic(element: Element, name: str) -> list[Freedom]:
    """Return the moves of a joint whose limits lock axes."""
    apis = element.attributes["apis"].split()
    found: list[Freedom] = []
    for prefix, kind in (("trans", "slide"), ("rot", "hinge")):
        for letter, axis in AXES.items():
            key = f"{prefix}{letter}"
            low, high = bounds_of(key)
            limited = f"PhysicsLimitAPI:{key}" in apis
            if not limited and (low in element.attributes or high in element.attributes):
                raise element.fault(
                    f"limit:{key}: found without the schema PhysicsLimitAPI:{key}, so that programs"
                    " do not read it alike; apply the schema, or remove the limit"
                )
            bounds = [element.attributes.get(each, "inf") for each in (low, high)]
            if limited and "inf" not in bounds and "-inf" not in bounds:
                least, most = element.number(low), element.number(high)
                if least > most or least == most == 0.0:
                    continue
                if least == most:
                    raise element.fault(
                        f"{low}: found {least:g} for both limits, which lock the joint out of its"
                        " frames, expected low above high for a lock; move the frame"
                    )
            found.append(Freedom(f"{name}.{key}", cast("Kind", kind), axis, element, key=key))
    if "PhysicsLimitAPI:distance" in apis:
        raise element.fault(
            "limits a distance, which acts at its ends alone; write a"
            " PhysicsDistanceJoint, or leave it out by --without " + element.attributes["name"]
        )
    slides = [each for each in found if each.kind == "slide"]
    if len(found) - len(slides) == 3:
        found = [*slides, Freedom(f"{name}.rot", "ball", X, element)]
    return [replace(found[0], name=name)] if len(found) == 1 else found
