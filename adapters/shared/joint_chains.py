"""Joints as chains of links, for simulators with slides, hinges and balls.

A chain leads from a joint's first body to its second; each link moves on the previous one, and
points and axes are global at design. A chain allows the same motion as the joint, so it replaces
the joint in a tree; a tie of its last body to the joint's second body closes a loop. The chain of a
joint that constrains only a point ends in a ball.

Two joints need relations between links. A screw couples its slide to its hinge. A constant-velocity
joint is two Hooke's joints in one point with equal bends: hinges n, m, m, n across the bisector b
of the shafts, the outer angles equal and the inner ones too. A half turn about b transforms the
rotation R = N(x) M(2y) N(x) into its inverse, so the axis of R is normal to b. This is the joint's
condition: R moves the second shaft, the image of the first under the half turn about b, without
twist.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

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
    Planar,
    Revolute,
    RevoluteSpherical,
    Screw,
    Spherical,
    Translational,
    Universal,
)
from ...core.joints.base import triad, unit
from ...core.mechanism.mechanism import Vector


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


Coordinate = TypeVar("Coordinate")


def dependence(terms: Iterable[tuple[Coordinate, float]]) -> tuple[Coordinate, Coordinate, float]:
    """Solve a relation of two coordinates for `one`: return `one`, `other` and the factor in one =
    factor * other.

    `one` has the larger weight, so the absolute factor is at most one.
    """
    (other, small), (one, large) = sorted(terms, key=lambda term: abs(term[1]))
    return one, other, -small / large


def polynomial_in_tree(
    weight: float, curve: Sequence[float], driven: float, driving: float
) -> list[float]:
    """Return the polynomial coefficients, the constant first, by which a coordinate of a tree
    follows another.

    Args:
        weight, curve: weight and curve of the driving coordinate, see `Coupler.terms` and
            `Coupler.curve`.
        driven, driving: signs of both coordinates in the tree.
    """
    found = [-c for c in curve]
    if len(found) > 1:
        found[1] -= weight
    return [c * driven * driving**k for k, c in enumerate(found)]


def end_of_loop(links: Sequence[Link], P: Vector) -> tuple[Sequence[Link], Vector, bool]:
    """Return the links of a chain for a loop, and the point of the tie to its last body.

    Returns:
        The links, the point (P, or the centre of a ball), and whether the bodies may rotate about
        it: a ball at the end of a chain is not a link, because a tie of points allows the same
        rotation.
    """
    if links and links[-1].move == "ball":
        return links[:-1], links[-1].point, True
    return links, P, False


def _unit(axis: Sequence[float]) -> Vector:
    x, y, z = unit(axis)
    return x, y, z
