"""A mechanism for formats with single links: a tree of links, ties that close its loops, and
relations of coordinates; see `tree_plan`.

Coordinates have the sense of the joint's coordinates: a chain from the second body to the first has
reversed axes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from ...core.errors import KincheckError
from ...core.joints import Distance, Fixed
from ...core.mechanism.body import Body
from ...core.mechanism.mechanism import GROUND, Mechanism, Vector
from ..shared.tree_plan import Chain, Closure, Relation, plan_tree


@dataclass(frozen=True)
class Hung:
    """A joint of the tree: how a link moves on its parent.

    Attributes:
        axis: unit vector, global at design [-]; only used by a slide and a hinge.
        point: point of the joint, global at design [m].
    """

    name: str
    move: Literal["slide", "hinge", "ball", "fixed", "free"]
    parent: str
    child: str
    point: Vector
    axis: Vector = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Tie:
    """A loop closure: one point of two links, or with `whole` their frames, coincide; with a
    length, two points keep this distance [m].

    Attributes:
        points: points on the first and the second link, global at design [m].
    """

    name: str
    links: tuple[str, str]
    points: tuple[Vector, Vector]
    whole: bool = False
    length: float | None = None


Following: TypeAlias = tuple[str, str, str, list[float]]


@dataclass(frozen=True)
class Tree:
    """The parts of a mechanism for a format, except masses and points.

    Attributes:
        frames: frames of all links at design, parents before children; an auxiliary frame is
            parallel to the global axes.
        relations, curves: name, coordinate that follows another, the other, and coefficients of
            the line or polynomial that it follows, the constant first.
        coordinates: names by joint and freedom.
    """

    frames: dict[str, Body] = field(default_factory=dict[str, Body])
    joints: list[Hung] = field(default_factory=list[Hung])
    ties: list[Tie] = field(default_factory=list[Tie])
    relations: list[Following] = field(default_factory=list[Following])
    curves: list[Following] = field(default_factory=list[Following])
    coordinates: dict[tuple[str, str], str] = field(default_factory=dict[tuple[str, str], str])


def hung(mechanism: Mechanism) -> Tree:
    """Return the mechanism as tree, ties and relations, at its design position."""
    tree = Tree()
    for body in mechanism.bodies:
        if body.fixed:
            tree.frames[body.name] = body
            tree.joints.append(Hung(f"{body.name}.fixed", "fixed", GROUND, body.name, body.origin))
    for part in plan_tree(mechanism, whole=[Distance], auxiliary="{last}.link"):
        match part:
            case Chain():
                _hang(tree, part, None if part.cut else mechanism.body(part.child))
            case Closure(joint=joint):
                length = joint.rod_length if isinstance(joint, Distance) else None
                whole = part.by is Fixed
                tree.ties.append(Tie(joint.name, part.ends, part.points, whole, length))
            case Relation():
                if (count := len(part.terms)) > 2:
                    raise KincheckError(
                        f"joint {part.name!r} couples {count} joints, which has no counterpart"
                        " here; write MJCF or URDF instead"
                    )
                one, other, curve = part.follower(signed=False)
                names = tree.coordinates[one], tree.coordinates[other]
                found = tree.curves if part.curve else tree.relations
                found.append((part.name, *names, curve))
    return tree


def _hang(tree: Tree, chain: Chain, end: Body | None) -> None:
    joint = chain.joint
    if end is not None and (joint is None or not chain.links):
        tree.frames[end.name] = end
        name, move = (joint.name, "fixed") if joint else (f"{end.name}.free", "free")
        tree.joints.append(Hung(name, move, chain.parent, end.name, chain.point))
        return
    assert joint is not None
    for name, link, parent, child in chain.each():
        tree.frames[child] = end if end and child == end.name else Body(child, link.point)
        x, y, z = link.axis
        axis = link.axis if chain.sign > 0 else (-x, -y, -z)
        tree.joints.append(Hung(name, link.move, parent, child, link.point, axis))
        if link.name:
            tree.coordinates[joint.name, link.name] = name
