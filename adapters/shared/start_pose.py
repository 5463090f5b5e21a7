"""A mechanism whose design position is another one of its poses, for formats without a state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.algebra import Vec3, vec
from ...core.joints import Distance, Joint
from ...core.joints.base import Kind
from ...core.mechanism.body import Body, inertia_matrix
from ...core.mechanism.mechanism import Mechanism, Vector
from ...core.trajectory import BodyMotion
from .poses import Displacement, displacements, rotated


def at_start(mechanism: Mechanism, way: Mapping[str, BodyMotion]) -> Mechanism:
    """Return the same mechanism with the end of the way as its design position.

    A joint's point goes with its second body and its axis with its first, so that a point stays on
    its line or plane; pairs go with a body each. Distances keep their lengths. Drivers and force
    elements are left out.
    """
    placed = displacements(mechanism, way)
    return replace(
        mechanism,
        bodies=[_body(body, placed[body.name], way) for body in mechanism.bodies],
        joints=[_joint(joint, placed) for joint in mechanism.joints],
        points=[
            replace(point, position=_last(placed[point.body].of(vec(point.position))))
            for point in mechanism.points
        ],
        drivers=[],
        forces=[],
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
    # without checks: axes that a table has rounded are no better for having moved
    return joint.changed(**changes)
