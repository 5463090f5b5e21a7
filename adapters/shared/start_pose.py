"""A mechanism with another pose as its design position, for formats without a state."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial as Powers

from ...core.algebra import Vec3, vec
from ...core.joints import Coupler, Distance, Joint, Polynomial
from ...core.joints.base import Kind
from ...core.mechanism.body import Body, inertia_matrix
from ...core.mechanism.loads import ForceElement, SpringDamper, TorsionSpringDamper
from ...core.mechanism.mechanism import Mechanism, Vector
from ...core.trajectory import BodyMotion
from .poses import Displacement, displacements, link_coordinates, rotated
from .tree_plan import CHAINS, ends_of


def at_start(mechanism: Mechanism, way: Mapping[str, BodyMotion]) -> Mechanism:
    """Return the mechanism with the end of the way as its design position.

    A joint's point moves with its second body and its axis with its first, so that a point stays on
    its line or plane; of a pair, each element moves with its body. Distances keep their lengths.
    Coordinates of polynomials and of torsional springs count from the start. Drivers, forces and
    torques are left out.
    """
    placed = displacements(mechanism, way)

    def coordinate(joint: Joint, freedom: str) -> float:
        links = CHAINS[type(joint)](joint, ends_of(mechanism, joint)[0])
        values = link_coordinates(joint, links, placed)
        found = {link.name: value[0] for link, value in zip(links, values, strict=True)}
        return found[freedom]

    def coupler(each: Coupler) -> Coupler:
        if not isinstance(each, Polynomial):
            return each
        named = zip(each.joints, each.freedoms, strict=True)
        y, x = (coordinate(mechanism.joint(name), freedom) for name, freedom in named)
        moved = Powers(each.coefficients)(Powers((x, 1.0))) - y
        return replace(each, coefficients=(*moved.coef.tolist(),))

    def springs() -> Iterator[ForceElement]:
        for each in mechanism.forces:
            if isinstance(each, SpringDamper):
                ends = zip(each.bodies, each.points, strict=True)
                P, Q = (_last(placed[body].of(vec(point))) for body, point in ends)
                yield replace(each, points=(P, Q))
            elif isinstance(each, TorsionSpringDamper):
                angle = coordinate(mechanism.joint(each.joint), "rotation")
                yield replace(each, free_angle=each.free_angle - angle)

    return mechanism.with_joints(
        lambda joint: _joint(joint, placed),
        bodies=[_body(body, placed[body.name], way) for body in mechanism.bodies],
        points=[
            replace(point, position=_last(placed[point.body].of(vec(point.position))))
            for point in mechanism.points
        ],
        drivers=[],
        couplers=[coupler(each) for each in mechanism.couplers],
        forces=[*springs()],
    )


def _last(a: Vec3) -> Vector:
    x, y, z = (float(np.ravel(each)[-1]) for each in a)
    return x, y, z


def _body(body: Body, placed: Displacement, way: Mapping[str, BodyMotion]) -> Body:
    if body.name not in way:
        return body
    x, y, z = way[body.name].r[-1].tolist()
    changes: dict[str, Any] = {"euler_parameters": (*way[body.name].p[-1].tolist(),)}
    if body.center_of_mass is not None:
        changes["center_of_mass"] = _last(placed.of(vec(body.center_of_mass)))
    if body.inertia is not None:
        turn = np.column_stack([_last(rotated(placed.turn, vec(e))) for e in np.eye(3).tolist()])
        moved = turn @ inertia_matrix(body.inertia) @ turn.T
        xx, yy, zz = np.diag(moved).tolist()
        changes["inertia"] = (xx, yy, zz, *(float(moved[at]) for at in ((0, 1), (1, 2), (0, 2))))
    return replace(body, origin=(x, y, z), **changes)


def _joint(joint: Joint, placed: Mapping[str, Displacement]) -> Joint:
    def moved(kind: Kind, value: Any, body: str) -> Vector:
        if kind is Kind.POSITION:
            return _last(placed[body].of(vec(value)))
        return _last(rotated(placed[body].turn, vec(value)))

    changes: dict[str, Any] = {}
    for name, kind, value in joint.geometry():
        if kind.single is Kind.LENGTH:
            continue
        if kind.pair:
            changes[name] = tuple(
                moved(kind.single, one, body) for one, body in zip(value, joint.bodies, strict=True)
            )
        else:
            changes[name] = moved(kind, value, joint.j if kind is Kind.POSITION else joint.i)
    if isinstance(joint, Distance):
        changes["length"] = joint.rod_length
    # without checks: axes rounded by a table stay rounded after the motion
    return joint.changed(**changes)
