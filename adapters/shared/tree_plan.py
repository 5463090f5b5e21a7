"""The plan of a mechanism as a tree of links, for simulators and formats with slides, hinges and
balls: which links carry which body, how cut joints are closed, which coordinates are related.

A chain of links leads from a joint's first body to its second; each link moves on the previous one,
and points and axes are global at design. A chain allows the same motion as the joint, so it
replaces the joint in a tree; a tie of its last body to the joint's second body closes a loop. The
chain of a joint that constrains only a point ends in a ball.

Two joints need relations between links. A screw couples its slide to its hinge. A constant-velocity
joint is two Hooke's joints in one point with equal bends: hinges n, m, m, n across the bisector b
of the shafts, the outer angles equal and the inner ones too. A half turn about b transforms the
rotation R = N(x) M(2y) N(x) into its inverse, so the axis of R is normal to b. This is the joint's
condition: R moves the second shaft, the image of the first under the half turn about b, without
twist.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from ...core.algebra import triple
from ...core.joints import (
    AxialJoint,
    ConstantVelocity,
    Cylindrical,
    Fixed,
    Inline,
    InPlane,
    Joint,
    OrientationLock,
    ParallelAxes,
    PerpendicularAxes,
    PiecewisePolynomial,
    Planar,
    Revolute,
    RevoluteSpherical,
    Screw,
    Spherical,
    Translational,
    Universal,
)
from ...core.joints.base import triad, unit
from ...core.mechanism.body import Body
from ...core.mechanism.mechanism import GROUND, Mechanism, Vector
from ...core.mechanism.tree import spanning_tree
from ...core.trajectory import Array


@dataclass(frozen=True)
class Link:
    """One freedom, or the three freedoms of a ball.

    Attributes:
        axis: unit vector, global at design [-]; unused for a ball.
        point: point on the axis, or the ball's centre, global at design [m]; unused for a slide.
        name: name of the coordinate; the name of the joint's freedom if drivers and couplers may
            use it.
    """

    move: Literal["slide", "hinge", "ball"]
    axis: Vector
    point: Vector
    name: str = ""


def _slide(axis: Sequence[float], P: Vector, name: str = "") -> Link:
    return Link("slide", _unit(axis), P, name)


def _hinge(axis: Sequence[float], P: Vector, name: str = "") -> Link:
    return Link("hinge", _unit(axis), P, name)


def _ball(P: Vector) -> Link:
    return Link("ball", (0.0, 0.0, 1.0), P)


def _shift(P: Vector) -> list[Link]:
    return [_slide(axis, P) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]


def _across(axis: Sequence[float], P: Vector) -> list[Link]:
    f, g, _ = triad(axis)
    return [_slide([*a], P) for a in (f, g)]


def _turn_and_slide(joint: AxialJoint, P: Vector) -> list[Link]:
    return [_slide(joint.axis, P, "translation"), _hinge(joint.axis, P, "rotation")]


def _bends(joint: ConstantVelocity, P: Vector) -> list[Link]:
    h, k = map(unit, joint.axes)
    n, m, _ = ([*a] for a in triad([*(h + k)]))
    return [
        _hinge(n, P, "first"),
        _hinge(m, P, "second"),
        _hinge(m, P, "third"),
        _hinge(n, P, "fourth"),
    ]


def free(P: Vector) -> list[Link]:
    """Return the chain of a body without a joint; it turns about P."""
    return [*_shift(P), _ball(P)]


CHAINS: dict[type[Joint], Callable[[Any, Vector], list[Link]]] = {
    ConstantVelocity: _bends,
    Cylindrical: _turn_and_slide,
    Fixed: lambda joint, P: [],
    InPlane: lambda joint, P: [*_across(joint.axis, P), _ball(P)],
    Inline: lambda joint, P: [_slide(joint.axis, P), _ball(P)],
    OrientationLock: lambda joint, P: _shift(P),
    ParallelAxes: lambda joint, P: [*_shift(P), _hinge(joint.axis, P)],
    # as in a universal joint, these hinges keep the design angle of the axes if a table has rounded
    # the right angle
    PerpendicularAxes: lambda joint, P: [*_shift(P), *(_hinge(axis, P) for axis in joint.axes)],
    Planar: lambda joint, P: [*_across(joint.axis, P), _hinge(joint.axis, P, "rotation")],
    Revolute: lambda joint, P: [_hinge(joint.axis, P, "rotation")],
    RevoluteSpherical: lambda joint, P: [
        _hinge(joint.axis, joint.points[0]),
        _ball(joint.points[1]),
    ],
    Screw: _turn_and_slide,
    Spherical: lambda joint, P: [_ball(P)],
    Translational: lambda joint, P: [_slide(joint.axis, P, "translation")],
    Universal: lambda joint, P: [_hinge(axis, P) for axis in joint.axes],
}
"""Function by exact joint type: the joint and its point (a near point if it has none) -> links. A
distance has no chain.
"""


def link_names(joint: str, links: Sequence[Link]) -> list[str]:
    """Return the names of a joint's coordinates: the joint's name if it has only one, else
    JOINT.rotation, JOINT.slide2, ...
    """
    if len(links) == 1:
        return [joint]
    return [f"{joint}.{link.name or f'{link.move}{k}'}" for k, link in enumerate(links, 1)]


Terms: TypeAlias = Sequence[tuple[str, str, float]]
"""Joint, freedom and weight of the coordinates in a sum."""


@dataclass(frozen=True)
class Chain:
    """The links that carry a body, or an auxiliary body to which a cut joint is tied.

    Attributes:
        joint: the joint; None if the body is free.
        parent, child: names of the bodies.
        links: from parent to child.
        sign: -1 if the parent is the joint's second body, so that its coordinates are negative.
        point: point of the joint, or the origin of a free body; global at design [m].
        cut: whether the child is auxiliary.
    """

    joint: Joint | None
    parent: str
    child: str
    links: Sequence[Link]
    sign: int
    point: Vector
    cut: bool = False

    def each(self) -> Iterator[tuple[str, Link, str, str]]:
        """Yield the links of a joint: name of the coordinate, link, names of the bodies before and
        after, where those between are auxiliary.

        A chain from the second body to the first has reversed axes: its coordinates have the sense
        of the joint's.
        """
        assert self.joint is not None
        names = link_names(self.joint.name, self.links[:: self.sign])[:: self.sign]
        bodies = [self.parent, *(f"{name}.link" for name in names[:-1]), self.child]
        for name, link, before, after in zip(names, self.links, bodies, bodies[1:], strict=False):
            x, y, z = link.axis
            axis = link.axis if self.sign > 0 else (-x, -y, -z)
            yield name, replace(link, axis=axis), before, after


@dataclass(frozen=True)
class Relation:
    """A weighted sum of coordinates that stays zero; of two, with a function of the second added.

    Attributes:
        name: of the coupler, or of the joint whose own relation it is.
        signs: of the coordinates in the tree.
        curve: see `Coupler.curve`.
    """

    name: str
    terms: Terms
    signs: tuple[int, ...]
    curve: PiecewisePolynomial | None = None

    def follower(
        self, *, signed: bool
    ) -> tuple[tuple[str, str], tuple[str, str], PiecewisePolynomial]:
        """Return the coordinate that follows another, the other, by joint and freedom, and the
        function that it follows; of two coordinates.

        Without a curve the factor is at most one.

        Args:
            signed: whether coordinates have the signs of the tree.
        """
        signs = self.signs if signed else (1, 1)
        (joint, freedom, weight), (other, other_freedom, other_weight) = self.terms
        one, two = (joint, freedom), (other, other_freedom)
        if self.curve:
            return one, two, self.curve.scaled(signs[1], -signs[0])
        weights = signs[0] * weight, signs[1] * other_weight
        if abs(weights[1]) >= abs(weights[0]):
            return two, one, PiecewisePolynomial((0.0,), ((0.0, -weights[0] / weights[1]),))
        return one, two, PiecewisePolynomial((0.0,), ((0.0, -weights[1] / weights[0]),))


@dataclass(frozen=True)
class Closure:
    """A cut joint.

    Attributes:
        ends: names of the bodies to be tied; the first may be an auxiliary body.
        points: points on them, global at design [m].
        by: type of joint whose conditions tie them: the joint's own, or a ball, a whole frame or a
            distance.
        links: moves of the joint's links from its first body to an auxiliary one.
    """

    joint: Joint
    ends: tuple[str, str]
    points: tuple[Vector, Vector]
    by: type[Joint]
    links: Sequence[str] = ()


def plan_tree(
    mechanism: Mechanism,
    *,
    whole: Collection[type[Joint]],
    counted: Collection[str] = (),
    first: Collection[str] = (),
    loose: Callable[[Joint], bool] = lambda joint: False,
    auxiliary: str = "{joint}.auxiliary",
) -> Iterator[Chain | Relation | Closure]:
    """Yield the parts of a mechanism, each after those that it needs.

    Args:
        whole: types of joints that close a loop by all their conditions at once. Others have their
            links on the first body, and a point or a frame at the end is tied to the second.
        counted: names of joints that have their links in any case, since coordinates count turns.
        first: names of joints that carry bodies if they can, as driven and coupled ones do.
        loose: returns whether a joint of the tree is cut, and its body free.
        auxiliary: name of the body at the end of a cut joint's links, by the joint and the last
            link.
    """
    signs, cut = dict[str, int](), set[str]()
    tree = spanning_tree(mechanism, first)
    names = {body.name for body in mechanism.bodies}

    def own_relations(joint: Joint) -> Iterator[Relation]:
        for terms in relations(joint):
            yield Relation(joint.name, terms, (signs[joint.name],) * 2)

    for branch in tree.branches:
        joint, body = branch.joint, mechanism.body(branch.child)
        if joint is None or loose(joint):
            cut |= {joint.name} if joint else set()
            # a predicted body is closest that turns about its middle
            links = free(triple(middle(mechanism, body)))
            yield Chain(None, GROUND, body.name, links, 1, body.origin)
            continue
        P, sign = ends_of(mechanism, joint)[0], 1 if joint.j == body.name else -1
        links, signs[joint.name] = CHAINS[type(joint)](joint, P)[::sign], sign
        yield Chain(joint, joint.bodies[sign < 0], body.name, links, sign, P)
        yield from own_relations(joint)
    cut |= {joint.name for joint in tree.cut}
    for joint in mechanism.joints:
        if joint.name not in cut:
            continue
        ends = ends_of(mechanism, joint)
        if type(joint) in whole and joint.name not in counted:
            yield Closure(joint, joint.bodies, ends, type(joint))
            continue
        links, point, tied = CHAINS[type(joint)](joint, ends[0]), ends[0], Fixed
        if links and links[-1].move == "ball":
            # no link: a tie of points allows the same rotation
            *links, ball = links
            point, tied = ball.point, Spherical
        first, signs[joint.name] = joint.i, 1
        if links:
            last = link_names(joint.name, links)[-1]
            first = auxiliary.format(joint=joint.name, last=last)
            while first in names:
                first += "'"
            yield Chain(joint, joint.i, first, links, 1, point, cut=True)
        yield from own_relations(joint)
        yield Closure(joint, (first, joint.j), (point, point), tied, [each.move for each in links])
    for coupler in mechanism.couplers:
        named = tuple(signs[name] for name in coupler.joints)
        yield Relation(coupler.name, coupler.terms, named, coupler.curve)


def relations(joint: Joint) -> list[list[tuple[str, str, float]]]:
    """Return the linear relations between a joint's coordinates: joint, freedom, weight of terms.

    The weighted sum of the terms stays zero, as for `Coupler.terms`.
    """
    found: Sequence[Mapping[str, float]] = ()
    if isinstance(joint, ConstantVelocity):
        found = {"first": 1.0, "fourth": -1.0}, {"second": 1.0, "third": -1.0}
    elif isinstance(joint, AxialJoint):
        found = joint.relations
    return [
        [(joint.name, freedom, weight) for freedom, weight in relation.items()]
        for relation in found
    ]


def middle(mechanism: Mechanism, body: Body) -> Array:
    """Return the mean of a body's joint points, or its origin without any; global at design [m],
    shape (3,).
    """
    points = [
        at
        for joint in mechanism.joints
        if body.name in joint.bodies
        for at in joint.points_on(body.name)
    ]
    return np.mean(points, axis=0) if points else np.array(body.origin)


def ends_of(mechanism: Mechanism, joint: Joint) -> tuple[Vector, Vector]:
    """Return the points of a joint's frames on its first and second body, global at design [m].

    A fixed joint may lack a point, and some types have none. Any point works, and the middle of a
    moving body keeps all digits: the origin in a case file may be far away.
    """
    moving = (body for body in mechanism.moving if body.name in joint.bodies)
    P = vars(joint).get("point") or triple(middle(mechanism, next(moving)))
    return vars(joint).get("points", (P, P))


def _unit(axis: Sequence[float]) -> Vector:
    x, y, z = unit(axis)
    return x, y, z
