"""A mechanism for formats with single links: a tree of links, ties that close its loops, and
relations of coordinates.

Every joint is a chain of slides, hinges and balls (see `joint_chains`), with auxiliary links
between several. A joint that closes a loop has its chain on its first body, and a tie of one point
or of a whole frame connects the end to its second body. Coordinates have the sense of the joint's
coordinates: a chain from the second body to the first has reversed axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

from ...core.errors import KincheckError
from ...core.joints import Distance, Joint
from ...core.mechanism.body import Body
from ...core.mechanism.mechanism import GROUND, Mechanism, Vector, spanning_tree
from ..shared.joint_chains import CHAINS, Link, end_of_loop, polynomial_in_tree, relations
from ..shared.loop_closures import ends_of
from .xml_text import link_names


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


@dataclass(frozen=True)
class Tree:
    """The parts of a mechanism for a format, except masses and points.

    Attributes:
        frames: frames of all links at design, parents before children; an auxiliary frame is
            parallel to the global axes.
        relations: name, and weights by coordinate: the weighted sum stays zero.
        curves: name, driven and driving coordinate, and the polynomial's coefficients, the constant
            first.
        coordinates: names by joint and freedom.
    """

    frames: dict[str, Body] = field(default_factory=dict[str, Body])
    joints: list[Hung] = field(default_factory=list[Hung])
    ties: list[Tie] = field(default_factory=list[Tie])
    relations: list[tuple[str, dict[str, float]]] = field(
        default_factory=list[tuple[str, dict[str, float]]]
    )
    curves: list[tuple[str, str, str, list[float]]] = field(
        default_factory=list[tuple[str, str, str, list[float]]]
    )
    coordinates: dict[tuple[str, str], str] = field(default_factory=dict[tuple[str, str], str])


def require_known(mechanism: Mechanism, title: str) -> None:
    """Refuse joints without a counterpart.

    Raises:
        KincheckError: a joint is neither a chain nor a distance.
    """
    for joint in mechanism.joints:
        if type(joint) not in CHAINS and type(joint) is not Distance:
            raise KincheckError(
                f"{joint} has no counterpart in {title} here; write an equivalent of known joints"
                " instead"
            )


def hung(mechanism: Mechanism) -> Tree:
    """Return the mechanism as tree, ties and relations, at its design position."""
    tree = Tree()
    for body in mechanism.bodies:
        if body.fixed:
            tree.frames[body.name] = body
            tree.joints.append(Hung(f"{body.name}.fixed", "fixed", GROUND, body.name, body.origin))
    spanning = spanning_tree(mechanism)
    for branch in spanning.branches:
        body, joint = mechanism.body(branch.child), branch.joint
        if joint is None:
            tree.frames[body.name] = body
            tree.joints.append(Hung(f"{body.name}.free", "free", GROUND, body.name, body.origin))
            continue
        P = ends_of(mechanism, joint)[0]
        links, forward = CHAINS[type(joint)](joint, P), joint.j == body.name
        parent = joint.bodies[not forward]
        _hang(tree, joint, links, parent, body, P, forward=forward)
    for joint in spanning.cut:
        _close(tree, mechanism, joint)
    for coupler in mechanism.couplers:
        terms = [(tree.coordinates[each, freedom], w) for each, freedom, w in coupler.terms]
        if coupler.curve:
            (driven, _), (driving, weight) = terms
            follows = polynomial_in_tree(weight, coupler.curve, 1.0, 1.0)
            tree.curves.append((coupler.name, driven, driving, follows))
        else:
            tree.relations.append((coupler.name, dict(terms)))
    return tree


def _hang(
    tree: Tree,
    joint: Joint,
    links: Sequence[Link],
    parent: str,
    end: Body | None,
    P: Vector,
    *,
    forward: bool = True,
) -> str:
    """Add a chain to a parent, with a body at its end or only auxiliary links; return the name of
    the last link.
    """
    chain = [*zip(link_names(joint.name, links), links, strict=True)]
    for k, (name, link) in enumerate(chain if forward else chain[::-1], 1):
        last = end is not None and k == len(chain)
        child = end if last and end is not None else Body(f"{name}.link", link.point)
        x, y, z = link.axis
        axis = link.axis if forward else (-x, -y, -z)
        tree.frames[child.name] = child
        tree.joints.append(Hung(name, link.move, parent, child.name, link.point, axis))
        if link.name:
            tree.coordinates[joint.name, link.name] = name
        parent = child.name
    if end is not None and not chain:
        tree.frames[end.name] = end
        tree.joints.append(Hung(joint.name, "fixed", parent, end.name, P))
    for relation in relations(joint):
        weights = {tree.coordinates[name, freedom]: weight for name, freedom, weight in relation}
        tree.relations.append((joint.name, weights))
    return parent


def _close(tree: Tree, mechanism: Mechanism, joint: Joint) -> None:
    ends = ends_of(mechanism, joint)
    if isinstance(joint, Distance):
        tree.ties.append(Tie(joint.name, joint.bodies, ends, length=joint.rod_length))
        return
    links, point, turns = end_of_loop(CHAINS[type(joint)](joint, ends[0]), ends[0])
    last = _hang(tree, joint, links, joint.i, None, point)
    tree.ties.append(Tie(joint.name, (last, joint.j), (point, point), whole=not turns))
