"""A mechanism for formats with single links: a tree of links, ties that close its loops, and
relations of coordinates; see `tree_plan`.

Simulators hold points best: a loop is cut at a distance, a ball or a hinge if it has one, and a
hinge is two points of its axis. Other joints that close a loop end in an auxiliary link, tied as a
whole frame to a body that shares its mass with it: a tie of a link without a mass is soft.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np

from ...core.algebra import triple
from ...core.errors import KincheckError
from ...core.joints import Distance, Fixed, Joint, PiecewisePolynomial, Revolute, Spherical
from ...core.joints.base import unit
from ...core.mechanism.body import Body
from ...core.mechanism.loads import TorsionSpringDamper
from ...core.mechanism.mechanism import GROUND, Mechanism, Vector
from ..shared.tree_plan import CHAINS, Chain, Closure, Relation, ends_of, plan_tree, relations
from .text import link_between


@dataclass(frozen=True)
class TreeJoint:
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


Following: TypeAlias = tuple[str, str, str, PiecewisePolynomial]


@dataclass(frozen=True)
class Tree:
    """The parts of a mechanism for a format, except masses and points.

    Attributes:
        frames: frames of all links at design, parents before children; an auxiliary frame is
            parallel to the global axes.
        relations, curves: name, coordinate that follows another, the other, and the line or
            function that it follows.
        coordinates: names by joint and freedom.
    """

    frames: dict[str, Body] = field(default_factory=dict[str, Body])
    joints: list[TreeJoint] = field(default_factory=list[TreeJoint])
    ties: list[Tie] = field(default_factory=list[Tie])
    relations: list[Following] = field(default_factory=list[Following])
    curves: list[Following] = field(default_factory=list[Following])
    coordinates: dict[tuple[str, str], str] = field(default_factory=dict[tuple[str, str], str])


def plan(
    mechanism: Mechanism, auxiliary: str = "{joint}.auxiliary"
) -> Iterator[Chain | Relation | Closure]:
    """Yield the parts of a mechanism, with loops cut at joints of points; see `plan_tree`.

    Joints whose coordinates others use, by a coupling or a spring, keep them.
    """
    counted = {name for coupler in mechanism.couplers for name in coupler.joints}
    counted |= {each.joint for each in mechanism.forces if isinstance(each, TorsionSpringDamper)}
    counted |= {joint.name for joint in mechanism.joints if relations(joint)}
    points = (Distance, Revolute, Spherical)
    held = {joint.name for joint in mechanism.joints if type(joint) not in points}
    parts = plan_tree(
        mechanism,
        whole=(Distance, Revolute),
        counted=counted,
        first=counted | held,
        auxiliary=auxiliary,
    )

    def from_ground(joint: Joint | None) -> bool:
        """Return whether its links end on the ground with a whole frame: they begin there instead,
        and the tie is to a body with a mass.
        """
        if joint is None or mechanism.is_fixed(joint.i) or not mechanism.is_fixed(joint.j):
            return False
        return all(
            link.move != "ball" for link in CHAINS[type(joint)](joint, ends_of(mechanism, joint)[0])
        )

    for part in parts:
        match part:
            case Chain(joint, links=links, cut=True) if from_ground(joint):
                assert joint is not None
                yield replace(part, parent=joint.j, links=links[::-1], sign=-1)
            case Closure(joint, ends, by=by, links=[_, *_]) if by is Fixed and from_ground(joint):
                yield replace(part, ends=(ends[0], joint.i))
            case _:
                yield part


def extent(mechanism: Mechanism) -> float:
    """Return the largest distance of the joints' points along an axis, or 1 m without any [m]."""
    points = [
        P for joint in mechanism.joints for body in joint.bodies for P in joint.points_on(body)
    ]
    return float(np.ptp(points, axis=0).max(initial=0.0)) or 1.0 if points else 1.0


def ties(closure: Closure, mechanism: Mechanism) -> list[Tie]:
    """Return the ties of a cut joint; a hinge is two points, a quarter of the mechanism's extent to
    both sides of its own.
    """
    joint = closure.joint
    if closure.by is not Revolute:
        length = joint.rod_length if isinstance(joint, Distance) else None
        return [Tie(joint.name, closure.ends, closure.points, closure.by is Fixed, length)]
    assert isinstance(joint, Revolute)
    arm = 0.25 * extent(mechanism) * np.array([*unit(joint.axis)])
    points = [triple(np.array(joint.point) + side * arm) for side in (-1.0, 1.0)]
    names = joint.name, f"{joint.name}.2"
    return [Tie(name, closure.ends, (P, P)) for name, P in zip(names, points, strict=True)]


def share_masses(frames: dict[str, Body], ties: Sequence[Tie], mechanism: Mechanism) -> None:
    """Divide the mass of a body equally between it and the auxiliary links tied to it as a whole.

    Args:
        frames: of all links; those of auxiliary links have no mass yet.
    """
    known = {GROUND, *(body.name for body in mechanism.bodies)}
    welded = [tie for tie in ties if tie.whole and tie.links[0] not in known]
    ends = [tie.links[1] for tie in welded]
    for tie in welded:
        (link, end), part = tie.links, 1.0 / (1 + ends.count(tie.links[1]))
        if not mechanism.is_fixed(end) and (body := mechanism.body(end)).mass:
            six = body.inertia and (*(part * each for each in body.inertia),)
            center = body.center
            own = {"mass": part * body.mass, "center_of_mass": center, "inertia": six}
            frames[link], frames[end] = replace(frames[link], **own), replace(frames[end], **own)


def loops(ties: Sequence[Tie], kinds: tuple[str, str, str]) -> str:
    """Return a sentence on what closes the loops.

    Args:
        kinds: the format's words for a point, a whole frame, and a distance.
    """
    point, frame, distance = kinds
    told = [
        f"{tie.name} by {frame if tie.whole else point if tie.length is None else distance}"
        for tie in ties
    ]
    shared = any(tie.whole for tie in ties)
    why = "; auxiliary links share the masses of the bodies that they are tied to" * shared
    return f" Loops are closed at {', '.join(told)}{why}." if told else ""


def tree_of(mechanism: Mechanism) -> Tree:
    """Return the mechanism as tree, ties and relations, at its design position."""
    tree = Tree()
    for body in mechanism.bodies:
        if body.fixed:
            tree.frames[body.name] = body
            tree.joints.append(
                TreeJoint(f"{body.name}.fixed", "fixed", GROUND, body.name, body.origin)
            )
    for part in plan(mechanism, auxiliary="{last}.link"):
        match part:
            case Chain():
                _hang(tree, part, mechanism)
            case Closure():
                tree.ties.extend(ties(part, mechanism))
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
    share_masses(tree.frames, tree.ties, mechanism)
    return tree


def _hang(tree: Tree, chain: Chain, mechanism: Mechanism) -> None:
    joint, end = chain.joint, None if chain.cut else mechanism.body(chain.child)
    if end is not None and (joint is None or not chain.links):
        tree.frames[end.name] = end
        name, move = (joint.name, "fixed") if joint else (f"{end.name}.free", "free")
        tree.joints.append(TreeJoint(name, move, chain.parent, end.name, chain.point))
        return
    assert joint is not None
    for name, link, parent, child in chain.each():
        last = end or Body(child, link.point)
        between = child != chain.child
        tree.frames[child] = link_between(child, link.point, mechanism) if between else last
        tree.joints.append(TreeJoint(name, link.move, parent, child, link.point, link.axis))
        if link.name:
            tree.coordinates[joint.name, link.name] = name
