"""Numbers of joints and tendons beside motion: springs, dampers, armature, friction, limits of
balls. A run needs few of them; two files that differ in them are not the same robot.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TypeAlias

from ..xml.element import Element
from .tree import Move, Tree

Laws: TypeAlias = Mapping[str, float]
"""By name of a law: its number [SI, rad]."""
STIFFNESS, REFERENCE, DAMPING = "stiffness", "spring reference", "damping"
ARMATURE, FRICTION, CONE = "armature", "friction", "limit of the ball"
SPEED, EFFORT, TENDONS, SPRINGS = "velocity limit", "effort limit", "tendons", "springs"
UNSAID = {
    "mujoco": ("MJCF", {SPEED}),
    "robot": ("URDF", {STIFFNESS, REFERENCE, ARMATURE, CONE, TENDONS}),
    "sdf": ("SDF", {ARMATURE, CONE, TENDONS}),
    "usd": ("USD", {SPRINGS, TENDONS}),
    "OpenSimDocument": ("OpenSim", {ARMATURE, FRICTION, CONE, SPEED, EFFORT, TENDONS}),
}
"""By root of a file: its format, and laws without words in it."""
_OF_TENDON = (
    *("stiffness", "damping", "springlength", "armature", "frictionloss", "range"),
    "actuatorfrcrange",
)


def laws_of(tree: Tree, root: Element) -> Mapping[str, Laws]:
    """Return the laws of moves; zero is none."""
    found: dict[str, Laws] = {}
    for name, move in tree.moves.items():
        laws = dict(_of_move(move, root))
        if (spring := tree.springs.get(name)) is not None:
            laws |= {STIFFNESS: spring.stiffness, DAMPING: spring.damping}
            laws |= {REFERENCE: spring.rest} if move.is_axial and spring.stiffness else {}
        if move.kind == "ball" and math.isfinite(move.limit.upper):
            laws[CONE] = move.limit.upper
        laws = {law: x for law, x in laws.items() if x or (law == REFERENCE and laws[STIFFNESS])}
        if laws:
            found[name] = laws
    return found


def _of_move(move: Move, root: Element) -> Iterator[tuple[str, float]]:
    """Yield the laws of a move in its element, beyond its spring."""
    element = move.element
    match root.tag:
        case "mujoco":
            for law, key in ((ARMATURE, "armature"), (FRICTION, "frictionloss")):
                yield law, _number(element.attributes.get(key))
            for law in (STIFFNESS, DAMPING):  # one that is not linear, or tuned, is not read
                text = element.attributes.get("springdamper", element.attributes.get(law, ""))
                if len(text.split()) > 1:
                    yield law, _number(text)
        case "robot":
            for dynamics in element.findall("dynamics"):
                yield FRICTION, _number(dynamics.attributes.get("friction"))
        case "sdf":
            for axis in element.findall("axis2" if move.name.endswith(".2") else "axis"):
                for dynamics in axis.findall("dynamics"):
                    yield FRICTION, _number(dynamics.child_text("friction") or None)
        case "usd":
            yield from _of_usd(move, root)
        case _:
            pass


def _of_usd(move: Move, root: Element) -> Iterator[tuple[str, float]]:
    """Yield the laws of a joint of a stage: a drive to a target is a spring and damper."""
    said, turns = move.element.attributes, move.kind == "hinge"
    unit = math.radians(1.0) if turns else root.number("metersPerUnit")
    force = root.number("kilogramsPerUnit") * root.number("metersPerUnit") ** (2 if turns else 1)
    own = move.name.rpartition(".")[2]
    for axis in (own, "angular" if turns else "linear"):
        drive = {key: _number(said.get(f"drive:{axis}:physics:{key}")) for key in _DRIVE}
        if any(drive.values()):
            yield STIFFNESS, drive["stiffness"] * force / unit
            yield DAMPING, drive["damping"] * force / unit
            if drive["stiffness"]:
                yield REFERENCE, drive["targetPosition"] * unit
            break
    for key, text in said.items():
        if key.endswith(":armature"):
            yield ARMATURE, _number(text) * (force if turns else root.number("kilogramsPerUnit"))
        elif key.endswith((":jointFriction", ":frictionloss", ":friction")):
            yield FRICTION, _number(text)
    if move.kind == "ball":
        cones = [_number(said.get(f"physics:coneAngle{k}Limit"), -1.0) for k in (0, 1)]
        if max(cones) >= 0.0 and math.isfinite(max(cones)):
            yield CONE, math.radians(max(cones))


_DRIVE = ("stiffness", "damping", "targetPosition")


def tendons_of(tree: Tree) -> Mapping[str, Mapping[str, str]]:
    """Return the numbers of forces and limits of each tendon, as written, without the law of a
    spring between two points.
    """
    springs = {strut.name for strut in tree.struts}
    return {
        name: said
        for name, each in tree.tendons.items()
        if (
            said := {
                key: each.attributes[key]
                for key in _OF_TENDON[3 * (name in springs) :]
                if key in each.attributes
            }
        )
    }


def _number(text: str | None, default: float = 0.0) -> float:
    """Return the first number of a text; the default for none."""
    try:
        return default if text is None else float(text.split()[0])
    except (ValueError, IndexError):
        return math.nan
