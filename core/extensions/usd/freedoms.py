"""Freedoms of joints of USD, and the equalities of MuJoCo in them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import cast

from ...algebra import X, Y, Z
from ..trees.graph import FramedFreedom
from ..trees.tree import (
    Kind,
)
from ..xml.element import Element

AXES = {"X": X, "Y": Y, "Z": Z}
TYPES: Mapping[str, Kind | None] = {
    "PhysicsRevoluteJoint": "hinge",
    "PhysicsPrismaticJoint": "slide",
    "PhysicsSphericalJoint": "ball",
    "PhysicsFixedJoint": None,
}
"""Joints with the one move they leave."""
GENERIC = "PhysicsJoint"


def equality(element: Element, unit: float) -> list[float]:
    """Return the coefficients of an equality of MuJoCo; Newton's schema, on which it stands, may
    give the first two.

    Args:
        unit: of the constant of Newton, in the unit of the others.
    """
    found: list[float] = []
    for k, default in enumerate((0.0, 1.0, 0.0, 0.0, 0.0)):
        base = element.number(f"newton:mimicCoef{k}", default) if k < 2 else default
        base *= 1.0 if k else unit
        found.append(element.number(f"mjc:coef{k}", base))
    return found


def short_names(paths: Sequence[str]) -> dict[str, str]:
    """Return short names of paths: as many of their last parts as tell them apart."""
    found: dict[str, str] = {}
    parts = {path: path.strip("/").split("/") for path in paths}
    length, left = 1, [*paths]
    while left:
        ends = {path: "/".join(parts[path][-length:]) for path in left}
        counts = Counter(ends.values())
        found |= {path: end for path, end in ends.items() if counts[end] == 1}
        left = [path for path in left if path not in found]
        length += 1
    return {path: found[path] for path in paths}


def freedoms_of(element: Element, name: str) -> list[FramedFreedom]:
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
    return [FramedFreedom(name, kind, AXES[letter], element, key=key)]


def bounds_of(key: str) -> tuple[str, str]:
    """Return the names of the limits of a move."""
    if key in ("angular", "linear"):
        return "physics:lowerLimit", "physics:upperLimit"
    return f"limit:{key}:physics:low", f"limit:{key}:physics:high"


def _generic(element: Element, name: str) -> list[FramedFreedom]:
    """Return the moves of a joint whose limits lock axes."""
    apis = element.attributes["apis"].split()
    found: list[FramedFreedom] = []
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
            found.append(FramedFreedom(f"{name}.{key}", cast("Kind", kind), axis, element, key=key))
    if "PhysicsLimitAPI:distance" in apis:
        raise element.fault(
            "limits a distance, which acts at its ends alone; write a"
            " PhysicsDistanceJoint, or leave it out by --without " + element.attributes["name"]
        )
    slides = [each for each in found if each.kind == "slide"]
    if len(found) - len(slides) == 3:
        found = [*slides, FramedFreedom(f"{name}.rot", "ball", X, element)]
    return [replace(found[0], name=name)] if len(found) == 1 else found
