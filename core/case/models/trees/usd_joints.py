"""Joints of USD: the moves that each kind leaves, and the coordinates between two frames.

Conventions: UsdPhysics of OpenUSD. An axis of a joint is one of its frame in the first body.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

from ....algebra import IDENTITY, Quat, Vec3, X, Y, Z
from .element import Element
from .place import Place, unit_quaternion
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
class Freedom:
    """A move of a joint: the end of its name, and its axis in the joint's frame.

    Attributes:
        bounds: keys of its limits.
        key: of its drive and its state, as names of schemas end.
    """

    end: str
    kind: Kind
    axis: Vec3
    bounds: tuple[str, str]
    key: str


@dataclass(frozen=True)
class JointOfStage:
    """A joint of the stage.

    Attributes:
        frames: in its links [m].
        closes: it is excluded from articulations.
    """

    name: str
    element: Element
    links: tuple[str, str]
    frames: tuple[Place, Place]
    freedoms: Sequence[Freedom]
    closes: bool

    def motion(self, relative: Place) -> tuple[Place, list[float]]:
        """Return the nearest motion of the second frame in the first one by the joint's moves, and
        their coordinates [m or rad].
        """
        at, turn, values = 0.0 * relative.at, IDENTITY, list[float]()
        for each in self.freedoms:
            value = 0.0
            if each.kind == "slide":
                value = each.axis @ relative.at
                at += value * each.axis
            elif each.kind == "hinge":
                along = each.axis @ relative.turn.e
                length = math.hypot(relative.turn.e0, along)
                if length > 0.0:
                    turn = unit_quaternion(Quat(relative.turn.e0, along * each.axis))
                    sign = math.copysign(1.0, relative.turn.e0)
                    value = 2.0 * math.atan2(sign * along, sign * relative.turn.e0)
            else:
                turn = relative.turn
            values.append(value)
        return Place(at, turn), values


def freedoms_of(element: Element) -> list[Freedom]:
    """Return the freedoms of a joint.

    Raises:
        CaseError: no joint leaves them, or limits make no sense.
    """
    return _generic(element) if element.tag == GENERIC else _single(element)


def _single(element: Element) -> list[Freedom]:
    """Return the freedom of a joint of one kind."""
    kind = TYPES[element.tag]
    if kind is None:
        return []
    letter = element.choice("physics:axis", (*AXES,), "X")
    key = {"hinge": "angular", "slide": "linear"}.get(kind, "")
    bounds = "physics:lowerLimit", "physics:upperLimit"
    return [Freedom("", kind, AXES[letter], bounds, key)]


def _generic(element: Element) -> list[Freedom]:
    """Return the freedoms of a joint whose limits lock axes."""
    apis = element.attributes["apis"].split()
    free: dict[str, Freedom] = {}
    for prefix, kind in (("trans", "slide"), ("rot", "hinge")):
        for letter, axis in AXES.items():
            key = f"{prefix}{letter}"
            low, high = (f"limit:{key}:physics:{end}" for end in ("low", "high"))
            limited = f"PhysicsLimitAPI:{key}" in apis
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
            free[key] = Freedom(f".{key}", cast("Kind", kind), axis, (low, high), key)
    if "PhysicsLimitAPI:distance" in apis:
        raise element.fault(
            "limits a distance, which acts at its ends alone; write a"
            " PhysicsDistanceJoint, or leave it out by --without " + element.attributes["name"]
        )
    turns = [each for each in free.values() if each.kind == "hinge"]
    found = [each for each in free.values() if each.kind == "slide"]
    if len(turns) == 2:
        raise element.fault(
            f"leaves two turns, {turns[0].key} and {turns[1].key}, of which programs make two"
            " joints: PhysX one of constant velocity, Newton a universal one; write it as two"
            " PhysicsRevoluteJoint with a body between them"
        )
    found += [Freedom(".rot", "ball", X, ("", ""), "")] if len(turns) == 3 else turns
    return [replace(found[0], end="")] if len(found) == 1 else found
